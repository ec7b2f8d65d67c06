"""Model-predictive control of the contact force over a short horizon."""

from dataclasses import dataclass, field
from functools import cache

import casadi as ca
import numpy as np

from agents.arguments import check_kind
from agents.environment import Environment, require_entries, require_env, require_reset
from agents.estimation.robot import RobotEstimator
from agents.policy import Observation, search, set_points
from agents.tuned import MPCSettings
from solver import held_signals

SMALLEST = 0.006  # change of force that is worth crossing the backlash [EI/L²]


@dataclass(slots=True)
class PredictiveController:
    """Plans cable moves that follow the previewed set-points, with a force that is linear in the moves.

    Every step solves a quadratic programme (CasADi) and makes its first move. Backlash, present displacement of the
    cable and present force are what :class:`agents.estimation.robot.RobotEstimator` knows of them; the slope comes
    from a curve through the forces so far that weights nearby places most. All cables move in the direction of the
    search; an insertion stays where it is. A robot of S sections, each of which keeps its bend, is about S² times
    as stiff: the sum of its commands counts S² times, so that the same assumptions suit it.

    Attributes:
        settings: Assumptions, and weights of the plan.
        name: Name of the policy.

    Raises:
        TypeError: If ``settings`` are none of a plan.
    """

    settings: MPCSettings = field(default_factory=MPCSettings)
    name: str = "MPC"
    _env: Environment = field(init=False)
    _estimator: RobotEstimator = field(init=False)
    _readings: list[tuple[float, float]] = field(default_factory=list, init=False)
    _steps: list[int] = field(default_factory=list, init=False)  # of the readings
    _step: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        check_kind("settings", self.settings, MPCSettings, "give MPCSettings of agents.tuned")

    def reset(self, env: Environment | None = None) -> None:
        """Forget the episode and take the robot and the range of its motors from the environment.

        Raises:
            ValueError: If there is no environment.
            TypeError: If it is none of ccr_gym, or several.
        """
        self._env = require_env(env)
        self._estimator = RobotEstimator(self._env.get_wrapper_attr("settings"), 1)
        self._readings.clear()
        self._steps.clear()
        self._step = 0

    def act(self, observation: Observation) -> np.ndarray:
        """Return the search action until something touches, then the first move of a plan.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
            ValueError: If the observation is none of ``obs_mode="dict"``.
        """
        require_reset(self)
        require_entries(observation)
        direction, settings = search(observation), self._env.get_wrapper_attr("settings")
        span, travel = settings.actuation.sections**3, settings.scales.travel_mm
        along = direction[: observation["cable"].size] / float(direction @ direction)
        motor = float(observation["cable"] @ along) * settings.cable_limit_mm / travel
        known = self._estimator.update_one(observation)
        self._step += 1
        if not observation["contact"].any():
            return direction
        cable = float(known.cables @ along)
        self._readings.append((span * cable, float(known.force)))
        self._steps.append(self._step)
        increment = span * settings.max_increment_mm / travel
        move = self._move(span * cable, increment, set_points(observation, self.settings.horizon, settings.force_span))
        if move == 0:
            return np.zeros_like(direction)
        play = cable + np.copysign(float(known.half_backlash), move) - motor
        action = min(max((move + span * play) / increment, -1.0), 1.0)
        return np.asarray(action * direction, np.float32)

    def _move(self, cable: float, increment: float, goals: np.ndarray) -> float:
        """Return the first move of a plan from a cable displacement [a], 0 where it adds too little force."""
        force, slope, ahead = self._forecast(cable, len(goals))
        slope = max(slope, self.settings.least_slope)
        move = increment * self._plan(slope * increment, force, goals - ahead)
        return 0.0 if abs(slope * move) < SMALLEST else move

    def _forecast(self, cable: float, horizon: int) -> tuple[float, float, np.ndarray]:
        """Return force and slope at a displacement, and what coming steps add without a move, ``(horizon,)``."""
        return *self._curve(cable), np.zeros(horizon)

    def _curve(self, cable: float) -> tuple[float, float]:
        """Return force [EI/L²] and slope [EI/L² per a] at a displacement, from a weighted fit through the readings.

        The curve stiffens at an assumed rate κ: ``F + F' (exp(κ d) − 1) / κ`` at a distance d. The assumed slope enters
        the fit as one more reading.
        """
        away, forces = np.array(self._readings).T - [[cable], [0.0]]
        trust, weights, shape = self.settings.trust, self._nearness(away), self._bend(away)
        cross = weights @ shape
        matrix = np.array([[weights.sum(), cross], [cross, weights @ shape**2 + trust]])
        force, slope = np.linalg.solve(
            matrix, [weights @ forces, weights @ (shape * forces) + trust * self.settings.slope]
        )
        return float(force), float(slope)

    def _nearness(self, away: np.ndarray) -> np.ndarray:
        """Return the weights of readings at distances [a]."""
        width = self.settings.width + np.abs(away).min()
        return np.asarray(np.exp(-0.5 * (away / width) ** 2))

    def _bend(self, away: np.ndarray) -> np.ndarray:
        """Return what the force adds at distances [a], over its slope [a]."""
        return np.asarray(np.expm1(self.settings.stiffening * away) / self.settings.stiffening)

    def _plan(self, gain: float, force: float, goals: np.ndarray) -> float:
        """Return the first move of a plan, in full increments."""
        with held_signals():
            programme = plan(self.settings.horizon, self.settings.effort)
            moves = programme(p=np.concatenate([[gain, force], goals]), lbx=-1.0, ubx=1.0)["x"]
            return float(moves[0])


@cache
def plan(horizon: int, effort: float) -> ca.Function:
    """Return the quadratic programme of a plan, in moves ``(horizon,)`` within [−1, 1].

    Its parameters are the force that a full move adds, the present force and the set-points ``(horizon,)`` [EI/L²].
    """
    moves, parameters = ca.SX.sym("moves", horizon), ca.SX.sym("parameters", 2 + horizon)
    gain, force, goals = parameters[0], parameters[1], parameters[2:]
    errors = goals - force - gain * ca.cumsum(moves)
    cost = ca.sumsqr(errors) + effort * gain**2 * ca.sumsqr(moves)
    options = {"print_iter": False, "print_header": False, "print_info": False, "print_time": False}
    return ca.qpsol("plan", "qrqp", {"x": moves, "p": parameters, "f": 100 * cost}, options)
