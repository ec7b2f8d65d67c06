"""Points of a robot that can touch obstacles, and their gaps."""

import math
from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np

from solver.common.obstacle import Obstacle
from solver.common.robot import AnyRobot
from solver.common.rod import AnyRod, full_cables
from solver.common.scene import Scene

ROUNDING = 1 + 1e-9  # of a gap, over the size of the obstacle


class StraightRobot(NamedTuple):
    """The points of a straight robot that can touch obstacles.

    Attributes:
        robot: The robot.
        points: The points, ``(p, k, d)`` [mm].
        low: Least coordinates of the points, ``(d,)`` [mm].
        high: Largest coordinates of the points, ``(d,)`` [mm].
    """

    robot: AnyRobot
    points: np.ndarray
    low: list[float]
    high: list[float]

    @classmethod
    def of(cls, robot: AnyRobot, points: np.ndarray) -> Self:
        """Return the straight robot with these points ``(p, k, d)`` [mm]."""
        return cls(robot, np.ascontiguousarray(points), points.min((0, 1)).tolist(), points.max((0, 1)).tolist())

    def gaps(self, scene: Scene) -> np.ndarray:
        """Return the gaps of its points as :func:`touching_gaps`."""
        return touching_gaps(self.robot, scene, self.points)

    def is_clear_of(self, scene: Scene) -> bool:
        """Return whether no obstacle of a scene overlaps it.

        Raises:
            ValueError: As :func:`touching_gaps`.
        """
        return all(map(self._is_far_from, scene)) or bool((self.gaps(scene) >= 0).all())

    def _is_far_from(self, obstacle: Obstacle) -> bool:
        """Return whether the disc or ball around an obstacle is beside the box around the points, which most are."""
        if obstacle.nodes is not None or obstacle.space != len(self.low):
            return False
        center, radius, *_ = obstacle.extent
        beside = [max(low - x, x - high, 0.0) for x, low, high in zip(center, self.low, self.high, strict=True)]
        return math.hypot(*beside) > ROUNDING * radius


def subdivide(lines: np.ndarray, between: int) -> np.ndarray:
    """Return lines ``(..., n+1, d)`` with ``between`` evenly spaced points added between every two."""
    if between == 0:
        return lines
    segments = lines.shape[-2] - 1
    position = np.arange(segments * (between + 1) + 1) / (between + 1)
    node = np.minimum(position.astype(int), segments - 1)
    fraction = (position - node)[:, None]
    return np.asarray((1 - fraction) * lines[..., node, :] + fraction * lines[..., node + 1, :])


def touchable_points(robot: AnyRobot, scene: Scene) -> np.ndarray:
    """Return which points of a robot can touch which obstacle, ``(m, lines, positions)`` bool.

    These are all points, or those of the nodes that the obstacle names.

    Raises:
        ValueError: If an obstacle names a node that the robot does not have.
    """
    every = _all_points(len(scene), len(robot.lines_mm), robot.positions)
    if all(obstacle.nodes is None for obstacle in scene):
        return every
    touchable = every.copy()
    for points, obstacle in zip(touchable, scene, strict=True):
        if obstacle.nodes is not None:
            points[:] = False
            points[:, :: robot.between + 1] = obstacle.touchable(robot.segments + 1)
    return touchable


@lru_cache(maxsize=64)
def _all_points(obstacles: int, lines: int, positions: int) -> np.ndarray:
    """Return that all points can touch, ``(m, lines, positions)`` bool, an array that is shared and not written to."""
    touchable = np.ones((obstacles, lines, positions), bool)
    touchable.flags.writeable = False
    return touchable


def touching_gaps(robot: AnyRobot, scene: Scene, points: np.ndarray) -> np.ndarray:
    """Return the gaps of points ``(p, k, d)`` of a robot, infinite where they cannot touch, ``(m, p, k)`` [mm].

    Raises:
        ValueError: If an obstacle names a node that the robot does not have.
    """
    gaps = np.array([obstacle.measure(points)[..., 0] for obstacle in scene]).reshape(len(scene), *points.shape[:2])
    if all(obstacle.nodes is None for obstacle in scene):
        return gaps
    return np.where(touchable_points(robot, scene), gaps, np.inf)


def slacks_mm(robot: AnyRod, length_mm: float, cables_mm: np.ndarray, holes: np.ndarray) -> np.ndarray:
    """Return the excess length of each cable over its path through the disks, ``(c,)`` [mm].

    Args:
        robot: The robot.
        length_mm: Length of its backbone [mm].
        cables_mm: Displacements of the cables, ``(c,)`` [mm].
        holes: Points of each cable on each disk, ``(c, n+1, d)`` [mm].
    """
    ends = np.array([cable.end for cable in full_cables(robot)])
    paths = np.cumsum(np.linalg.norm(np.diff(holes, axis=1), axis=2), axis=1)
    return np.asarray(length_mm * ends / robot.segments - cables_mm - paths[np.arange(len(ends)), ends - 1])
