"""The rod in space as a problem in node coordinates, for the reference solver and the certificate.

The unknowns are positions of nodes, two points of the edge of each disk, and the rotation vector of each segment; the
equalities say that a rotation vector takes one disk to the next, and that the chord lies along the tangent halfway. A
rotation vector says of itself how far a segment is bent and twisted, so that no other shape has the same energy. It
is stated here once more, by power series of sine and cosine, and shares no code with what the kernel is generated from.
"""

import math
from typing import NamedTuple

import casadi as ca
import numpy as np

from solver.common.gap_laws import GapLaw
from solver.common.loads import load_work
from solver.common.node_problem import NodeProblem, norms
from solver.common.rod import full_cables
from solver.spatial.obstacle_terms import ObstacleSymbols, obstacle_terms, parameter_count
from solver.spatial.robot import SpatialRobot, stiffness_ratios

TERMS = 15  # of the power series: to the last digit for half a turn
EQUALITIES = 9  # of a segment


class _Shape(NamedTuple):
    """Points of backbone and both edges at nodes 0…n, and the rotation vectors of the segments."""

    backbone: ca.MX
    first: ca.MX
    second: ca.MX
    turns: ca.MX

    def line(self, x: float, y: float) -> ca.MX:
        """Return the points of the disks at shares of both edge vectors from the backbone."""
        return self.backbone + x * (self.first - self.backbone) + y * (self.second - self.backbone)


def rod_inequality_count(robot: SpatialRobot) -> int:
    """Return how many inequalities a rod has of its own: slacks of its cables, and the gap between disks a segment."""
    return len(robot.cables) + robot.segments if robot.model == "rod" else 0


def rod_node_problem(
    robot: SpatialRobot, laws: tuple[GapLaw, ...], mounted: tuple[bool, ...], change: ca.MX | None = None
) -> NodeProblem:
    """Build the node-coordinate problem of a rod and obstacles of given kinds.

    Args:
        robot: The robot, with c cables.
        laws: Gap laws of the obstacles.
        mounted: Which obstacles are on springs.
        change: Change of (l of each cable, L0), then of each obstacle its motion, as in the paper's model,
            ``(c + 1 + 7m,)`` [mm, rad]; ``None`` for none.

    Returns:
        The problem. ``unknowns``: backbone points of nodes 1…n, then the points of their disks at the distance a
        towards the disk's x axis, then those towards its y axis, the rotation vectors of the segments times a, and the
        displacements of the obstacles on springs, ``(12n + 3s,)`` [mm]. ``parameters``: ``(l of each cable, L0, EI)``,
        the shapes of the obstacles, one after the other, and the six upper entries of the stiffness of those on
        springs. ``objective``: elastic energy, energy of the springs and potential of the loads over ``B = EI / 2 l0``
        [rad²]. ``equalities``: of each segment its chord, then its upper disk minus their values, ``(9n,)`` [mm].
        ``inequalities``: slack of each cable, then the gap between the disks of each segment, then the gaps to
        obstacles [mm].
    """
    n, cables = robot.segments, len(robot.cables)
    unknowns = ca.MX.sym("unknowns", 12 * n + 3 * sum(mounted))
    parameters = ca.MX.sym("parameters", cables + 2 + parameter_count(laws, mounted))
    commands = parameters[: cables + 1] if change is None else parameters[: cables + 1] + change[: cables + 1]
    segment = commands[cables] / n
    energy_scale = parameters[cables + 1] / (2 * segment)
    shape = _shape(robot, unknowns[: 12 * n])
    moved = None if change is None else change[cables + 1 :]
    symbols = ObstacleSymbols(laws, mounted, unknowns[12 * n :], parameters[cables + 2 :], moved)
    lines = [shape.line(x, y) for x, y in robot.lines_mm / robot.offset_mm]
    springs, gaps = obstacle_terms(symbols, lines, robot.between, energy_scale)
    limits = ca.vertcat(*_slacks(robot, shape, commands, segment), _disk_gaps(robot, shape, segment))
    objective = _energy(robot, shape) + springs - _work(robot, shape, segment) / energy_scale
    return NodeProblem(unknowns, parameters, objective, _equalities(robot, shape, segment), limits, gaps)


def _shape(robot: SpatialRobot, unknowns: ca.MX) -> _Shape:
    n, bases = robot.segments, robot.offset_mm * np.eye(3)[:, :2]
    backbone, first, second, turns = (ca.reshape(part, 3, n) for part in ca.vertsplit(unknowns, 3 * n))
    x, y = (ca.horzcat(ca.DM(base), line) for base, line in zip(bases.T, (first, second), strict=True))
    return _Shape(ca.horzcat(ca.DM.zeros(3), backbone), x, y, turns / robot.offset_mm)


