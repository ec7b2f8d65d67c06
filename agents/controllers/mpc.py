"""Model-predictive control of the contact force over a short horizon."""

from dataclasses import dataclass, field
from functools import cache
from typing import Any

import casadi as ca
import numpy as np

from agents.controllers.lag import Lag, seen_cables
from agents.policy import Observation, Tare, search, set_points
from agents.tuned import MPC, MPCSettings

SMALLEST_MM = 0.005  # moves below are not worth taking up the play for


@dataclass(slots=True)
class PredictiveController:
    """Plans the moves of the cable that bring a force which is linear in them along the set-points ahead.

    The plan is a quadratic programme, solved by CasADi at every step, whose first move is made. What it needs is
    estimated from what is seen and the known geometry of the robot: latency and play (:class:`Lag`), and with them the
    place of the cable that is not seen yet; force and slope there from a curve through the readings so far, those taken
    near it foremost; the zero of the sensor from before contact. In space both cables move along the way of the
    search; an insertion is left as it is.

    Attributes:
        settings: What is assumed, and the weights of the plan.
    """

    settings: MPCSettings = field(default_factory=MPCSettings)
    name: str = "MPC"
    _env: Any = field(default=None, init=False)
    _lag: Lag = field(default_factory=lambda: Lag(1, 1), init=False)
    _tare: Tare = field(default_factory=Tare, init=False)
    _readings: list[tuple[float, float]] = field(default_factory=list, init=False)

    @classmethod
    def tuned(cls, env_id: str) -> "PredictiveController":
        """With the settings of least force error on training scenes with realistic sensing."""
        return cls(MPC[env_id])

    def reset(self, env: Any = None) -> None:
        """Forget the episode; the robot and the range of its motors are those of the environment."""
        self._env, self._lag = env, Lag(1, 1)
        self._tare.forget()
        self._readings.clear()

    def act(self, observation: Observation) -> np.ndarray:
        """Pull until something touches, then plan."""
        way, settings = search(observation), self._env.get_wrapper_attr("settings")
        along = way[: observation["cable"].size] / float(way @ way)
        motor = float(observation["cable"] @ along) * settings.cable_limit_mm
        place = float(seen_cables(observation, settings.robot) @ along)
        self._lag.see(np.array([[motor]]), np.array([[place]]))
        here, slack = self._lag.places.item(), self._lag.slack.item()
        measured = self._tare.force(observation)
        if measured is None:
            return way
        self._readings.append((place, float(np.linalg.norm(measured))))
        force, slope = self._curve(here)
        full, goals = settings.max_increment_mm, set_points(observation, self.settings.horizon)
        move = full * self._plan(max(slope, self.settings.least_slope) * full, force, goals)
        if abs(move) < SMALLEST_MM:
            return 0.0 * way
        effort = (here + move + np.copysign(slack, move) - motor) / full
        return np.asarray(min(max(effort, -1.0), 1.0) * way, np.float32)

    def _curve(self, place: float) -> tuple[float, float]:
        """Force [N] and its slope [N/mm] at a place, from a curve through the readings, those near it foremost.

        The curve stiffens at a rate that is assumed, ``F + F' (exp(κ d) − 1) / κ`` at a distance d; an assumed slope is
        a reading as well.
        """
        places, forces = np.array(self._readings).T
        away, rate, trust = places - place, self.settings.stiffening, self.settings.trust
        width = self.settings.width_mm + np.abs(away).min()
        weights = np.exp(-0.5 * (away / width) ** 2)
        shape = np.expm1(rate * away) / rate
        cross = weights @ shape
        matrix = np.array([[weights.sum(), cross], [cross, weights @ shape**2 + trust]])
        force, slope = np.linalg.solve(
            matrix, [weights @ forces, weights @ (shape * forces) + trust * self.settings.slope]
        )
        return float(force), float(slope)

    def _plan(self, gain: float, force: float, goals: np.ndarray) -> float:
        """The first of the moves that are planned, in full increments."""
        programme = plan(self.settings.horizon, self.settings.effort)
        moves = programme(p=np.concatenate([[gain, force], goals]), lbx=-1.0, ubx=1.0)["x"]
        return float(moves[0])


@cache
def plan(horizon: int, effort: float) -> ca.Function:
    """The quadratic programme of a plan, in moves ``(horizon,)`` within [−1, 1].

    Its parameters are the force that a move adds [N], the present force [N] and the set-points ``(horizon,)`` [N].
    """
    moves, told = ca.SX.sym("moves", horizon), ca.SX.sym("told", 2 + horizon)
    gain, force, goals = told[0], told[1], told[2:]
    lacking = goals - force - gain * ca.cumsum(moves)
    cost = ca.sumsqr(lacking) + effort * gain**2 * ca.sumsqr(moves)
    options = {"print_iter": False, "print_header": False, "print_info": False, "print_time": False}
    return ca.qpsol("plan", "qrqp", {"x": moves, "p": told, "f": 1e4 * cost}, options)
