"""The contract of everything that acts, and the classical controllers."""

import math
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from ccr_gym.observation import FORCE_SCALE_N
from solver import Equilibrium
from solver.sensitivity import CABLE, sensitivity
from solver.spatial.sensitivity import CABLES, spatial_sensitivity

Observation = dict[str, np.ndarray]


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
    if "obstacle" not in observation:
        return np.ones(1, np.float32)
    azimuth = math.atan2(observation["obstacle"][1], observation["obstacle"][0])
    pull = np.array([math.cos(azimuth), math.cos(azimuth - angle)])
    return np.asarray(pull / np.abs(pull).max(), np.float32)


@dataclass(slots=True)
class ForceController:
    """Proportional-integral control of the contact force's magnitude, after a search for contact at full speed.

    The cable increment is the change of the controller's output (velocity form), so saturation winds nothing up. In
    space both cables move along the way of the search.

    Attributes:
        proportional: Action per newton of change of the force error.
        integral: Action per newton of force error.
    """

    proportional: float = 5.0
    integral: float = 20.0
    name: str = "PI"
    _last: float | None = field(default=None, init=False)

    def reset(self, env: Any = None) -> None:
        """Forget the last error."""
        self._last = None

    def act(self, observation: Observation) -> np.ndarray:
        """Pull until something touches, then control the force."""
        if not observation["contact"].any():
            self._last = None
            return search(observation)
        error = _lacking(observation)
        change = 0.0 if self._last is None else error - self._last
        self._last = error
        effort = min(max(self.proportional * change + self.integral * error, -1.0), 1.0)
        return np.asarray(effort * search(observation), np.float32)


@dataclass(slots=True)
class NewtonController:
    """Newton steps on the exact slopes of the contact force in the cables, at the equilibrium itself.

    It knows the model, the scene and the state of the robot, which no policy sees. In space the smallest increment of
    both cables is taken that meets the set-point, or comes closest to one that is a vector.

    Attributes:
        damping: Slope of the force below which it is not trusted [N/mm].
    """

    damping: float = 1e-3
    name: str = "Newton"
    _env: Any = field(default=None, init=False)

    def reset(self, env: Any = None) -> None:
        """Take the environment whose equilibrium is known."""
        self._env = env

    def act(self, observation: Observation) -> np.ndarray:
        """Pull until something touches, then step to where the force is that of the set-point."""
        equilibrium = self._env.get_wrapper_attr("equilibrium")
        if not equilibrium.contact.any():
            return search(observation)
        if isinstance(equilibrium, Equilibrium):
            slopes = sensitivity(equilibrium).forces[CABLE : CABLE + 1].sum(axis=1)
        else:
            slopes = spatial_sensitivity(equilibrium).forces[CABLES].sum(axis=1)
        force = equilibrium.forces.sum(axis=0)
        goal = FORCE_SCALE_N * observation["desired_force"].astype(float)
        if goal.size == 1:  # along the force as it is
            direction = force / np.linalg.norm(force)
            slopes, lacking = slopes @ direction[:, None], goal - np.linalg.norm(force)
        else:
            lacking = goal - force
        damped = slopes @ slopes.T + self.damping**2 * np.eye(len(slopes))
        increment = np.linalg.solve(damped, slopes @ lacking) / self._env.get_wrapper_attr("settings").max_increment_mm
        return np.asarray(increment / max(1.0, np.abs(increment).max()), np.float32)


def _lacking(observation: Observation) -> float:
    """How much the force is smaller than its set-point [N]."""
    if observation["desired_force"].size == 1:
        return float(observation["force_error"][0]) * FORCE_SCALE_N
    wanted, measured = (np.linalg.norm(observation[key]) for key in ("desired_force", "force_measured"))
    return float(wanted - measured) * FORCE_SCALE_N