def _energy(robot: SpatialRobot, shape: _Shape) -> ca.MX:
    """Return the elastic energy over B [rad²]."""
    strain = shape.turns - ca.DM(np.broadcast_to(robot.precurvature, (robot.segments, 3)).T)
    return ca.dot(ca.DM(stiffness_ratios(robot).T) * strain, strain)


def _work(robot: SpatialRobot, shape: _Shape, segment: ca.MX) -> ca.MX:
    """Return the work of the loads [N·mm]."""
    a = robot.offset_mm
    return ca.MX(load_work(robot, segment, lambda node, place: shape.line(place[0] / a, place[1] / a)[:, node]))


def _slacks(robot: SpatialRobot, shape: _Shape, commands: ca.MX, segment: ca.MX) -> list[ca.MX]:
    """Return how much longer each cable is than its way through the disks [mm]."""
    slacks = []
    for k, cable in enumerate(full_cables(robot)):
        end, (x, y) = cable.end or robot.segments, cable.hole_mm
        line = shape.line(x / robot.offset_mm, y / robot.offset_mm)[:, : end + 1]
        slacks.append(end * segment - commands[k] - ca.sum2(norms(line[:, 1:] - line[:, :-1])))
    return slacks


def _equalities(robot: SpatialRobot, shape: _Shape, segment: ca.MX) -> ca.MX:
    """Return what the law of a segment leaves of its chord and its upper disk, segment by segment, ``(9n,)`` [mm]."""
    lower = [line[:, :-1] for line in shape[:3]]
    upper = [line[:, 1:] for line in shape[:3]]
    law = _segment_law(robot.offset_mm).map(robot.segments)
    return ca.vec(law(*lower, *upper, shape.turns, ca.repmat(segment, 1, robot.segments)))


def _segment_law(offset: float) -> ca.Function:
    """Return ``(lower backbone, edges, upper ones, u, l0) → the equalities of a segment``, ``(9,)`` [mm]."""
    points = [ca.SX.sym("point", 3) for _ in range(6)]
    turn, length = ca.SX.sym("turn", 3), ca.SX.sym("length")
    (x, y), (x_after, y_after) = (
        [(edge - center) / offset for edge in edges] for center, *edges in (points[:3], points[3:])
    )
    frame = ca.horzcat(x, y, ca.cross(x, y))
    straight, _ = sine_and_versine(ca.sumsqr(turn[:2]) / 4)
    chord = frame.T @ (points[3] - points[0]) - length * straight * rotation(turn / 2)[:, 2]
    disk = frame.T @ ca.horzcat(x_after, y_after) - rotation(turn)[:, :2]
    return ca.Function("segment", [*points, turn, length], [ca.vertcat(chord, offset * ca.vec(disk))])


def rotation(turn: ca.SX) -> ca.SX:
    """Return the rotation matrix of a rotation vector up to half a turn, by Rodrigues' formula."""
    sine, versine = sine_and_versine(ca.sumsqr(turn))
    axis = ca.skew(turn)
    return ca.SX.eye(3) + sine * axis + versine * axis @ axis


def sine_and_versine(square: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return ``sin t / t`` and ``(1 − cos t) / t²`` of ``square = t²``, smooth at zero, for t up to half a turn."""
    sine = versine = ca.SX(0)
    for k in reversed(range(TERMS)):
        sine = (-1) ** k / math.factorial(2 * k + 1) + square * sine
        versine = (-1) ** k / math.factorial(2 * k + 2) + square * versine
    return sine, versine


def _disk_gaps(robot: SpatialRobot, shape: _Shape, segment: ca.MX) -> ca.MX:
    """Return the gaps between consecutive disks where they are closest [mm].

    The arc at the distance R on the inner side has the chord ``A − B``, less what the disks take up, with
    ``A = l0 sinc(b/2) − t cos(b/2)`` and ``B = 2R sin(b/2)``. As b is not smooth at zero, ``(A² − B²) / 2A`` takes the
    place of ``A − B``: where the disks meet it has the same slope, elsewhere the same sign.
    """
    bending, length = ca.SX.sym("bending", 2), ca.SX.sym("length")
    square = ca.sumsqr(bending)
    sine, versine = sine_and_versine(square / 4)
    apart = length * sine - robot.disk_thickness_mm * (1 - square / 4 * versine)
    across = square * (robot.edge_mm * sine) ** 2
    law = ca.Function("disk_gap", [bending, length], [apart / 2 - across / (2 * apart)])
    return law.map(robot.segments)(shape.turns[:2, :], ca.repmat(segment, 1, robot.segments)).T
