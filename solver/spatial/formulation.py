"""Mathematics of the robot in space (eq. 13), stated once, in CasADi.

A segment rotates its upper disk by Q from the lower one. In the frame halfway between the two, its backbone is ``l0·s``
with a unit vector s, and a hole h of the disk is displaced by ``l0·s + b × h``, where b lies along the axis of Q and is
``2 sin θ/2`` long. So the two cable lengths of eq. 13 are quadratic in b, and ``2 asin(|b × h| / 2a)`` is the angle
between the disks in the objective. The controls of a segment are shear (the first two components of s) and twist (the
last component of b); the cable lengths then determine its bending (the first two components of b).
"""

from functools import lru_cache
from typing import NamedTuple

import casadi as ca

from solver.common.gap_laws import TINY, GapLaw, capsule_gap, circle_gap, half_plane_gap
from solver.common.node_problem import NodeProblem, first_derivatives, norms, second_derivatives
from solver.common.signals import held_signals
from solver.spatial.obstacle_terms import MOTIONS, ObstacleSymbols, obstacle_terms, parameter_count
from solver.spatial.robot import SpatialRobot
from solver.spatial.rod_formulation import rod_node_problem

# Halvings of an angle, and terms of the power series of its square: exact to the last digit for a quarter turn.
HALVINGS, SERIES_TERMS = 2, 12


def cylinder_gap(point: ca.SX, shape: ca.SX) -> ca.SX:
    """Return the gap to a rounded cylinder ``shape = (center, axis, radius and half-length of core, edge radius)``."""
    offset, axis = point - shape[:3], shape[3:6]
    along = ca.dot(offset, axis)
    across = ca.sqrt(ca.sumsqr(offset - along * axis) + TINY)
    return _beyond(ca.vertcat(across - shape[6], ca.fabs(along) - shape[7])) - shape[8]


def box_gap(point: ca.SX, shape: ca.SX) -> ca.SX:
    """Return the gap to a rounded box ``shape = (center, three axes, half-sizes of its core, edge radius)``."""
    local = ca.reshape(shape[3:12], 3, 3).T @ (point - shape[:3])
    return _beyond(ca.fabs(local) - shape[12:15]) - shape[15]


def _beyond(excess: ca.SX) -> ca.SX:
    """Return the distance of a point from a core, of which it is outside by ``excess`` across each face."""
    outside = ca.sqrt(ca.sumsqr(ca.fmax(excess, 0)) + TINY)
    return ca.if_else(ca.mmax(excess) > 0, outside, ca.mmax(excess))


SPHERE = GapLaw("sphere", circle_gap, 4, (3,), 3)
HALF_SPACE = GapLaw("half_space", half_plane_gap, 4, (3,), 3)
CAPSULE = GapLaw("spatial_capsule", capsule_gap, 7, (6,), 3)
CYLINDER = GapLaw("cylinder", cylinder_gap, 9, (8,), 3)
BOX = GapLaw("box", box_gap, 16, (15,), 3)
GAP_LAWS = (SPHERE, HALF_SPACE, CAPSULE, CYLINDER, BOX)


