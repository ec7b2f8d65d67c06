"""Obstacles and rods as the kernel takes them."""

import math
from collections.abc import Sequence
from typing import TypedDict

import numpy as np

from solver import _kernel
from solver.cache.compile import function_address
from solver.common.gap_laws import GapLaw, gap_function
from solver.common.geometry import touchable_points
from solver.common.obstacle import SHAPES, Obstacle
from solver.common.robot import AnyRobot
from solver.common.rod import AnyRod, full_cables
from solver.common.scene import Scene


class KernelObstacle(TypedDict):
    """The keyword arguments of ``_kernel.Obstacle`` and ``_kernel.SpatialObstacle``."""

    shape: _kernel.Shape
    parameters: np.ndarray
    center: tuple[float, ...]
    radius: float
    min_curvature_radius: float
    inradius: float
    outline: np.ndarray | None
    touchable: np.ndarray | None
    spring: np.ndarray | None
    law: int


def kernel_obstacles(robot: AnyRobot, scene: Scene) -> list[KernelObstacle]:
    """Return what the kernel needs to know of each obstacle.

    Raises:
        ValueError: If an obstacle names a node that the robot does not have.
        RuntimeError: If a custom shape cannot be compiled.
    """
    touchable: Sequence[np.ndarray | None] = [None] * len(scene)
    if any(obstacle.nodes is not None for obstacle in scene):
        touchable = list(touchable_points(robot, scene))
    return [_kernel_obstacle(*parts) for parts in zip(scene, scene.laws, touchable, strict=True)]


def _kernel_obstacle(obstacle: Obstacle, law: GapLaw, touchable: np.ndarray | None) -> KernelObstacle:
    extent, surface = obstacle.extent, obstacle.surface
    return KernelObstacle(
        shape=SHAPES[law.kind],
        parameters=np.array(obstacle.parameters, dtype=float),
        center=extent.center,
        radius=extent.radius,
        min_curvature_radius=extent.min_curvature_radius,
        inradius=extent.inradius,
        outline=np.ascontiguousarray(surface) if len(surface) else None,
        touchable=touchable,
        spring=None if obstacle.spring is None else obstacle.spring_matrix,
        law=function_address(gap_function(law)) if law.kind == "custom" else 0,
    )


def kernel_rod(robot: AnyRod, stiffness: np.ndarray, rest: np.ndarray, bounded_twist: float = math.inf) -> _kernel.Rod:
    """Return what the kernel needs to know of a rod.

    Args:
        robot: The robot.
        stiffness: EI, in space also GJ, of each segment over the robot's rigidity, ``(n,)`` or ``(n, 3)``.
        rest: Angles of each segment at rest, likewise [rad].
        bounded_twist: Twist of a segment in space up to which no edge is too long [rad].
    """
    cables, weight = full_cables(robot), (*robot.weight_per_length, 0.0)[:3]
    loads = [
        _kernel.Load(node=load.node, at=load.place_mm, force=(*load.force, 0.0)[:3], moment=load.moment)
        for load in robot.loads
    ]
    return _kernel.Rod(
        holes=[cable.hole_mm for cable in cables],
        ends=[cable.end or robot.segments for cable in cables],
        stiffness=np.ascontiguousarray(stiffness, float),
        rest=np.ascontiguousarray(rest, float),
        weight=weight,
        loads=loads,
        least_pull=robot.least_cable_mm,
        bounded_twist=bounded_twist,
    )
