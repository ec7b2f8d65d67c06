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
    """

    kind: _kernel.Model
    space: int


PLANE = {"paper": Model(_kernel.Model.PLANAR_PAPER, space=2), "rod": Model(_kernel.Model.PLANAR_ROD, space=2)}
SPACE = {"paper": Model(_kernel.Model.SPATIAL_PAPER, space=3), "rod": Model(_kernel.Model.SPATIAL_ROD, space=3)}


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
        cables: Its cables, in the paper's model of space pairs of them.
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

    def __init__(self, model: Model, segments: int, cables: int, lines: int, positions: int, obstacles: int) -> None:
        self.obstacles = obstacles
        self.size = 0
        for field in _kernel.block_layout(model.kind, segments, cables, lines, positions, obstacles):
            setattr(self, field.name, Field(field))
            self.size = field.offset + field.size


@lru_cache(maxsize=128)
def make_layout(model: Model, segments: int, cables: int, lines: int, positions: int, obstacles: int) -> Layout:
    """Return the layout for robots and scenes of these sizes."""
    return Layout(model, segments, cables, lines, positions, obstacles)
