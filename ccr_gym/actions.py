"""The actuated coordinates: what the actions of an environment move."""

from typing import NamedTuple

import numpy as np


class ActionSpec(NamedTuple):
    """Bounds and increments of the actuated coordinates: the cable displacements, then the length if it is actuated.

    Attributes:
        cables: Number of cable displacements.
        low_mm: Lower bounds, ``(actions,)`` [mm].
        high_mm: Upper bounds, ``(actions,)`` [mm].
        increment_mm: Moves of full actions, ``(actions,)`` [mm].
    """

    cables: int
    low_mm: np.ndarray
    high_mm: np.ndarray
    increment_mm: np.ndarray

    @property
    def size(self) -> int:
        """Number of actions."""
        return len(self.increment_mm)
