"""Newton steps on the exact model, and the oracle: an upper bound that sees every hidden quantity."""

from dataclasses import dataclass, field

import numpy as np

from agents.controllers.lag import LagEstimator, observed_commands
from agents.controllers.tare import Tare
from agents.environment import Environment, require_env
from agents.policy import Observation, motor_actions, natural, search, set_points
from agents.tuned import NEWTON_GAIN
from ccr_gym import FORCE_SPAN, ActionSpec, PrivilegedState, Scales

PROBE = 1e-4  # trial move of a finite difference [a]
REACHED = 1e-9  # force error that is roundoff, for which no motor crosses its backlash [EI/L²]
PRIOR = np.full(2, 4e-5)  # a reading at the resolution of a sensor that agrees with the model [(EI/L²)²]


@dataclass(slots=True)
class NewtonController:
    """Newton steps on the slopes of the contact force in the actuated displacements, from trial moves that are solved.

    It knows the model, the scene and the state of the robot, which policies do not see, but not the rigidity: that it
    estimates as the ratio of the sensor readings to the model's forces one latency earlier. The zero of the sensor
    comes from the time before contact; latency and backlash come from the observed shape (:class:`LagEstimator`). The
    oracle sees all of these, the true force and the next set-point: it is an upper bound, not a competitor. Of several
    actions it makes the smallest increments that reach the set-point, or come closest to a vector.

    Attributes:
        oracle: Whether it sees every hidden quantity.
        gain: Share of a Newton step that is made.
        damping: Slope of the force below which it is not trusted [EI/L² per a].
        name: Name of the policy.
    """

    oracle: bool = False
    gain: float = NEWTON_GAIN
    damping: float = 0.005
    name: str = "Newton"
    _env: Environment = field(init=False)
    _actions: ActionSpec = field(init=False)
    _tare: Tare = field(default_factory=Tare, init=False)
    _lag: LagEstimator = field(default_factory=lambda: LagEstimator(1, 1), init=False)
    _modelled: list[float] = field(default_factory=list, init=False)
    _fit: np.ndarray = field(default_factory=PRIOR.copy, init=False)

    @classmethod
    def knowing(cls) -> "NewtonController":
        """Return the oracle."""
        return cls(oracle=True, gain=1.0, name="Oracle")

    def reset(self, env: Environment | None = None) -> None:
        """Forget the episode and take the environment whose equilibrium is known.

        Raises:
            ValueError: If there is no environment.
        """
        self._env, self._fit = require_env(env), PRIOR.copy()
        self._actions = self._env.get_wrapper_attr("action_spec")
        self._lag = LagEstimator(1, self._actions.commands)
        self._tare.reset()
        self._modelled.clear()

    def act(self, observation: Observation) -> np.ndarray:
        """Return the search action until something touches, then a step to the force of the set-point."""
        scales = self._env.get_wrapper_attr("settings").scales
        known = state = natural(self._env.get_wrapper_attr("privileged_state"), scales)
        if not self.oracle:
            state = self._estimated(observation, known)
        if not state.force.any():
            return search(observation)
        slopes = self._slopes(known.actuated_mm, scales, float(np.linalg.norm(state.force)))
        if np.ndim(state.goal) == 0:  # a magnitude: only the component along the present force counts
            size = float(np.linalg.norm(state.force))
            slopes, missing = slopes @ (state.force / size)[:, None], np.array([state.goal - size])
        else:
            missing = state.goal - state.force
        missing = np.where(np.abs(missing) < REACHED, 0.0, missing)
        increments = self._actions.increment_mm / scales.travel_mm
        moves = self.gain * self._step(slopes, missing, state, scales)
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

    def _estimated(self, observation: Observation, state: PrivilegedState) -> PrivilegedState:
        """Return the state with every hidden quantity replaced by its estimate."""
        force, cables = state.force / state.rigidity_ratio, observation["cable"].size  # the force of the nominal model
        vector = FORCE_SPAN * observation["desired_force"].astype(float)
        goal = vector if vector.size > 1 else set_points(observation, 1).item()
        observed = observed_commands(observation, self._env.get_wrapper_attr("settings").robot)
        self._lag.update(state.motor_mm[None, :cables], observed[None])
        self._modelled.append(float(np.linalg.norm(force)))
        measured = self._tare.force(observation)
        if measured is not None:
            then = self._modelled[max(-1 - self._lag.latency.item(), -len(self._modelled))]
            self._fit = self._fit + then * np.array([np.linalg.norm(measured), then])
        ratio = self._fit[0] / self._fit[1]
        slack = np.where(
            np.arange(state.half_backlash_mm.size) < cables, self._lag.half_backlash, 0.0
        )  # an insertion has none
        return PrivilegedState(ratio * force, ratio, goal, state.actuated_mm, state.motor_mm, slack)

    def _slopes(self, actuated: np.ndarray, scales: Scales, size: float) -> np.ndarray:
        """Return the slopes of the regulated force in the actuated displacements, ``(actions, d)`` [EI/L² per a].

        They are those of the contact force, times the ratio of the regulated force's magnitude to it.
        """
        probe = self._env.get_wrapper_attr("probe")
        high = self._actions.high_mm / scales.travel_mm
        steps = np.where(actuated + PROBE > high, -PROBE, PROBE)
        here = probe(actuated * scales.travel_mm)
        there = np.array([probe(places * scales.travel_mm) for places in actuated + np.diag(steps)])
        return np.asarray((there - here) / steps[:, None] * (size / float(np.linalg.norm(here))))