def square_angle(square: ca.SX, halvings: int = HALVINGS) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return ``θ² = (2 asin √q)²`` of the squared half sine q of an angle up to π/2, and its first two derivatives.

    It is the power series of a quarter of the angle; halving the angle turns q into ``(1 − √(1 − q)) / 2``.
    """
    if halvings == 0:
        coefficient, coefficients = 4.0, []
        for k in range(1, SERIES_TERMS + 1):
            coefficients.append((k, coefficient))
            coefficient *= 2 * k * k / ((k + 1) * (2 * k + 1))
        value = slope = curvature = ca.SX(0)
        for k, c in reversed(coefficients):
            value, slope = c + square * value, k * c + square * slope
            curvature = k * (k - 1) * c + square * curvature if k > 1 else curvature
        return square * value, slope, curvature
    cosine = ca.sqrt(1 - square)
    value, slope, curvature = square_angle(square / (2 * (1 + cosine)), halvings - 1)
    return 4 * value, slope / cosine, (curvature / 4 + slope / (2 * cosine)) / (1 - square)


class _Segment:
    """Symbols of a segment: controls, bending, cable displacements, length and holes, and what follows from them."""

    def __init__(self) -> None:
        self.control, self.bending = ca.SX.sym("control", 3), ca.SX.sym("bending", 2)
        self.pulls, self.length, self.holes = ca.SX.sym("pulls", 2), ca.SX.sym("length"), ca.SX.sym("holes", 2, 2)
        self.inputs = [self.control, self.bending, self.pulls, self.length, self.holes]
        shear, twist = self.control[:2], self.control[2]
        self.axis = ca.vertcat(self.bending, twist)
        self.along = ca.vertcat(shear, ca.sqrt(1 - ca.sumsqr(shear)))
        self.ways = [ca.cross(self.axis, ca.vertcat(self.holes[:, k], 0)) for k in range(2)]
        self.cosine = ca.sqrt(1 - ca.sumsqr(self.axis) / 4)  # of half the angle

    @property
    def closure(self) -> ca.SX:
        """Squared cable lengths minus their values, over twice the backbone: zero at its shape, ``(2,)`` [mm]."""
        per_length = 1 / (2 * self.length)
        squares = [ca.dot(self.along, way) + ca.sumsqr(way) * per_length for way in self.ways]
        return ca.vertcat(*squares) + self.pulls * (1 - self.pulls * per_length)

    @property
    def squares(self) -> ca.SX:
        """Squared half sines of the angles between the disks, towards both holes, ``(2,)``."""
        return ca.vertcat(*(ca.sumsqr(way) for way in self.ways)) / (4 * ca.sumsqr(self.holes[:, 0]))

    @property
    def chord(self) -> ca.SX:
        """Backbone in the frame of the lower disk, ``(3,)`` [mm]."""
        half = ca.sqrt((1 + self.cosine) / 2)
        return self.length * _rotate(half, self.axis / (4 * half), self.along)

    @property
    def rotation(self) -> ca.SX:
        """Rotation from the upper disk's frame to the lower one's, ``(3, 3)``."""
        return ca.horzcat(*(_rotate(self.cosine, self.axis / 2, ca.SX.eye(3)[:, k]) for k in range(3)))

    @property
    def turning(self) -> ca.SX:
        """Rotation of the upper disk in the frame of the lower one, per change of ``axis``, ``(3, 3)``."""
        stretched = self.cosine * ca.SX.eye(3) + self.axis @ self.axis.T / (4 * self.cosine)
        return stretched + ca.skew(self.axis) / 2


def _rotate(cosine: ca.SX, sine: ca.SX, vector: ca.SX) -> ca.SX:
    """Return a vector rotated by a unit quaternion."""
    across = 2 * ca.cross(sine, vector)
    return vector + cosine * across + ca.cross(sine, across)


def closure_function() -> ca.Function:
    """Return ``(control, bending, pulls, l0, holes) → closure, its slope in the bending, row by row``."""
    segment = _Segment()
    slope = ca.jacobian(segment.closure, segment.bending)
    law = ca.vertcat(segment.closure, ca.vec(slope.T))
    return ca.Function("ccr_closure", segment.inputs, [ca.cse(ca.densify(law))])


def bend_function() -> ca.Function:
    """Return ``(control, bending, pulls, l0, holes) → chord, rotation, objective`` and their slopes, row by row.

    The slopes are those of the objective, of the chord and of the rotation of the upper disk, all in the frame of the
    lower one: first in the control, then in the pulls, with the bending that the closure determines.
    """
    segment = _Segment()
    bending, inverse = segment.bending, _inverse(ca.jacobian(segment.closure, segment.bending))
    values, rates, _ = (
        ca.vertcat(*parts) for parts in zip(*(square_angle(q) for q in ca.vertsplit(segment.squares)), strict=True)
    )
    outputs = [segment.chord, ca.vec(segment.rotation.T), ca.sum1(values)]
    for inputs in (segment.control, segment.pulls):
        bending_slope = -inverse @ ca.jacobian(segment.closure, inputs)
        squares, chord, axis = (
            ca.jacobian(value, inputs) + ca.jacobian(value, bending) @ bending_slope
            for value in (segment.squares, segment.chord, segment.axis)
        )
        outputs += [ca.vec(slope.T) for slope in (rates.T @ squares, chord, segment.turning @ axis)]
    return ca.Function("ccr_bend", segment.inputs, [ca.cse(ca.densify(ca.vertcat(*outputs)))])


def hessian_contraction_function() -> ca.Function:
    """Return ``(control, bending, pulls, l0, holes, force, moment) → Hessian in the control, row by row``, ``(9,)``.

    It is the Hessian of the objective, the work of a force on the chord and of a moment on the rotation of the upper
    disk, in the frame of the lower one, with the bending that the closure determines.
    """
    segment, force, moment = _Segment(), ca.SX.sym("force", 3), ca.SX.sym("moment", 3)
    hessian, _, inverse = _contraction(segment, force, moment, ca.vertcat(segment.control, segment.bending))
    along = ca.vertcat(ca.SX.eye(3), -inverse @ ca.jacobian(segment.closure, segment.control))
    law = ca.vec(along.T @ hessian @ along)
    return ca.Function("ccr_hessian_contraction", [*segment.inputs, force, moment], [ca.cse(ca.densify(law))])


def input_contraction_function() -> ca.Function:
    """Return ``(control, bending, pulls, l0, holes, force, moment) → slopes of the law in its inputs``, ``(21,)``.

    The inputs are both pulls and l0. First the slopes in l0 of the chord and of the rotation of the upper disk, as
    those of :func:`bend_function`; then the second derivatives of what :func:`hessian_contraction_function` contracts,
    of control (rows) and inputs (columns), row by row, and the lower triangle of those in the inputs alone.
    """
    segment, force, moment = _Segment(), ca.SX.sym("force", 3), ca.SX.sym("moment", 3)
    control, inputs = segment.control, ca.vertcat(segment.pulls, segment.length)
    everything = ca.vertcat(control, segment.bending, inputs)
    hessian, axis, inverse = _contraction(segment, force, moment, everything)
    bent, bent_by_inputs = (-inverse @ ca.jacobian(segment.closure, of) for of in (control, inputs))
    along_control = ca.vertcat(ca.SX.eye(3), bent, ca.SX.zeros(3, 3))
    along_inputs = ca.vertcat(ca.SX.zeros(3, 3), bent_by_inputs, ca.SX.eye(3))
    by_length = along_inputs[:, 2]
    own = along_inputs.T @ hessian @ along_inputs
    law = ca.vertcat(
        ca.jacobian(segment.chord, everything) @ by_length,
        segment.turning @ axis @ by_length,
        ca.vec((along_control.T @ hessian @ along_inputs).T),
        *(own[row, column] for row in range(3) for column in range(row + 1)),
    )
    return ca.Function("ccr_input_contraction", [*segment.inputs, force, moment], [ca.cse(ca.densify(law))])


def _contraction(segment: _Segment, force: ca.SX, moment: ca.SX, of: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return the Hessian of :func:`hessian_contraction_function` before the closure determines the bending.

    Args:
        segment: The segment.
        force: Force on its chord, ``(3,)``.
        moment: Moment on the rotation of its upper disk, ``(3,)``.
        of: In what it is: the control, the bending, and what may follow, ``(v,)``.

    Returns:
        The Hessian, ``(v, v)``, the slopes of the rotation vector, ``(3, v)``, and the inverse of those of the closure
        in the bending, ``(2, 2)``.
    """
    squares, multipliers, weights = segment.squares, ca.SX.sym("lengths", 2), ca.SX.sym("rates", 2)
    _, rates, curvatures = (
        ca.vertcat(*parts) for parts in zip(*(square_angle(q) for q in ca.vertsplit(squares)), strict=True)
    )
    work = ca.dot(weights, squares) + ca.dot(force, segment.chord)
    axis = ca.jacobian(segment.axis, of)
    moments = axis.T @ segment.turning.T @ moment  # slope of the work of the moment
    inverse = _inverse(ca.jacobian(segment.closure, segment.bending))
    lengths = inverse.T @ (ca.gradient(work, segment.bending) + moments[3:5])
    hessian, _ = ca.hessian(work - ca.dot(multipliers, segment.closure), of)
    hessian = ca.substitute(hessian, multipliers, lengths)
    hessian = ca.substitute(hessian, weights, rates)
    moment_slope, square_slope = ca.jacobian(moments, of), ca.jacobian(squares, of)
    hessian += (moment_slope + moment_slope.T) / 2 + square_slope.T @ ca.diag(curvatures) @ square_slope
    return hessian, axis, inverse


