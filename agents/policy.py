"""The contract of everything that acts, and the classical controllers."""

import math
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from ccr_gym.fleet import Truth
from ccr_gym.observation import FORCE_SCALE_N
from solver import Equilibrium
from solver.sensitivity import CABLE, LENGTH, sensitivity
from solver.spatial.sensitivity import CABLES, spatial_sensitivity

Observation = dict[str, np.ndarray]
PI_GAINS = {  # proportional and integral, found by `python benchmarks/headroom.py`
    "CCR/LoadCell-v0": (6.0, 16.0),
    "CCR/PushObstacle-v0": (1.0, 16.0),
    "CCR/TrackForce-v0": (10.0, 16.0),
    "CCR/BracedPush-v0": (6.0, 16.0),
    "CCR/SoftObstacle-v0": (10.0, 16.0),
    "CCR/InsertAndPush-v0": (6.0, 4.0),
    "CCR/SpatialPush-v0": (10.0, 16.0),
}


class Policy(Protocol):
    """Acts on dictionary observations (`obs_mode="dict"`)."""

    name: str

    def reset(self, env: Any = None) -> None:
        """Forget the episode; a controller that knows more than it sees is given the environment of the next one."""

    def act(self, observation: Observation) -> np.ndarray:
        """The action for an observation, ``(1,)``, in space ``(2,)``, in [−1, 1]."""


def search(observation: Observation, angle: float = math.pi / 2) -> np.ndarray:
    """The full action that bends the robot towards the obstacle: in the plane there is one way only.

    Args:
        observation: What is seen.
        angle: From the first cable to the second [rad].
    """
    if "length" in observation:
        return np.array([1.0, 0.0], np.float32)
    if "obstacle" not in observation:
        return np.ones(1, np.float32)
    azimuth = math.atan2(observation["obstacle"][1], observation["obstacle"][0])
    pull = np.array([math.cos(azimuth), math.cos(azimuth - angle)])
    return np.asarray(pull / np.abs(pull).max(), np.float32)


@dataclass(slots=True)
class ForceController:
    """Proportional-integral control of the contact force's magnitude, after a search for contact at full speed.

    What the sensor reads while nothing touches is taken off from then on. The cable increment is the change of the
    controller's output (velocity form), so saturation winds nothing up. In space both cables move along the way of the
    search; an insertion is left as it is.

    Attributes:
        proportional: Action per newton of change of the force error.
        integral: Action per newton of force error.
    """

    proportional: float = 5.0
    integral: float = 20.0
    name: str = "PI"
    _last: float | None = field(default=None, init=False)
    _readings: list[np.ndarray] = field(default_factory=list, init=False)

    @classmethod
    def tuned(cls, env_id: str) -> "ForceController":
        """With the gains of least force error on training scenes with realistic sensing."""
        return cls(*PI_GAINS.get(env_id, PI_GAINS["CCR/PushObstacle-v0"]))

    def reset(self, env: Any = None) -> None:
        """Forget the last error, and what the sensor read."""
        self._last = None
        self._readings.clear()

    def act(self, observation: Observation) -> np.ndarray:
        """Pull until something touches, then control the force."""
        if not observation["contact"].any():
            self._last = None
            self._readings.append(observation["force_measured"])
            return search(observation)
        error = self._lacking(observation)
        change = 0.0 if self._last is None else error - self._last
        self._last = error
        effort = min(max(self.proportional * change + self.integral * error, -1.0), 1.0)
        return np.asarray(effort * search(observation), np.float32)

    def _lacking(self, observation: Observation) -> float:
        """How much the force is smaller than its set-point [N]."""
        tare = np.mean(self._readings, axis=0) if self._readings else 0.0
        measured = np.linalg.norm(observation["force_measured"].astype(float) - tare)
        return float(np.linalg.norm(observation["desired_force"]) - measured) * FORCE_SCALE_N


@dataclass(slots=True)
class NewtonController:
    """Newton steps on the exact slopes of the contact force in what the actions move, at the equilibrium itself.

    It knows the model, the scene, the state of the robot, its rigidity, the play of its motors and the next set-point,
    which no policy sees: a bound for those that do not. Where there are two actions the smallest increments are taken
    that meet the set-point, or come closest to one that is a vector.

    Attributes:
        damping: Slope of the force below which it is not trusted [N/mm].
    """

    damping: float = 1e-4
    name: str = "Newton"
    _env: Any = field(default=None, init=False)

    def reset(self, env: Any = None) -> None:
        """Take the environment whose equilibrium is known."""
        self._env = env

    def act(self, observation: Observation) -> np.ndarray:
        """Pull until something touches, then step to where the force is that of the set-point."""
        truth: Truth = self._env.get_wrapper_attr("truth")
        task, settings = self._env.get_wrapper_attr("task"), self._env.get_wrapper_attr("settings")
        if not truth.force.any():
            return search(observation)
        slopes = truth.stiffness * self._slopes(task.target, "length" in observation)
        if np.ndim(truth.goal) == 0:  # along the force as it is
            size = float(np.linalg.norm(truth.force))
            slopes, lacking = slopes @ (truth.force / size)[:, None], np.array([truth.goal - size])
        else:
            lacking = truth.goal - truth.force
        (low, high), free = task.body.bounds(settings), np.ones(len(slopes), bool)
        for _ in free:  # a motor at its bound leaves the rest to the other
            damped = slopes @ slopes.T + (truth.stiffness * self.damping) ** 2 * np.eye(len(slopes))
            increments = np.linalg.solve(damped, slopes @ lacking)
            free &= np.where(increments > 0, truth.motors < high, truth.motors > low)
            slopes = slopes * free[:, None]
        play = np.where(increments == 0, 0.0, truth.places + np.copysign(truth.slack, increments) - truth.motors)
        effort = (increments + play) / task.body.increments(settings)
        return np.asarray(effort / max(1.0, np.abs(effort).max()), np.float32)

    def _slopes(self, target: int | None, insertion: bool) -> np.ndarray:
        """Slopes of the force that counts in what the actions move, ``(actions, d)`` [N/mm]."""
        equilibrium = self._env.get_wrapper_attr("equilibrium")
        counted = slice(None) if target is None else slice(target, target + 1)
        if isinstance(equilibrium, Equilibrium):
            slopes = sensitivity(equilibrium).forces[[CABLE, LENGTH] if insertion else [CABLE]]
        else:
            slopes = spatial_sensitivity(equilibrium).forces[CABLES]
        return np.asarray(slopes[:, counted].sum(axis=1))
