"""Zeroing of the force sensor."""

import numpy as np

from agents.policy import Observation
from ccr_gym import FORCE_SPAN


class Tare:
    """Subtracts the zero of the force sensor: the mean of its readings before contact."""

    def __init__(self) -> None:
        self._readings: list[np.ndarray] = []

    def reset(self) -> None:
        """Start a new episode."""
        self._readings.clear()

    def force(self, observation: Observation) -> np.ndarray | None:
        """Return the measured force without the zero, ``(d,)`` [EI/L²], or ``None`` while nothing is seen to touch."""
        measured = FORCE_SPAN * observation["force_measured"].astype(float)
        if not observation["contact"].any():
            self._readings.append(measured)
            return None
        return measured - np.mean(self._readings, axis=0) if self._readings else measured
