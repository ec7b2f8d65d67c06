"""Where the numbers of an equilibrium stand in its block, one block ``(size,)`` or many ``(N, size)``."""

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from solver._kernel import MAX_ACTIVE

CABLE, LENGTH, TENSION, OBJECTIVE = range(4)
View = Callable[[np.ndarray], np.ndarray]


class Model(NamedTuple):
    """How many numbers describe a robot.

    Attributes:
        space: Of a place.
        controls: Of the shape of a segment.
        cables: Cables.
        frame: Of the directions on a disk, an array of this shape.
        tip: Slopes of the free tip, an array of this shape.
        disks: Whether the disks of a segment can meet.
    """

    space: int
    controls: int
    cables: int
    frame: tuple[int, ...]
    tip: tuple[int, ...]
    disks: bool = False


PLANE = Model(space=2, controls=1, cables=1, frame=(2,), tip=(3,))
SLIDING = PLANE._replace(disks=True)
SPACE = Model(space=3, controls=3, cables=2, frame=(3, 3), tip=(2, 5))


class Layout:
    """Views of a block, or of the rows of an array of blocks; every attribute is a function of it.

    Args:
        model: The model of the robot.
        segments: Segments of the robot.
        lines: Lines of points that can touch.
        positions: Points of a line.
        obstacles: Obstacles of the scene.
    """

    def __init__(self, model: Model, segments: int, lines: int, positions: int, obstacles: int) -> None:
        n, space, contacts = segments, model.space, (obstacles, lines, positions)
        self.obstacles = obstacles
        self.size = 0
        self.cables = self._view(model.cables)
        self.length_at = self.size
        self.length = self._view(1)
        self.tensions = self._view(model.cables)
        self.objective_at = self.size
        self.objective = self._view(1)
        self.coordinates = self._view(n) if model.controls == 1 else self._view(n, model.controls)
        self.nodes = self._view(n + 1, 3)
        self.frames = self._view(n + 1, *model.frame)
        self.multipliers = self._view(*contacts)
        self.gaps = self._view(*contacts)
        self.displacements = self._view(obstacles, space)
        self.forces = self._view(obstacles, space)
        self.force = self._view(space)
        self.clearance_at = self.size
        self.clearance = self._view(1)
        self.onset = self._view(model.cables)
        self.tip_slopes = self._view(*model.tip)
        self.flags = self._view(lines * positions)
        self.disk_multipliers = self._view(n if model.disks else 0)
        self.trend = self._view(n * model.controls + space * obstacles + MAX_ACTIVE if model.cables == 1 else 0)

    def _view(self, *shape: int) -> View:
        start = self.size
        self.size = end = start + int(np.prod(shape))
        if len(shape) == 1:
            return lambda block: block[..., start:end]
        return lambda block: block[..., start:end].reshape(*block.shape[:-1], *shape)


@lru_cache(maxsize=128)
def make_layout(model: Model, segments: int, lines: int, positions: int, obstacles: int) -> Layout:
    """The layout for robots and scenes of these sizes."""
    return Layout(model, segments, lines, positions, obstacles)
