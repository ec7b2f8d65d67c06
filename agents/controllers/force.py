"""Proportional and proportional-integral control of the contact force."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from agents.policy import Observation, Tare, search
from agents.tuned import P_GAINS, PI_GAINS
from ccr_gym import FORCE_SCALE_N


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
    _tare: Tare = field(default_factory=Tare, init=False)

    @classmethod
    def tuned(cls, env_id: str) -> "ForceController":
        """With the gains of least force error on training scenes with realistic sensing."""
        return cls(*PI_GAINS[env_id])

    @classmethod
    def proportional_only(cls, env_id: str) -> "ForceController":
        """The same with increments in proportion to the force error, and to nothing else."""
        return cls(0.0, P_GAINS[env_id], "P")

    def reset(self, env: Any = None) -> None:
        """Forget the last error, and what the sensor read."""
        self._last = None
        self._tare.forget()

    def act(self, observation: Observation) -> np.ndarray:
        """Pull until something touches, then control the force."""
        force = self._tare.force(observation)
        if force is None:
            self._last = None
            return search(observation)
        error = FORCE_SCALE_N * float(np.linalg.norm(observation["desired_force"])) - float(np.linalg.norm(force))
        change = 0.0 if self._last is None else error - self._last
        self._last = error
        effort = min(max(self.proportional * change + self.integral * error, -1.0), 1.0)
        return np.asarray(effort * search(observation), np.float32)
