"""The free robot, which nothing touches, in closed form: all segments have the same shape."""

from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from solver.common.checks import check_scene
from solver.common.geometry import touching_gaps
from solver.common.scene import Scene
from solver.common.signals import held_signals
from solver.common.validation import check_instance, check_number, check_whole
from solver.planar.equilibrium import touching_points
from solver.planar.formulation import arc_function
from solver.planar.robot import Robot

NEWTON_ITERATIONS = 8
RESOLVED = 1e-9  # of the cable limit: a line fitted over less would fit roundoff


class _Segment(NamedTuple):
    """A segment of the free robot: angle of its disks [rad], chord [mm], and their slopes in the displacement."""

    angle: float
    chord: float
    turn: float
    stretch: float


def tip_slopes(robot: Robot, cable_mm: float, node: int | None = None) -> np.ndarray:
    """Return the exact slopes of the free tip pose (x, y, φ) in the cable displacement (eq. 7), ``(3,)`` [1/mm].

    Args:
        robot: The robot.
        cable_mm: Cable displacement [mm].
        node: Index of the node whose pose is meant; ``None`` for the tip.

    Returns:
        Slopes [mm, mm, rad per mm].

    Raises:
        ValueError: If the displacement or the node is out of the robot's range, or the robot does not bend evenly.
        TypeError: If the robot is not one of the plane.
    """
    angle, chord, turn, stretch = _segment(robot, cable_mm)
    node = robot.segments if node is None else _check_node(robot, node)
    middles = np.arange(node) + 0.5
    sines, cosines, turns = np.sin(middles * angle), np.cos(middles * angle), middles * turn
    return np.array(
        [
            (stretch * sines + chord * turns * cosines).sum(),
            (stretch * cosines - chord * turns * sines).sum(),
            -node * turn,
        ]
    )


def fitted_slopes(robot: Robot, low_mm: float, high_mm: float, node: int | None = None) -> np.ndarray:
    """Return the slopes of straight lines fitted to the free tip pose over a range of displacement (Fig. 7).

    Args:
        robot: The robot.
        low_mm: Least cable displacement [mm].
        high_mm: Largest cable displacement [mm].
        node: Index of the node whose pose is meant; ``None`` for the tip.

    Returns:
        Slopes of x, y and φ, ``(3,)`` [mm, mm, rad per mm].

    Raises:
        ValueError: If the range is too small to fit a line to, or it or the node is out of the robot's range.
        TypeError: If the robot is not one of the plane.
    """
    low, high = _check_cable(robot, low_mm), _check_cable(robot, high_mm)
    node = robot.segments if node is None else _check_node(robot, node)
    least = RESOLVED * robot.cable_limit_mm
    if not high - low >= least:
        bounds = f"0 to {robot.cable_limit_mm:.6g} mm, by at least {least:.2g} mm"
        raise ValueError(f"the range from low_mm to high_mm is {low:.6g} to {high:.6g}; it must grow within {bounds}")
    cables = np.linspace(low, high, 101).tolist()
    tips = np.array([free_nodes(robot, cable)[node] for cable in cables])
    return np.asarray(np.polyfit(cables, tips, 1)[0])


def free_angle(robot: Robot, cable_mm: float) -> float:
    """Return the angle between consecutive disks of the free robot [rad]."""
    return _segment(robot, cable_mm).angle


def free_nodes(robot: Robot, cable_mm: float) -> np.ndarray:
    """Return the node poses of the free robot, ``(n+1, 3)`` [mm, mm, rad]."""
    angle, chord, *_ = _segment(robot, cable_mm)
    nodes = np.zeros((robot.segments + 1, 3))
    middles = (np.arange(robot.segments) + 0.5) * angle
    nodes[1:, 0] = chord * np.cumsum(np.sin(middles))
    nodes[1:, 1] = chord * np.cumsum(np.cos(middles))
    nodes[:, 2] = -angle * np.arange(robot.segments + 1)
    return nodes


def free_tension(robot: Robot, cable_mm: float) -> float:
    """Return the cable tension of the free robot, ``B dJ/dl`` [N]."""
    segment = _segment(robot, cable_mm)
    return 2 * robot.energy_scale * robot.segments * segment.angle * segment.turn


def clearance(robot: Robot, scene: Scene, cable_mm: float) -> float:
    """Return the smallest gap of the free robot at a cable displacement [mm]; negative where it would be in contact.

    Raises:
        ValueError: If the displacement is out of the robot's range, or the scene is out of proportion to it.
        TypeError: If the robot or the scene is of the wrong class.
    """
    check_scene(robot, Robot, scene, 2)
    points = touching_points(robot, free_nodes(robot, cable_mm))
    return float(touching_gaps(robot, scene, points).min(initial=np.inf))


def _check_cable(robot: Robot, cable_mm: float) -> float:
    """Return a cable displacement within the robot's range as a float."""
    check_instance("robot", robot, Robot, "the closed form is that of robots of the plane")
    if not robot.bends_evenly:
        raise ValueError(
            "the closed form is that of a robot that one cable to its tip bends evenly; step a Solver of it"
        )
    limit = robot.cable_limit_mm
    return check_number("cable_mm", cable_mm, 0, limit, f"from 0 to {limit:.6g} (robot.max_cable_mm)")


def _check_node(robot: Robot, node: int) -> int:
    return check_whole("node", node, 0, robot.segments)


@held_signals()
def _segment(robot: Robot, cable_mm: float) -> _Segment:
    """Return the segment that all of the free robot's are, in the rod by Newton's method on the cable length."""
    cable_mm = _check_cable(robot, cable_mm)
    pull, length, offset = cable_mm / robot.segments, robot.segment_mm, robot.offset_mm
    if robot.model == "paper":  # its shear vanishes
        turn = 1 / np.sqrt((robot.segments * offset) ** 2 - cable_mm**2 / 4)
        return _Segment(float(2 * np.arcsin(pull / (2 * offset))), length, float(turn), 0.0)
    angle = pull / offset
    for _ in range(NEWTON_ITERATIONS):
        _, taken, slope = _arc(angle, length, offset)
        angle -= (taken - pull) / slope
    stretch, _, slope = _arc(angle, length, offset)
    chord, turn = length * np.sinc(angle / (2 * np.pi)), 1 / (robot.segments * slope)
    return _Segment(float(angle), float(chord), float(turn), float(stretch * chord * turn))


@lru_cache(maxsize=1)
def _arc_function() -> ca.Function:
    return arc_function()


def _arc(angle: float, length: float, offset: float) -> tuple[float, float, float]:
    """Return the relative slope of an arc's chord in the angle, and what it takes up from the cable, with its slope."""
    law = _arc_function()(angle, length).full().ravel()
    half_cosine, half_sine, short_by, short_slope = law[7:11]
    return law[3], short_by + 2 * offset * half_sine, short_slope + offset * half_cosine
