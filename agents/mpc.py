"""Model-predictive control of the contact force over a short horizon."""

from dataclasses import dataclass, field
from functools import cache
from typing import Any

import casadi as ca
import numpy as np

from agents.policy import Observation, search
from agents.tuned import MPC, MPCSettings
from ccr_gym.observation import AHEAD, FORCE_SCALE_N

SMALLEST_MM = 0.005  # moves below are not worth taking up the play for


@dataclass(slots=True)
class PredictiveController:
    """Plans the moves of the cable that bring a force which is linear in them along the set-points ahead.

    The plan is a quadratic programme, solved by CasADi at every step, whose first move is made. What it needs is
    estimated from what is seen: the force as the virtual-work estimate, which has no noise, times the ratio at which
    the sensor, whose zero is known from before contact, has read it so far; the slope of the force from the moves
    and changes so far; the present force from the moves that are not seen yet, with a latency and a play of the motors
    that are assumed. In space both cables move along the way of the search; an insertion is left as it is.

    Attributes:
        settings: What is assumed, and the weights of the plan.
    """

    settings: MPCSettings = field(default_factory=MPCSettings)
    name: str = "MPC"
    _limit_mm: float = field(default=14.0, init=False)
    _increment_mm: float = field(default=0.5, init=False)
    _readings: list[np.ndarray] = field(default_factory=list, init=False)
    _places: list[float] = field(default_factory=list, init=False)
    _last: float | None = field(default=None, init=False)
    _ratio: np.ndarray = field(default_factory=lambda: np.zeros(2), init=False)
    _slope: np.ndarray = field(default_factory=lambda: np.zeros(2), init=False)

    @classmethod
    def tuned(cls, env_id: str) -> "PredictiveController":
        """With the settings of least force error on training scenes with realistic sensing."""
        return cls(MPC.get(env_id, MPCSettings()))

    def reset(self, env: Any = None) -> None:
        """Forget the episode; the range and the increments of the motors are those of the environment."""
        if env is not None:
            settings = env.get_wrapper_attr("settings")
            self._limit_mm, self._increment_mm = settings.cable_limit_mm, settings.max_increment_mm
        self._readings.clear()
        self._places.clear()
        self._last = None
        self._ratio = np.zeros(2)
        self._slope = np.array([self.settings.slope, 1.0]) * self.settings.trust

    def act(self, observation: Observation) -> np.ndarray:
        """Pull until something touches, then plan."""
        way, play = search(observation), self.settings.play_mm / 2
        motor = float(observation["cable"] @ way[: observation["cable"].size]) * self._limit_mm / float(way @ way)
        before = self._places[-1] if self._places else motor
        place = min(max(before, motor - play), motor + play)
        self._places.append(place)
        if not observation["contact"].any():
            self._readings.append(observation["force_measured"].astype(float))
            return way
        late = self.settings.latency
        unseen = np.array([self._places[max(-1 - k, -len(self._places))] for k in (0, late, late + 1)])
        force = self._force(observation)
        if self._last is not None:
            moved = unseen[1] - unseen[2]
            self._slope *= self.settings.forgetting
            self._slope += [moved * (force - self._last), moved * moved]
            self._slope += (1 - self.settings.forgetting) * self.settings.trust * np.array([self.settings.slope, 1.0])
        self._last = force
        slope = max(self._slope[0] / self._slope[1], self.settings.least_slope)
        present = force + slope * (unseen[0] - unseen[1])
        move = self._increment_mm * self._plan(slope * self._increment_mm, present, self._goals(observation))
        if abs(move) < SMALLEST_MM:
            return 0.0 * way
        effort = (place + move + np.copysign(play, move) - motor) / self._increment_mm
        return np.asarray(min(max(effort, -1.0), 1.0) * way, np.float32)

    def _force(self, observation: Observation) -> float:
        """Magnitude of the force when it was seen [N]."""
        zero = np.mean(self._readings, axis=0) if self._readings else 0.0
        measured, estimate = (
            np.linalg.norm(observation["force_measured"] - zero),
            np.linalg.norm(observation["force_est"]),
        )
        self._ratio = self.settings.forgetting_ratio * self._ratio + [measured * estimate, estimate * estimate]
        share = self._ratio[0] / self._ratio[1] if self._ratio[1] > 0 else 0.0
        return float(share * estimate) * FORCE_SCALE_N

    def _goals(self, observation: Observation) -> np.ndarray:
        """Set-points after each of the next steps [N]."""
        now = float(np.linalg.norm(observation["desired_force"]))
        ahead = observation.get("desired_ahead", np.full(len(AHEAD), now))
        steps = np.arange(1, self.settings.horizon + 1)
        return np.asarray(FORCE_SCALE_N * np.interp(steps, (0, *AHEAD), (now, *ahead)))

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
