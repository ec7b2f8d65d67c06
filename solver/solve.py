"""The solver: one robot in one scene, its equilibria followed step by step."""

import math
from typing import NamedTuple

import numpy as np

from solver import _kernel
from solver._kernel import SHAPE_SIZE
from solver.compile import law_address
from solver.equilibrium import BaseEquilibrium, Equilibrium, Optimality
from solver.geometry import touchable_points
from solver.layout import LENGTH, PLANE, Model
from solver.obstacles import SHAPES
from solver.robot import AnyRobot, Robot
from solver.scene import Scene
from solver.validation import instance, number, shown

REASONS = ("", "folded", "work", "stuck")
SPRINGS = (1e-10, 1e10)  # stiffness of an obstacle's spring, over EI/L³ of the robot


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


def read_trace(traced: tuple[list[float], int], robot: AnyRobot, scene: Scene, space: int) -> Trace:
    """The shapes that the kernel has written one after the other."""
    parts = ((robot.segments + 1, 3), (len(robot.lines_mm), robot.positions, space), (len(scene), space))
    ends = np.cumsum([math.prod(part) for part in parts])
    numbers, reason = traced
    rows = np.reshape(numbers, (-1, int(ends[-1])))
    columns = np.split(rows, ends[:-1], axis=1)
    nodes, points, moved = (column.reshape(-1, *part) for column, part in zip(columns, parts, strict=True))
    return Trace(nodes, points, moved, REASONS[reason])


class Solver:
    """Follows the equilibria of a robot among obstacles as its cable is pulled and released (eq. 5).

    The equilibrium reached depends on the way there, so the present one is an argument of every step and the solver
    keeps none.

    Args:
        robot: The robot.
        scene: The obstacles.

    Raises:
        ValueError: If an obstacle is one of space, overlaps the straight robot, is small enough to slip between its
            points, names a node the robot does not have, or is out of all proportion to it.
        TypeError: If the robot or the scene is something else.
        RuntimeError: If a :class:`~solver.custom.Custom` shape cannot be compiled.
    """

    def __init__(self, robot: Robot, scene: Scene) -> None:
        check_scene(robot, Robot, scene, PLANE)
        self.robot = robot
        self.scene = scene
        check_core(robot, scene)
        self._kernel = _kernel.Kernel(kernel_robot(robot), kernel_scene(robot, scene))
        straight = np.zeros(self._kernel.block_size)
        straight[LENGTH] = robot.length_mm
        self._rest = self._follow(straight, 0.0, robot.length_mm)
        check_clear(robot, scene, self._rest.gaps)

    def rest(self) -> Equilibrium:
        """The straight, unactuated robot."""
        return self._rest

    def step(self, equilibrium: Equilibrium, cable_mm: float, length_mm: float | None = None) -> Equilibrium:
        """Move the cable to a displacement, and the base to an insertion, as far as tension and obstacles allow.

        Args:
            equilibrium: Where the robot is, from this solver or one of an equal robot and scene.
            cable_mm: Commanded cable displacement, 0 to ``robot.max_cable_mm`` [mm].
            length_mm: Commanded length of the backbone, within ``robot.length_range_mm`` [mm]; ``None`` keeps it. Both
                commands are approached evenly.

        Returns:
            The equilibrium reached; its ``status`` says how. While anything touches, a uniform cable is not slackened
            below a pretension of 0.00625 of ``robot.offset_mm``, where the shape would be undetermined; without it such
            a robot is given up on where insertion meets an obstacle.

        Raises:
            ValueError: If a command is out of range or the equilibrium is another robot's or scene's.
            TypeError: If ``equilibrium`` is something else.
        """
        cable_mm, length_mm = check_command(self.robot, self.scene, equilibrium, cable_mm, length_mm)
        return self._follow(equilibrium.block, cable_mm, length_mm)

    def trace(self, equilibrium: Equilibrium, cable_mm: float, length_mm: float | None = None) -> Trace:
        """Every shape accepted on the way of :meth:`step`, from the present one on.

        Shows what happens inside a step: its sub-steps, and the descent through a snap.

        Raises:
            ValueError: As :meth:`step`.
        """
        cable_mm, length_mm = check_command(self.robot, self.scene, equilibrium, cable_mm, length_mm)
        return read_trace(self._kernel.trace(equilibrium.block, (cable_mm, length_mm)), self.robot, self.scene, 2)

    def optimality(self, equilibrium: Equilibrium) -> Optimality:
        """How well an equilibrium meets its conditions, computed anew by the kernel.

        Raises:
            ValueError: If the equilibrium is another robot's or scene's.
        """
        check_origin(self.robot, self.scene, equilibrium, Equilibrium)
        return Optimality(*self._kernel.optimality(equilibrium.block))

    def _follow(self, block: np.ndarray, cable_mm: float, length_mm: float) -> Equilibrium:
        reached = np.empty_like(block)
        work = self._kernel.step(block, cable_mm, length_mm, reached)
        return Equilibrium.solved(self.robot, self.scene, reached, *work)


def kernel_robot(robot: Robot) -> _kernel.Robot:
    """A robot as the kernel takes it."""
    return _kernel.Robot(
        sliding=robot.model == "rod",
        segments=robot.segments,
        offset=robot.offset_mm,
        angle=0.0,
        rigidity=robot.rigidity,
        max_tension=robot.max_tension,
        max_length=robot.lengths_mm[1],
        disk_radius=robot.disk_radius_mm or robot.offset_mm,
        disk_thickness=robot.disk_thickness_mm,
        lines=[(line, 0.0) for line in robot.lines_mm],
        edges=list(robot.edges_mm),
        between=robot.between,
    )


