"""Newton steps on the exact model, and the oracle: an upper bound that sees every hidden quantity."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import bisect

from agents.arguments import check_real
from agents.environment import Environment, require_entries, require_env, require_reset
from agents.estimation.robot import RobotEstimator
from agents.policy import Observation, motor_actions, natural, search, set_points
from agents.tuned import NEWTON_GAIN
from ccr_gym import ActionSpec, PrivilegedState, Scales

CLOSER = 0.5  # share of the missing force that a Newton step may leave
REACHED = 1e-9  # force error that is roundoff, for which no motor crosses its backlash [EI/L²]


@dataclass(slots=True)
class NewtonController:
    """Newton steps on the exact slopes of the contact force in the actuated displacements.

    It knows the model, the scene and the state of the robot, which policies do not see, but neither rigidity nor
    backlash: these are what :class:`agents.estimation.robot.RobotEstimator` knows of them. The oracle sees all of
    these, the true force and the next set-point: it is an upper bound, not a competitor, and with one action it
    searches where a Newton step does not bring a magnitude closer. Of several actions both make the smallest
    increments that reach the set-point, or come closest to a vector.

    Attributes:
        oracle: Whether it sees every hidden quantity.
        gain: Share of a Newton step that is made.
        damping: Slope of the force below which it is not trusted [EI/L² per a].
        name: Name of the policy.

    Raises:
        ValueError: If gain or damping is no number of their ranges.
    """

    oracle: bool = False
    gain: float = NEWTON_GAIN
    damping: float = 0.005
    name: str = "Newton"
    _env: Environment = field(init=False)
    _actions: ActionSpec = field(init=False)
    _estimator: RobotEstimator = field(init=False)

    def __post_init__(self) -> None:
        self.gain = check_real("gain", self.gain, 0.0)
        self.damping = check_real("damping", self.damping, 0.0)

    @classmethod
    def knowing(cls) -> "NewtonController":
        """Return the oracle."""
        return cls(oracle=True, gain=1.0, name="Oracle")

    def reset(self, env: Environment | None = None) -> None:
        """Forget the episode and take the environment whose equilibrium is known.

        Raises:
            ValueError: If there is no environment.
            TypeError: If it is none of ccr_gym, or several.
        """
        self._env = require_env(env)
        self._actions = self._env.get_wrapper_attr("action_spec")
        self._estimator = RobotEstimator(self._env.get_wrapper_attr("settings"), 1)

    def act(self, observation: Observation) -> np.ndarray:
        """Return the search action until something touches, then a step to the force of the set-point.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
            ValueError: If the observation is none of ``obs_mode="dict"``.
        """
        require_reset(self)
        require_entries(observation)
        scales = self._env.get_wrapper_attr("settings").scales
        known = state = natural(self._env.get_wrapper_attr("privileged_state"), scales)
        if not self.oracle:
            state = self._estimated(observation, known)
        if not state.force.any():
            return search(observation)
        slopes = self._slopes(known, float(np.linalg.norm(state.force)), scales)
        if np.ndim(state.goal) == 0:  # a magnitude: only the component along the present force counts
            size = float(np.linalg.norm(state.force))
            slopes, missing = slopes @ (state.force / size)[:, None], np.array([state.goal - size])
        else:
            missing = state.goal - state.force
        missing = np.where(np.abs(missing) < REACHED, 0.0, missing)
        increments = self._actions.increment_mm / scales.travel_mm
        moves = self.gain * self._step(slopes, missing, state, scales)
        if self.oracle and moves.size == missing.size == 1 and missing.any():
            moves = self._guarded(moves, float(missing[0]), state, scales)
        return motor_actions(moves, state, increments)

    def _step(self, slopes: np.ndarray, missing: np.ndarray, state: PrivilegedState, scales: Scales) -> np.ndarray:
        """Return the damped least-squares increments, ``(actions,)`` [a], that add the missing force.

        A motor at the end of its range is taken out, and the remaining ones make up for it.
        """
        free, damping = np.ones(len(slopes), bool), (state.rigidity_ratio * self.damping) ** 2
        low, high = self._actions.low_mm / scales.travel_mm, self._actions.high_mm / scales.travel_mm
        for _ in free:
            increments = np.linalg.solve(slopes @ slopes.T + damping * np.eye(len(slopes)), slopes @ missing)
            above, below = state.motor_mm > low, state.motor_mm < high
            free &= np.where(increments > 0, below, above)
            slopes = slopes * free[:, None]
        return np.asarray(increments)

    def _guarded(self, moves: np.ndarray, missing: float, state: PrivilegedState, scales: Scales) -> np.ndarray:
        """Return the moves of a Newton step that halves the missing magnitude, else those to the nearest set-point.

        The force has a kink where another node takes the contact, and stops growing with the cable in places. Newton
        steps can alternate between the sides of a kink, or around a least force above the set-point. The nearest place
        on their line where the force is the set-point stays the nearest on the way there.
        """
        travel, increments = scales.travel_mm, self._actions.increment_mm / scales.travel_mm
        low, high = self._actions.low_mm / travel, self._actions.high_mm / travel
        full = float(np.abs(moves / increments).max())
        if full == 0:
            return moves
        along, probe = moves / full, self._env.get_wrapper_attr("probe")
        here = float(np.linalg.norm(probe(state.actuated_mm * travel)))
        factor = float(np.linalg.norm(state.force)) / max(here, REACHED)

        def lacks(actions: float) -> float:
            force = probe(np.clip(state.actuated_mm + actions * along, low, high) * travel)
            return float(state.goal - factor * np.linalg.norm(force))

        if full <= 1 and abs(lacks(full)) <= CLOSER * abs(missing):
            return moves
        return along * closest(lacks, float(((high - low) / increments).max()))

    def _estimated(self, observation: Observation, state: PrivilegedState) -> PrivilegedState:
        """Return the state with every hidden quantity replaced by its estimate."""
        known, cables = self._estimator.update_one(observation), observation["cable"].size
        span = self._env.get_wrapper_attr("settings").force_span
        vector = span * observation["desired_force"].astype(float)
        goal = vector if vector.size > 1 else set_points(observation, 1, span).item()
        ratio = float(known.rigidity)
        force = ratio / state.rigidity_ratio * state.force  # from the nominal model's
        slack = np.where(np.arange(state.half_backlash_mm.size) < cables, known.half_backlash, 0.0)  # insertion: none
        return state._replace(force=force, rigidity_ratio=ratio, goal=goal, half_backlash_mm=slack)

    def _slopes(self, known: PrivilegedState, size: float, scales: Scales) -> np.ndarray:
        """Return the slopes of the regulated force in the actuated displacements, ``(actions, d)`` [EI/L² per a].

        They are those of the contact force, times the ratio of the regulated force's magnitude to it.
        """
        slopes = self._env.get_wrapper_attr("force_slopes")() * (scales.travel_mm / scales.force_n)
        return np.asarray(slopes * (size / max(float(np.linalg.norm(known.force)), REACHED)))


def closest(lacks: Callable[[float], float], farthest: float) -> float:
    """Return the number of full actions after which the least force is missing, the nearest zero if there is one.

    A sign that changes in a jump, as where the robot slips off, is no zero.

    Args:
        lacks: The force that is missing after a number of actions, of either sign.
        farthest: Number of actions that are tried, either way.
    """
    here = lacks(0.0)
    tried, last = [(abs(here), 0.0)], {1.0: here, -1.0: here}
    for step in range(math.ceil(farthest)):
        for way, before in last.items():
            outer = way * (step + 1)
            last[way] = missing = lacks(outer)
            tried.append((abs(missing), outer))
            if missing * before <= 0:
                zero = float(bisect(lacks, way * step, outer))
                if abs(left := lacks(zero)) <= CLOSER * abs(here):
                    return zero
                tried.append((abs(left), zero))
    return min(tried, key=lambda pair: pair[0])[1]  # of equals the first, which is to stay
