"""The robot that nothing touches, in closed form: all segments have the same shape."""

from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from solver.common.checks import check_scene
from solver.common.geometry import touching_gaps
from solver.common.layout import PLANE
from solver.common.scene import Scene
from solver.common.validation import instance, number, whole
from solver.planar.formulation import arc_function
from solver.planar.geometry import touching_points
from solver.planar.robot import Robot

NEWTON_ITERATIONS = 8
RESOLVED = 1e-9  # of the cable limit: a line over less is fitted to roundoff


class _Segment(NamedTuple):
    """A segment of the free robot: angle of its disks [rad], chord [mm], and their slopes in the cable displacement."""

    angle: float
    chord: float
    turn: float
    stretch: float


def tip_slopes(robot: Robot, cable_mm: float, node: int | None = None) -> np.ndarray:
    """Exact slopes of the free tip pose (x, y, φ) in the cable displacement (eq. 7), ``(3,)`` [mm, mm, rad per mm].

    With ``node``, those of the node of that index, as if the robot ended there.

    Raises:
        ValueError: If the displacement or the node is none of the robot's.
        TypeError: If the robot is something else.
    """
    angle, chord, turn, stretch = _segment(robot, cable_mm)
    node = robot.segments if node is None else _node(robot, node)
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
    """Slopes of straight lines fitted to the free tip pose over a range of cable displacement (Fig. 7), as above.

    With ``node``, those of the node of that index.

    Raises:
        ValueError: If the range is too small to fit a line to or outside the robot's, or the node is none of it.
        TypeError: If the robot is something else.
    """
    node = _node(robot, robot.segments if node is None else node)
    low, high = _cable(robot, low_mm), _cable(robot, high_mm)
    least = RESOLVED * robot.cable_limit_mm
    if not high - low >= least:
        bounds = f"0 to {robot.cable_limit_mm:.6g} mm, by at least {least:.2g} mm"
        raise ValueError(f"range is {low_mm} to {high_mm}; it must grow within {bounds}")
    cables = np.linspace(low, high, 101).tolist()
    tips = np.array([free_nodes(robot, cable)[node] for cable in cables])
    return np.asarray(np.polyfit(cables, tips, 1)[0])


def free_angle(robot: Robot, cable_mm: float) -> float:
    """Angle between consecutive disks [rad]."""
    return _segment(robot, cable_mm).angle


def free_nodes(robot: Robot, cable_mm: float) -> np.ndarray:
    """Node poses, ``(n+1, 3)`` [mm, mm, rad]."""
    angle, chord, *_ = _segment(robot, cable_mm)
    nodes = np.zeros((robot.segments + 1, 3))
    middles = (np.arange(robot.segments) + 0.5) * angle
    nodes[1:, 0] = chord * np.cumsum(np.sin(middles))
    nodes[1:, 1] = chord * np.cumsum(np.cos(middles))
    nodes[:, 2] = -angle * np.arange(robot.segments + 1)
    return nodes


def free_tension(robot: Robot, cable_mm: float) -> float:
    """Cable tension, ``B dJ/dl`` [N]."""
    segment = _segment(robot, cable_mm)
    return 2 * robot.energy_scale * robot.segments * segment.angle * segment.turn


def clearance(robot: Robot, scene: Scene, cable_mm: float) -> float:
    """Smallest gap of the free robot at a cable displacement [mm]; negative where it would be in contact.

    Raises:
        ValueError: If the displacement is none of the robot's, or the scene is out of all proportion to it.
        TypeError: If the robot or the scene is something else.
    """
    check_scene(robot, Robot, scene, PLANE)
    points = touching_points(robot, free_nodes(robot, cable_mm))
    return float(touching_gaps(robot, scene, points).min(initial=np.inf))


def _cable(robot: Robot, cable_mm: float) -> float:
    """A cable displacement that the robot has."""
    instance("robot", robot, Robot, "the free robot in closed form is one of the plane")
    limit = robot.cable_limit_mm
    return number("cable_mm", cable_mm, 0, limit, f"from 0 to {limit:.6g} (robot.max_cable_mm)")


def _node(robot: Robot, node: int) -> int:
    return whole("node", node, 0, robot.segments)


def _segment(robot: Robot, cable_mm: float) -> _Segment:
    cable_mm = _cable(robot, cable_mm)
    pull, length, offset = cable_mm / robot.segments, robot.segment_mm, robot.offset_mm
    if robot.model == "paper":  # its shear vanishes
        turn = 1 / np.sqrt((robot.segments * offset) ** 2 - cable_mm**2 / 4)
        return _Segment(float(2 * np.arcsin(pull / (2 * offset))), length, float(turn), 0.0)
    angle = pull / offset
    for _ in range(NEWTON_ITERATIONS):
        *_, taken, slope, _ = _arc(angle, length, offset)
        angle -= (taken - pull) / slope
    _, _, _, stretch, *_, slope, _ = _arc(angle, length, offset)
    chord, turn = length * np.sinc(angle / (2 * np.pi)), 1 / (robot.segments * slope)
    return _Segment(float(angle), float(chord), float(turn), float(stretch * chord * turn))


@lru_cache(maxsize=1)
def _arc_function() -> ca.Function:
    return arc_function()


def _arc(angle: float, length: float, offset: float) -> np.ndarray:
    return np.asarray(_arc_function()(angle, length, offset)).ravel()