def _inverse(matrix: ca.SX) -> ca.SX:
    """Return the inverse of a 2 × 2 matrix."""
    (a, b), (c, d) = ca.vertsplit(matrix[0, :].T), ca.vertsplit(matrix[1, :].T)
    return ca.vertcat(ca.horzcat(d, -b), ca.horzcat(-c, a)) / (a * d - b * c)


def node_problem(
    robot: SpatialRobot, laws: tuple[GapLaw, ...], mounted: tuple[bool, ...], change: ca.MX | None = None
) -> NodeProblem:
    """Build eq. 13 for a robot and obstacles of given kinds; for a rod :func:`.rod_formulation.rod_node_problem`.

    The first cable lies on the side of the first hole where its displacement is positive, else opposite; so does the
    second. A hole below is always that of the cable that is pulled.

    Args:
        robot: The robot.
        laws: Gap laws of the obstacles.
        mounted: Which obstacles are on springs.
        change: Change of both displacements and the length, then of each obstacle its motion (shift, turns about the
            axes through the origin, growth), ``(3 + 7m,)`` [mm, rad]; ``None`` for none.

    Returns:
        The problem. ``unknowns``: backbone points, first and second holes of nodes 1…n, then the displacements of the
        obstacles on springs, each as x, y, z triples, ``(9n + 3s,)`` [mm]. ``parameters``: ``(l1, l2, L0, EI)``, the
        shapes of the obstacles, one after the other, and the six upper entries of the stiffness of those on springs.
        ``objective``: sum of squared angles between consecutive disks, towards both holes, and the energy of the
        springs over ``B = EI / 2 l0`` [rad²]. ``equalities``: zero when lengths of backbone, cables and disks, and the
        angle between the holes, are as given, ``(6n,)`` [mm]. ``inequalities``: gaps to obstacles [mm].
    """
    if robot.model == "rod":
        return rod_node_problem(robot, laws, mounted, change)
    n = robot.segments
    unknowns = ca.MX.sym("unknowns", 9 * n + 3 * sum(mounted))
    parameters = ca.MX.sym("parameters", 4 + parameter_count(laws, mounted))
    commands = parameters[:3] if change is None else parameters[:3] + change[:3]
    signs = [ca.if_else(parameters[k] < 0, -1.0, 1.0) for k in range(2)]
    pose = _pose(robot, unknowns, signs)
    moved = None if change is None else change[3:]
    symbols = ObstacleSymbols(laws, mounted, unknowns[9 * n :], parameters[4:], moved)
    energy_scale = parameters[3] * n / (2 * commands[2])
    energy, gaps = obstacle_terms(symbols, pose.touching_lines(robot), robot.between, energy_scale)
    for disk in pose.disks:
        energy += ca.sum2(_square_angles(disk, robot.offset_mm))
    return NodeProblem(unknowns, parameters, energy, _equalities(robot, pose, signs, commands), ca.MX(0, 1), gaps)