def kernel_scene(robot: Robot, scene: Scene) -> _kernel.Scene:
    """Obstacles as the kernel takes them.

    Raises:
        ValueError: If an obstacle names a node that the robot does not have.
        RuntimeError: If a custom shape cannot be compiled.
    """
    return _kernel.Scene(*scene_arrays(robot, scene))


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
        [law_address(law) if law.kind == "custom" else 0 for law in scene.laws],
        [np.ascontiguousarray(obstacle.surface) for obstacle in scene],
    )


def check_core(robot: AnyRobot, scene: Scene) -> None:
    """Refuse obstacles that could slip through an edge of the robot: those with no point deeper than half an edge.

    Raises:
        ValueError: Naming the obstacle, its inner radius and what the robot needs.
    """
    for obstacle in scene:
        touchable = obstacle.touchable(robot.segments + 1)
        inradius, longest = obstacle.extent.inradius, max(robot.edges_mm)
        if (touchable[1:] & touchable[:-1]).any() and not 2 * inradius > longest:
            between = math.floor(longest * (robot.between + 1) / (2 * inradius))
            raise ValueError(
                f"the largest disc or ball in {shown(obstacle)} has the radius {inradius:.3g} mm; it could slip "
                f"between points of the robot, up to {longest:.3g} mm apart: give the robot between={between} or more"
            )


def check_clear(robot: AnyRobot, scene: Scene, gaps: np.ndarray) -> None:
    """Refuse obstacles that overlap the straight robot, whose gaps are given, ``(m, p, k)``.

    Raises:
        ValueError: Naming the obstacle, the node and the depth.
    """
    for obstacle, own in zip(scene, gaps, strict=True):
        if own.min() < 0:
            node = int(np.unravel_index(own.argmin(), own.shape)[1]) // (robot.between + 1)
            raise ValueError(f"{shown(obstacle)} overlaps the straight robot by {-own.min():.3g} mm at node {node}")


def check_scene(robot: AnyRobot, kind: type, scene: Scene, model: Model) -> None:
    """Refuse a robot and a scene that a solver has no use for, or that are out of all proportion to each other.

    Raises:
        TypeError: If they are not of the classes asked for.
        ValueError: Naming the obstacle, the value and the bound.
    """
    instance("robot", robot, kind, "robots of the plane are solver.Robot, those of space solver.spatial.SpatialRobot")
    instance("scene", scene, Scene, "put the obstacles in one, Scene([…])")
    for obstacle in scene:
        if obstacle.space != model.space:
            names = ("the plane", "solver.spatial") if model.space == 3 else ("space", "solver")
            raise ValueError(f"{shown(obstacle)} is an obstacle of {names[0]}; give one of {names[1]}")
        obstacle.check_proportion(robot.longest_mm)
        if obstacle.spring is not None:
            _check_spring(robot, obstacle.spring_matrix)


def _check_spring(robot: AnyRobot, spring: np.ndarray) -> None:
    low, high = (ratio * robot.rigidity / robot.longest_mm**3 for ratio in SPRINGS)
    least, *_, most = np.linalg.eigvalsh(spring)
    if not low <= least <= most <= high:
        raise ValueError(
            f"spring is from {least:.6g} to {most:.6g} N/mm; it must be from {low:.6g} to {high:.6g} N/mm, "
            f"{SPRINGS[0]:g} to {SPRINGS[1]:g} of the robot's EI/L³: leave out a softer obstacle, fix a stiffer one"
        )


def check_command(
    robot: Robot, scene: Scene, equilibrium: Equilibrium, cable_mm: float, length_mm: float | None
) -> tuple[float, float]:
    """Refuse a command out of range and an equilibrium of another robot or scene; returns the command as floats.

    Raises:
        ValueError: Naming the value and the bound.
        TypeError: If the equilibrium is something else.
    """
    limit = robot.cable_limit_mm
    if not (type(cable_mm) is float and 0 < cable_mm <= limit):
        cable_mm = number("cable_mm", cable_mm, 0, limit, f"from 0 to {limit:.6g} (robot.max_cable_mm)")
    check_origin(robot, scene, equilibrium, Equilibrium)
    if length_mm is None:
        return cable_mm, equilibrium.length_mm
    return cable_mm, robot.check_length(length_mm)


def check_origin(robot: AnyRobot, scene: Scene, equilibrium: BaseEquilibrium, kind: type) -> None:
    """Refuse an equilibrium of another robot or scene.

    Raises:
        ValueError: Saying which of them differs.
        TypeError: If it is something else.
    """
    if not isinstance(equilibrium, kind):
        instance("equilibrium", equilibrium, kind, "step from rest() of this solver")
    if equilibrium.robot is not robot and equilibrium.robot != robot:
        raise ValueError("the equilibrium is of another robot; step from rest() of this solver")
    if equilibrium.scene is not scene and equilibrium.scene != scene:
        raise ValueError("the equilibrium is of another scene; step from rest() of this solver")


def _filled(values: tuple[float, ...], size: int) -> tuple[float, ...]:
    return values + (size - len(values)) * (0.0,)
