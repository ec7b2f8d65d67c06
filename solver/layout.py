"""Where the numbers of an equilibrium stand in its block, one block ``(size,)`` or many ``(N, size)``."""

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from solver._kernel import MAX_ACTIVE
from solver.robot import Robot

CABLE, LENGTH, TENSION, OBJECTIVE = range(4)
View = Callable[[np.ndarray], np.ndarray]


class Layout:
    """Views of a block, or of the rows of an array of blocks; every attribute is a function of it.

    Args:
        segments: Segments of the robot.
        lines: Lines of points that can touch.
        positions: Points of a line.
        obstacles: Obstacles of the scene.
    """

    def __init__(self, segments: int, lines: int, positions: int, obstacles: int) -> None:
        n, contacts = segments, (obstacles, lines, positions)
        self.obstacles = obstacles
        self.size = 4
        self.coordinates = self._view(n)
        self.nodes = self._view(n + 1, 3)
        self.cable_nodes = self._view(n + 1, 2)
        self.multipliers = self._view(*contacts)
        self.gaps = self._view(*contacts)
        self.displacements = self._view(obstacles, 2)
        self.forces = self._view(obstacles, 2)
        self.force = self._view(2)
        self.clearance_at = self.size
        self.clearance = self._view(1)
        self.onset_at = self.size
        self.onset = self._view(1)
        self.tip_slopes = self._view(3)
        self.flags = self._view(lines * positions)
        self.trend = self._view(n + 2 * obstacles + MAX_ACTIVE)

    def _view(self, *shape: int) -> View:
        start = self.size
        self.size = end = start + int(np.prod(shape))
        if len(shape) == 1:
            return lambda block: block[..., start:end]
        return lambda block: block[..., start:end].reshape(*block.shape[:-1], *shape)


@lru_cache(maxsize=128)
def _layout(segments: int, lines: int, positions: int, obstacles: int) -> Layout:
    return Layout(segments, lines, positions, obstacles)


def layout(robot: Robot, obstacles: int) -> Layout:
    """The layout for a robot among a number of obstacles."""
    return _layout(robot.segments, len(robot.touch), robot.positions, obstacles)
