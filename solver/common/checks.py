"""Checks of robots, scenes and equilibria before they reach the kernel."""

import math
import os

import numpy as np

from solver.common.equilibrium import BaseEquilibrium
from solver.common.robot import AnyRobot
from solver.common.scene import Scene
from solver.common.status import Status
from solver.common.validation import check_instance, shown

SPRINGS = (1e-10, 1e10)  # stiffness of an obstacle's spring, over EI/L³ of the robot


def check_core(robot: AnyRobot, scene: Scene) -> None:
    """Check that no obstacle can slip through an edge of the robot: each needs a point deeper than half an edge.

    Raises:
        ValueError: Naming the obstacle, its inner radius and what the robot needs.
    """
    longest = max(robot.edges_mm) if len(scene) else 0.0
    for obstacle in scene:
        inradius = obstacle.extent.inradius
        if 2 * inradius > longest:
            continue
        touchable = obstacle.touchable(robot.segments + 1)
        if (touchable[1:] & touchable[:-1]).any():
            between = math.floor(longest * (robot.between + 1) / (2 * inradius))
            raise ValueError(
                f"the largest disc or ball in {shown(obstacle)} has the radius {inradius:.6g} mm; it could slip "
                f"between points of the robot, up to {longest:.6g} mm apart: give the robot between={between} or more"
            )


def check_clear(robot: AnyRobot, scene: Scene, gaps: np.ndarray) -> None:
    """Check that no obstacle overlaps the unstressed robot, whose gaps are given, ``(m, p, k)``.

    Raises:
        ValueError: Naming the obstacle, the node and the depth.
    """
    for obstacle, own in zip(scene, gaps, strict=True):
        if own.min() < 0:
            node = int(np.unravel_index(own.argmin(), own.shape)[1]) // (robot.between + 1)
            raise ValueError(f"{shown(obstacle)} overlaps the unstressed robot by {-own.min():.3g} mm at node {node}")


def check_rest(rest: BaseEquilibrium[AnyRobot]) -> None:
    """Check that the robot at rest is in equilibrium with all of its loads, and that no obstacle overlaps it.

    An obstacle that its loads press it against is met to roundoff.

    Raises:
        ValueError: As :func:`check_clear`, or naming the tension limit and how far the cables can be paid out.
    """
    check_clear(rest.robot, rest.scene, np.where(rest.contact, 0.0, rest.gaps))
    check_carried(rest.robot, rest.status)


def check_carried(robot: AnyRobot, status: int) -> None:
    """Check by the status of its rest that a robot is in equilibrium with all of its loads.

    Raises:
        ValueError: Naming the tension limit and how far the cables can be paid out.
    """
    if status == Status.GAVE_UP:
        raise ValueError(
            f"max_tension is {robot.max_tension:.6g} N; at rest its loads cannot all be carried within it, "
            f"its cables paid out to {robot.least_cable_mm:.6g} mm at most, or bend or twist it too far: raise "
            "max_tension or rigidity, lower loads or weight, or add an opposed cable"
        )


def check_scene(robot: AnyRobot, kind: type, scene: Scene, space: int) -> None:
    """Check that robot and scene are of the solver's space, and in proportion to each other.

    Raises:
        TypeError: If they are not of the required classes.
        ValueError: Naming the obstacle, the value and the bound.
    """
    remedy = "robots of the plane are solver.Robot, those of space solver.spatial.SpatialRobot"
    check_instance("robot", robot, kind, remedy)
    check_instance("scene", scene, Scene, "put the obstacles in one, Scene([…])")
    for obstacle in scene:
        if obstacle.space != space:
            names = ("the plane", "solver.spatial") if space == 3 else ("space", "solver")
            raise ValueError(f"{shown(obstacle)} is an obstacle of {names[0]}; take one from the package {names[1]}")
        obstacle.check_proportion(robot.longest_mm)
        if obstacle.spring is not None:
            _check_spring(robot, obstacle.spring_matrix)


def _check_spring(robot: AnyRobot, spring: np.ndarray) -> None:
    low, high = (ratio * robot.rigidity / robot.longest_mm**3 for ratio in SPRINGS)
    alike = not (spring - spring[0, 0] * np.eye(len(spring))).any()  # which is the usual case, and faster
    least, *_, most = np.diagonal(spring) if alike else np.linalg.eigvalsh(spring)
    if not low <= least <= most <= high:
        raise ValueError(
            f"spring is from {least:.6g} to {most:.6g} N/mm; it must be from {low:.6g} to {high:.6g} N/mm, "
            f"{SPRINGS[0]:g} to {SPRINGS[1]:g} of the robot's EI/L³: leave out a softer obstacle, fix a stiffer one"
        )


def check_origin(robot: AnyRobot, scene: Scene, equilibrium: BaseEquilibrium[AnyRobot], kind: type) -> None:
    """Check that an equilibrium is one of this robot and scene.

    Raises:
        ValueError: Saying which of them differs.
        TypeError: If it is not an equilibrium.
    """
    if not isinstance(equilibrium, kind):
        check_instance("equilibrium", equilibrium, kind, "step from rest() of this solver")
    if equilibrium.robot is not robot and equilibrium.robot != robot:
        raise ValueError("the equilibrium is of another robot; step from rest() of this solver")
    if equilibrium.scene is not scene and equilibrium.scene != scene:
        raise ValueError("the equilibrium is of another scene; step from rest() of this solver")


def check_start(robot: AnyRobot, space: int, equilibrium: BaseEquilibrium[AnyRobot], kind: type, scene: Scene) -> None:
    """Check that an equilibrium is one of this robot, from which its obstacles can move to another scene.

    Raises:
        ValueError: Saying what differs, or why the robot cannot be in that scene.
        TypeError: If it is not an equilibrium.
    """
    check_scene(robot, type(robot), scene, space)
    check_instance("equilibrium", equilibrium, kind, "step from rest() of this solver")
    check_origin(robot, equilibrium.scene, equilibrium, kind)
    equilibrium.scene.check_motion(scene)
    check_core(robot, scene)


def check_memory(count: int, size: int) -> None:
    """Check that the blocks of all robots fit into memory.

    Raises:
        ValueError: Naming the count and how many fit.
    """
    needed, available = 8 * count * size, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if needed > available:
        raise ValueError(
            f"count is {count}; their blocks need {needed / 1e9:.3g} GB and this machine has {available / 1e9:.3g} GB: "
            f"make batches of at most {available // (8 * size)}"
        )
