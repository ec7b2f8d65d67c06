"""Memory layout of an equilibrium block, one block ``(size,)`` or many ``(N, size)``."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from solver import _kernel


class Model(NamedTuple):
    """How many numbers describe a robot.

    Attributes:
        kind: What the kernel computes of a segment.
        space: Dimensions of a point.
        cables: Cables, in space pairs of them.
    """

    kind: _kernel.Model
    space: int
    cables: int


PLANE = Model(_kernel.Model.PAPER, space=2, cables=1)
ROD = PLANE._replace(kind=_kernel.Model.ROD)
SPACE = Model(_kernel.Model.SPATIAL, space=3, cables=2)


class Field:
    """A field of the block. Calling it returns its view of a block, or of the rows of an array of blocks.

    Attributes:
        at: Index of its first number.
        shape: Shape of the view of one block.
    """

    __slots__ = ("_stop", "at", "shape")

    def __init__(self, field: _kernel.BlockField) -> None:
        self.at, self._stop = field.offset, field.offset + field.size
        self.shape: tuple[int, ...] = field.shape

    def __call__(self, block: np.ndarray) -> np.ndarray:
        """Return the view, ``(..., *shape)``."""
        view = block[..., self.at : self._stop]
        return view if len(self.shape) == 1 else view.reshape(*block.shape[:-1], *self.shape)


class Layout:
    """The fields of a block, in the order that the kernel states (``solver/native/solve/block_layout.hpp``).

    Args:
        model: The model of the robot.
        segments: Segments of the robot.
        lines: Lines of points that can touch.
        positions: Points of a line.
        obstacles: Obstacles of the scene.

    Attributes:
        size: Numbers in a block.
    """

    cables: Field
    length: Field
    tensions: Field
    objective: Field
    coordinates: Field
    nodes: Field
    frames: Field
    multipliers: Field
    gaps: Field
    displacements: Field
    forces: Field
    force: Field
    clearance: Field
    onset: Field
    tip_slopes: Field
    flags: Field
    disk_multipliers: Field
    trend_coordinates: Field
    trend_displacements: Field
    trend_multipliers: Field

    def __init__(self, model: Model, segments: int, lines: int, positions: int, obstacles: int) -> None:
        self.obstacles = obstacles
        self.size = 0
        for field in _kernel.block_layout(model.kind, segments, lines, positions, obstacles):
            setattr(self, field.name, Field(field))
            self.size = field.offset + field.size


@lru_cache(maxsize=128)
def make_layout(model: Model, segments: int, lines: int, positions: int, obstacles: int) -> Layout:
    """Return the layout for robots and scenes of these sizes."""
    return Layout(model, segments, lines, positions, obstacles)
