"""The shapes accepted on the way of a step."""

import math
from typing import NamedTuple

import numpy as np

from solver import _kernel
from solver.common.robot import AnyRobot
from solver.common.scene import Scene


class Trace(NamedTuple):
    """The shapes accepted on the way of a step, from the one it started at on.

    Attributes:
        nodes: In the plane backbone point and disk angle of each node, ``(k, n+1, 3)`` [mm, mm, rad], in space the
            point, ``(k, n+1, 3)`` [mm].
        points: The points that can touch, by line and position, ``(k, p, j, d)`` [mm].
        displacements: How far each obstacle has been pushed from its place, ``(k, m, d)`` [mm].
        reason: Why the step was given up, empty where it was not: ``"folded"`` where a snap leads to where a segment
            folds over, ``"work"`` where its budget of work was spent, ``"stuck"`` where the descent found no way on.
    """

    nodes: np.ndarray
    points: np.ndarray
    displacements: np.ndarray
    reason: str


def read_trace(traced: tuple[list[float], _kernel.Reason], robot: AnyRobot, scene: Scene, space: int) -> Trace:
    """The shapes that the kernel has written one after the other."""
    parts = ((robot.segments + 1, 3), (len(robot.lines_mm), robot.positions, space), (len(scene), space))
    ends = np.cumsum([math.prod(part) for part in parts])
    numbers, reason = traced
    rows = np.reshape(numbers, (-1, int(ends[-1])))
    columns = np.split(rows, ends[:-1], axis=1)
    nodes, points, moved = (column.reshape(-1, *part) for column, part in zip(columns, parts, strict=True))
    return Trace(nodes, points, moved, "" if reason is _kernel.Reason.NONE else reason.name.lower())
