"""Obstacles as the kernel takes them."""

import numpy as np

from solver._kernel import SHAPE_SIZE
from solver.cache.compile import function_address
from solver.common.gap_laws import gap_function
from solver.common.geometry import touchable_points
from solver.common.obstacle import SHAPES
from solver.common.robot import AnyRobot
from solver.common.scene import Scene

SceneArrays = tuple[list[int], np.ndarray, np.ndarray, np.ndarray, np.ndarray, list[int], list[np.ndarray]]


def scene_arrays(robot: AnyRobot, scene: Scene) -> SceneArrays:
    """What the kernel wants to know of obstacles.

    Raises:
        ValueError: If an obstacle names a node that the robot does not have.
        RuntimeError: If a custom shape cannot be compiled.
    """
    extents = [obstacle.extent for obstacle in scene]
    return (
        [SHAPES[obstacle.kind] for obstacle in scene],
        np.array([_filled(obstacle.parameters, SHAPE_SIZE) for obstacle in scene], dtype=float),
        np.array([(*e.center, e.radius, e.min_curvature_radius, e.inradius) for e in extents], dtype=float),
        touchable_points(robot, scene).reshape(len(scene), len(robot.lines_mm) * robot.positions),
        np.array([obstacle.spring_matrix for obstacle in scene], dtype=float),
        [function_address(gap_function(law)) if law.kind == "custom" else 0 for law in scene.laws],
        [np.ascontiguousarray(obstacle.surface) for obstacle in scene],
    )


def _filled(values: tuple[float, ...], size: int) -> tuple[float, ...]:
    return values + (size - len(values)) * (0.0,)
