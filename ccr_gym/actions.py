"""The actuated coordinates: what the actions of an environment move."""

from typing import NamedTuple

import numpy as np


class ActionSpec(NamedTuple):
    """Bounds and increments of the actuated coordinates.

    They are a signed cable displacement for each section, in space one along x and one along y, and the length where
    the base inserts the robot.

    Attributes:
        commands: Number of cable displacements, as :class:`solver.Actuation` maps them to cables.
        low_mm: Lower bounds, ``(actions,)`` [mm].
        high_mm: Upper bounds, ``(actions,)`` [mm].
        increment_mm: Moves of full actions, ``(actions,)`` [mm].
    """

    commands: int
    low_mm: np.ndarray
    high_mm: np.ndarray
    increment_mm: np.ndarray

    @property
    def size(self) -> int:
        """Number of actions."""
        return len(self.increment_mm)