class _Pose(NamedTuple):
    """Backbone and holes at nodes 0…n, the disks between them, and where the holes of the first cables are."""

    lines: list[ca.MX]
    disks: list[ca.MX]
    holes: list[ca.MX]

    def touching_lines(self, robot: SpatialRobot) -> list[ca.MX]:
        """Return the lines of points that can touch."""
        weights = robot.line_weights
        return [self.lines[0] + first * self.holes[0] + second * self.holes[1] for first, second in weights]


def _pose(robot: SpatialRobot, unknowns: ca.MX, signs: list[ca.MX]) -> _Pose:
    n = robot.segments
    bases = [ca.MX.zeros(3), *(sign * ca.DM(hole) for sign, hole in zip(signs, robot.holes, strict=True))]
    lines = [ca.horzcat(base, ca.reshape(unknowns[3 * n * k : 3 * n * (k + 1)], 3, n)) for k, base in enumerate(bases)]
    disks = [line - lines[0] for line in lines[1:]]
    return _Pose(lines, disks, [sign * disk for sign, disk in zip(signs, disks, strict=True)])


def _equalities(robot: SpatialRobot, pose: _Pose, signs: list[ca.MX], commands: ca.MX) -> ca.MX:
    """Return lengths of backbone, cables and disks, and the product of the holes, minus their values, ``(6n,)``."""
    n, a, total = robot.segments, robot.offset_mm, commands[2]
    shares = [total / n, *((total - sign * commands[k]) / n for k, sign in enumerate(signs))]
    equalities = [norms(line[:, 1:] - line[:, :-1]) - share for line, share in zip(pose.lines, shares, strict=True)]
    equalities += [norms(disk[:, 1:]) - a for disk in pose.disks]
    between = signs[0] * signs[1] * ca.cos(robot.angle)
    equalities.append(ca.sum1(pose.disks[0][:, 1:] * pose.disks[1][:, 1:]) / a - a * between)
    return ca.horzcat(*equalities).T


def _square_angles(disk: ca.MX, offset: float) -> ca.MX:
    """Return squared angles between consecutive columns of equal length, ``(1, n)``, smooth where they vanish."""
    square = ca.SX.sym("square")
    law = ca.Function("square_angle", [square], [square_angle(square)[0]])
    return law(ca.sum1((disk[:, 1:] - disk[:, :-1]) ** 2) / (4 * offset**2))


@lru_cache(maxsize=32)
@held_signals()
def node_derivatives(robot: SpatialRobot, laws: tuple[GapLaw, ...], mounted: tuple[bool, ...]) -> ca.Function:
    """Return the :func:`~solver.common.node_problem.first_derivatives` of :func:`node_problem`."""
    return first_derivatives(node_problem(robot, laws, mounted))


@lru_cache(maxsize=32)
@held_signals()
def kkt_derivatives(robot: SpatialRobot, laws: tuple[GapLaw, ...], mounted: tuple[bool, ...]) -> ca.Function:
    """Return the :func:`~solver.common.node_problem.second_derivatives` of :func:`node_problem`."""
    change = ca.MX.sym("change", len(robot.cables) + 1 + MOTIONS * len(laws))
    return second_derivatives(node_problem(robot, laws, mounted, change), change)
