"""The contract of everything that acts, and the classical controller."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from ccr_gym.observation import FORCE_SCALE_N

Observation = dict[str, np.ndarray]


class Policy(Protocol):
    """Acts on dictionary observations (`obs_mode="dict"`)."""

    name: str

    def reset(self) -> None:
        """Forget the episode."""

    def act(self, observation: Observation) -> np.ndarray:
        """The action for an observation, ``(1,)`` in [−1, 1]."""


@dataclass(slots=True)
class ForceController:
    """Proportional-integral control of the contact force, after a search for contact at full speed.

    Attributes:
        proportional: Action per newton of force error.
        integral: Action per newton of force error and step.
    """

    proportional: float = 14.0
    integral: float = 1.0
    name: str = "PI"
    _sum: float = field(default=0.0, init=False)

    def reset(self) -> None:
        """Empty the integrator."""
        self._sum = 0.0

    def act(self, observation: Observation) -> np.ndarray:
        """Pull until something touches, then control the force; the integrator rests while the action saturates."""
        if not observation["contact"].any():
            self._sum = 0.0
            return np.ones(1, np.float32)
        error = float(observation["force_error"][0]) * FORCE_SCALE_N
        wanted = self.proportional * error + self.integral * (self._sum + error)
        if abs(wanted) < 1:
            self._sum += error
        return np.array([min(max(wanted, -1.0), 1.0)], np.float32)
