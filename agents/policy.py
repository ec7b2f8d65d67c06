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

    The cable increment is the change of the controller's output (velocity form), so saturation winds nothing up.

    Attributes:
        proportional: Action per newton of change of the force error.
        integral: Action per newton of force error.
    """

    proportional: float = 5.0
    integral: float = 20.0
    name: str = "PI"
    _last: float | None = field(default=None, init=False)

    def reset(self) -> None:
        """Forget the last error."""
        self._last = None

    def act(self, observation: Observation) -> np.ndarray:
        """Pull until something touches, then control the force."""
        if not observation["contact"].any():
            self._last = None
            return np.ones(1, np.float32)
        error = float(observation["force_error"][0]) * FORCE_SCALE_N
        change = 0.0 if self._last is None else error - self._last
        self._last = error
        return np.clip([self.proportional * change + self.integral * error], -1.0, 1.0).astype(np.float32)
