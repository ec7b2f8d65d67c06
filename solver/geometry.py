"""Points of a robot that can touch obstacles."""

import numpy as np

from solver.robot import AnyRobot, Robot
from solver.scene import Scene


def touching_points(robot: Robot, nodes: np.ndarray) -> np.ndarray:
    """The points of ``robot.touch``, ``(lines, positions, 2)`` [mm], of node poses ``(n+1, 3)``.

    Those between two nodes divide the straight line between their points evenly.
    """
    disks = np.column_stack([np.cos(nodes[:, 2]), np.sin(nodes[:, 2])])
    return divided(nodes[:, :2] + np.array(robot.lines_mm)[:, None, None] * disks, robot.between)


def divided(lines: np.ndarray, between: int) -> np.ndarray:
    """Lines ``(p, n+1, d)`` with as many points between every two, which divide the straight line evenly."""
    segments = lines.shape[1] - 1
    place = np.arange(segments * (between + 1) + 1) / (between + 1)
    node = np.minimum(place.astype(int), segments - 1)
    fraction = (place - node)[:, None]
    return np.asarray((1 - fraction) * lines[:, node] + fraction * lines[:, node + 1])


def touchable_points(robot: AnyRobot, scene: Scene) -> np.ndarray:
    """Which of these points can touch each obstacle, ``(m, lines, positions)`` bool: all, or those of its nodes.

    Raises:
        ValueError: If an obstacle names a node that the robot does not have.
    """
    touchable = np.ones((len(scene), len(robot.lines_mm), robot.positions), bool)
    for points, obstacle in zip(touchable, scene, strict=True):
        if obstacle.nodes is not None:
            points[:] = False
            points[:, :: robot.between + 1] = obstacle.touchable(robot.segments + 1)
    return touchable


def touching_gaps(robot: AnyRobot, scene: Scene, points: np.ndarray) -> np.ndarray:
    """Gaps of the points of a robot ``(p, k, d)``, infinite where they cannot touch, ``(m, p, k)`` [mm].

    Raises:
        ValueError: If an obstacle names a node that the robot does not have.
    """
    gaps = np.array([obstacle.measure(points)[..., 0] for obstacle in scene]).reshape(len(scene), *points.shape[:2])
    if all(obstacle.nodes is None for obstacle in scene):
        return gaps
    return np.where(touchable_points(robot, scene), gaps, np.inf)
