"""Shapes accepted on the way of a step."""

import math
from typing import NamedTuple

import numpy as np

from solver import _kernel
from solver.common.robot import AnyRobot
from solver.common.scene import Scene


class Trace(NamedTuple):
    """Shapes accepted on the way of a step, beginning with the one it started from.

    Attributes:
        nodes: In the plane backbone point and disk angle of each node, ``(k, n+1, 3)`` [mm, mm, rad], in space the
            point, ``(k, n+1, 3)`` [mm].
        points: The points that can touch, by line and position, ``(k, p, j, d)`` [mm].
        displacements: How far each obstacle on a spring was pushed, ``(k, m, d)`` [mm].
        reason: Why the step gave up, empty where it did not: ``"folded"`` where a snap would fold a segment over,
            ``"work"`` where its budget of work ran out, ``"stuck"`` where the descent made no progress.
    """

    nodes: np.ndarray
    points: np.ndarray
    displacements: np.ndarray
    reason: str


def read_trace(traced: tuple[np.ndarray, _kernel.Reason], robot: AnyRobot, scene: Scene, space: int) -> Trace:
    """Return the shapes that the kernel wrote one after the other, with the reason."""
    parts = ((robot.segments + 1, 3), (len(robot.lines_mm), robot.positions, space), (len(scene), space))
    ends = np.cumsum([math.prod(part) for part in parts])
    numbers, reason = traced
    rows = np.reshape(numbers, (-1, int(ends[-1])))
    columns = np.split(rows, ends[:-1], axis=1)
    nodes, points, moved = (column.reshape(len(rows), *part) for column, part in zip(columns, parts, strict=True))
    return Trace(nodes, points, moved, "" if reason is _kernel.Reason.NONE else reason.name.lower())
