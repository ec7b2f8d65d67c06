"""The mathematics of the robot in space (eq. 13), written once, in CasADi.

A segment turns its upper disk by the rotation Q from the lower one. In the frame halfway between the two, its backbone
is ``l0·s`` with a unit vector s, and the way of a hole h of the disk is ``l0·s + b × h``, where b lies along the axis
of Q and is ``2 sin θ/2`` long. So the two cable lengths of eq. 13 are quadratic in b, and ``2 asin(|b × h| / 2a)`` is
the angle between the disks that the objective counts. The controls of a segment are shear (the first two parts of s)
and twist (the last part of b); the lengths of the cables then give its bending (the first two parts of b).
"""

from typing import TYPE_CHECKING

import casadi as ca

from solver.common.gap_laws import TINY, GapLaw, capsule_gap, circle_gap, gaps_of, half_plane_gap
from solver.common.node_problem import NodeProblem, divided, norms

if TYPE_CHECKING:  # the build runs this file without the package
    from solver.spatial.robot import SpatialRobot

HALVINGS, SERIES_TERMS = (
    2,
    12,
)  # of an angle, and of the power series of its square: to the last digit for a quarter turn


def cylinder_gap(point: ca.SX, shape: ca.SX) -> ca.SX:
    """Gap to a cylinder with rounded edges ``shape = (center, axis, radius and half-length of core, edge radius)``."""
    offset, axis = point - shape[:3], shape[3:6]
    along = ca.dot(offset, axis)
    across = ca.sqrt(ca.sumsqr(offset - along * axis) + TINY)
    return _beyond(ca.vertcat(across - shape[6], ca.fabs(along) - shape[7])) - shape[8]


def box_gap(point: ca.SX, shape: ca.SX) -> ca.SX:
    """Gap to a box with rounded edges ``shape = (center, three axes, half-sizes of its core, edge radius)``."""
    local = ca.reshape(shape[3:12], 3, 3).T @ (point - shape[:3])
    return _beyond(ca.fabs(local) - shape[12:15]) - shape[15]


def _beyond(excess: ca.SX) -> ca.SX:
    """Distance of a point from a core that it is beyond by these lengths, across its faces."""
    outside = ca.sqrt(ca.sumsqr(ca.fmax(excess, 0)) + TINY)
    return ca.if_else(ca.mmax(excess) > 0, outside, ca.mmax(excess))


SPHERE = GapLaw("sphere", circle_gap, 4, (3,), 3)
HALF_SPACE = GapLaw("half_space", half_plane_gap, 4, (3,), 3)
CAPSULE = GapLaw("spatial_capsule", capsule_gap, 7, (6,), 3)
CYLINDER = GapLaw("cylinder", cylinder_gap, 9, (8,), 3)
BOX = GapLaw("box", box_gap, 16, (15,), 3)
GAP_LAWS = (SPHERE, HALF_SPACE, CAPSULE, CYLINDER, BOX)


def square_angle(square: ca.SX, halvings: int = HALVINGS) -> tuple[ca.SX, ca.SX, ca.SX]:
    """``θ² = (2 asin √q)²`` in the square q of the half sine of an angle up to π/2, and its first two derivatives.

    By the power series of a quarter of the angle; halving it turns q into ``(1 − √(1 − q)) / 2``.
    """
    if halvings == 0:
        coefficient, coefficients = 4.0, []
        for k in range(1, SERIES_TERMS + 1):
            coefficients.append((k, coefficient))
            coefficient *= 2 * k * k / ((k + 1) * (2 * k + 1))
        value = slope = bend = ca.SX(0)
        for k, c in reversed(coefficients):
            value, slope = c + square * value, k * c + square * slope
            bend = k * (k - 1) * c + square * bend if k > 1 else bend
        return square * value, slope, bend
    cosine = ca.sqrt(1 - square)
    value, slope, bend = square_angle(square / (2 * (1 + cosine)), halvings - 1)
    return 4 * value, slope / cosine, (bend / 4 + slope / (2 * cosine)) / (1 - square)


class _Segment:
    """A segment in its controls, its bending, and what it is told."""

    def __init__(self) -> None:
        self.control, self.bending = ca.SX.sym("control", 3), ca.SX.sym("bending", 2)
        self.pulls, self.length, self.holes = ca.SX.sym("pulls", 2), ca.SX.sym("length"), ca.SX.sym("holes", 2, 2)
        self.told = [self.control, self.bending, self.pulls, self.length, self.holes]
        shear, twist = self.control[:2], self.control[2]
        self.axis = ca.vertcat(self.bending, twist)
        self.along = ca.vertcat(shear, ca.sqrt(1 - ca.sumsqr(shear)))
        self.ways = [ca.cross(self.axis, ca.vertcat(self.holes[:, k], 0)) for k in range(2)]
        self.cosine = ca.sqrt(1 - ca.sumsqr(self.axis) / 4)  # of half the angle

    @property
    def closure(self) -> ca.SX:
        """Squares of the cable lengths less their values, over twice the backbone: zero at its shape, ``(2,)`` [mm]."""
        per_length = 1 / (2 * self.length)
        squares = [ca.dot(self.along, way) + ca.sumsqr(way) * per_length for way in self.ways]
        return ca.vertcat(*squares) + self.pulls * (1 - self.pulls * per_length)

    @property
    def squares(self) -> ca.SX:
        """Squares of the half sines of the angles between the disks, towards both holes, ``(2,)``."""
        return ca.vertcat(*(ca.sumsqr(way) for way in self.ways)) / (4 * ca.sumsqr(self.holes[:, 0]))

    @property
    def chord(self) -> ca.SX:
        """Backbone in the frame of the lower disk, ``(3,)`` [mm]."""
        half = ca.sqrt((1 + self.cosine) / 2)
        return self.length * _turned(half, self.axis / (4 * half), self.along)

    @property
    def rotation(self) -> ca.SX:
        """From the upper disk's frame to the lower one's, ``(3, 3)``."""
        return ca.horzcat(*(_turned(self.cosine, self.axis / 2, ca.SX.eye(3)[:, k]) for k in range(3)))

    @property
    def turning(self) -> ca.SX:
        """Turn of the upper disk in the frame of the lower one, per change of ``axis``, ``(3, 3)``."""
        stretched = self.cosine * ca.SX.eye(3) + self.axis @ self.axis.T / (4 * self.cosine)
        return stretched + ca.skew(self.axis) / 2


def _turned(cosine: ca.SX, sine: ca.SX, vector: ca.SX) -> ca.SX:
    """A vector turned by a unit quaternion."""
    across = 2 * ca.cross(sine, vector)
    return vector + cosine * across + ca.cross(sine, across)


def closure_function() -> ca.Function:
    """``(control, bending, pulls, l0, holes) → closure, its slope in the bending, row by row``."""
    segment = _Segment()
    slope = ca.jacobian(segment.closure, segment.bending)
    law = ca.vertcat(segment.closure, ca.vec(slope.T))
    return ca.Function("ccr_closure", segment.told, [ca.cse(ca.densify(law))])


def bend_function() -> ca.Function:
    """``(control, bending, pulls, l0, holes) → chord, rotation, objective`` and their slopes, matrices row by row.

    The slopes are those of the objective, of the chord and of the turn of the upper disk, all in the frame of the lower
    one: first in the control, then in the pulls, with the bending that the closure gives.
    """
    segment = _Segment()
    bending, inverse = segment.bending, _inverse(ca.jacobian(segment.closure, segment.bending))
    values, rates, _ = (
        ca.vertcat(*parts) for parts in zip(*(square_angle(q) for q in ca.vertsplit(segment.squares)), strict=True)
    )
    outputs = [segment.chord, ca.vec(segment.rotation.T), ca.sum1(values)]
    for inputs in (segment.control, segment.pulls):
        bent = -inverse @ ca.jacobian(segment.closure, inputs)
        squares, chord, axis = (
            ca.jacobian(what, inputs) + ca.jacobian(what, bending) @ bent
            for what in (segment.squares, segment.chord, segment.axis)
        )
        outputs += [ca.vec(slope.T) for slope in (rates.T @ squares, chord, segment.turning @ axis)]
    return ca.Function("ccr_bend", segment.told, [ca.cse(ca.densify(ca.vertcat(*outputs)))])


def hessian_contraction_function() -> ca.Function:
    """``(control, bending, pulls, l0, holes, force, moment) → Hessian in the control, row by row``, ``(9,)``.

    Of the objective and the work of a force on the chord and a moment on the turn of the upper disk, in the frame of
    the lower one, with the bending that the closure gives.
    """
    segment, force, moment = _Segment(), ca.SX.sym("force", 3), ca.SX.sym("moment", 3)
    control, bending = segment.control, segment.bending
    both = ca.vertcat(control, bending)
    squares, held, rated = segment.squares, ca.SX.sym("lengths", 2), ca.SX.sym("rates", 2)
    _, rates, bends = (
        ca.vertcat(*parts) for parts in zip(*(square_angle(q) for q in ca.vertsplit(squares)), strict=True)
    )
    work = ca.dot(rated, squares) + ca.dot(force, segment.chord)
    axis = ca.jacobian(segment.axis, both)
    moments = axis.T @ segment.turning.T @ moment  # slope of the work of the moment
    inverse = _inverse(ca.jacobian(segment.closure, bending))
    lengths = inverse.T @ (ca.gradient(work, bending) + moments[3:])
    hessian, _ = ca.hessian(work - ca.dot(held, segment.closure), both)
    hessian = ca.substitute(hessian, held, lengths)
    hessian = ca.substitute(hessian, rated, rates)
    turned, steep = ca.jacobian(moments, both), ca.jacobian(squares, both)
    hessian += (turned + turned.T) / 2 + steep.T @ ca.diag(bends) @ steep
    along = ca.vertcat(ca.SX.eye(3), -inverse @ ca.jacobian(segment.closure, control))
    law = ca.vec(along.T @ hessian @ along)
    return ca.Function("ccr_hessian_contraction", [*segment.told, force, moment], [ca.cse(ca.densify(law))])


def _inverse(matrix: ca.SX) -> ca.SX:
    (a, b), (c, d) = ca.vertsplit(matrix[0, :].T), ca.vertsplit(matrix[1, :].T)
    return ca.vertcat(ca.horzcat(d, -b), ca.horzcat(-c, a)) / (a * d - b * c)


def spatial_problem(
    robot: "SpatialRobot", laws: tuple[GapLaw, ...], mounted: tuple[bool, ...], change: ca.MX | None = None
) -> NodeProblem:
    """Build eq. 13 for a robot and obstacles of given kinds.

    The first cable lies on the side of the first hole where its displacement is positive, else opposite; so does the
    second. What stands for a hole below is the one that is pulled.

    Args:
        robot: The robot.
        laws: Gap laws of the obstacles.
        mounted: Which obstacles are on springs.
        change: Of both displacements and the length, then of each obstacle its motion (shift, turns about the axes
            through the origin, growth), ``(3 + 7m,)`` [mm, rad]; ``None`` for none.

    Returns:
        ``unknowns``: backbone points, first and second holes of nodes 1…n, then the displacements of the obstacles on
        springs, each as x, y, z triples, ``(9n + 3s,)`` [mm]. ``parameters``: ``(l1, l2, L0, EI)``, the shapes of the
        obstacles, one after the other, and the six upper entries of the stiffness of those on springs. ``objective``:
        sum of squared angles between consecutive disks, towards both holes, and the energy of the springs over
        ``B = EI / 2 l0`` [rad²]. ``equalities``: zero when lengths of backbone, cables and disks, and the angle between
        the holes, are as given, ``(6n,)`` [mm]. ``inequalities``: gap of every point that can touch, but for node 0, to
        every obstacle, ordered (obstacle, line, position) [mm].
    """
    n, a = robot.segments, robot.offset_mm
    unknowns = ca.MX.sym("unknowns", 9 * n + 3 * sum(mounted))
    sizes = [law.size for law in laws]
    parameters = ca.MX.sym("parameters", 4 + sum(sizes) + 6 * sum(mounted))
    shapes = ca.vertsplit(parameters[4 : 4 + sum(sizes)], [0, *(sum(sizes[: j + 1]) for j in range(len(sizes)))])
    springs = ca.reshape(parameters[4 + sum(sizes) :], 6, -1)
    commands = parameters[:3] if change is None else parameters[:3] + change[:3]
    total = commands[2]
    sides = [ca.if_else(parameters[k] < 0, -1.0, 1.0) for k in range(2)]
    bases = [ca.MX.zeros(3), *(side * ca.DM(hole) for side, hole in zip(sides, robot.holes, strict=True))]
    lines = [ca.horzcat(base, ca.reshape(unknowns[3 * n * k : 3 * n * (k + 1)], 3, n)) for k, base in enumerate(bases)]
    disks = [line - lines[0] for line in lines[1:]]
    shares = [total / n, *((total - side * commands[k]) / n for k, side in enumerate(sides))]
    equalities = [norms(line[:, 1:] - line[:, :-1]) - share for line, share in zip(lines, shares, strict=True)]
    equalities += [norms(disk[:, 1:]) - a for disk in disks]
    between = sides[0] * sides[1] * ca.cos(robot.angle)
    equalities.append(ca.sum1(disks[0][:, 1:] * disks[1][:, 1:]) / a - a * between)
    energy = ca.sum2(_square_angles(disks[0], a)) + ca.sum2(_square_angles(disks[1], a))
    holes = [side * disk for side, disk in zip(sides, disks, strict=True)]
    displacements = ca.reshape(unknowns[9 * n :], 3, -1)
    gaps = []
    for j, law in enumerate(laws):
        shape, shift, turn = shapes[j], ca.MX.zeros(3), ca.MX.eye(3)
        if change is not None:
            moved = change[3 + 7 * j : 10 + 7 * j]
            shift, turn = moved[:3], ca.MX.eye(3) + ca.skew(moved[3:6]) + ca.skew(moved[3:6]) @ ca.skew(moved[3:6]) / 2
            shape = shape + moved[6] * ca.DM([k in law.growth for k in range(law.size)])
        if mounted[j]:
            mount = sum(mounted[:j])
            push, (xx, xy, xz, yy, yz, zz) = displacements[:, mount], ca.vertsplit(springs[:, mount])
            spring = ca.vertcat(ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz))
            energy += ca.dot(push, spring @ push) / (parameters[3] * n / total)
            shift = shift + push
        for along_first, along_second in robot.line_weights:
            line = lines[0] + along_first * holes[0] + along_second * holes[1]
            points = divided(line, robot.between)[:, 1:]
            gaps.append(gaps_of(law, turn.T @ (points - ca.repmat(shift, 1, points.shape[1])), shape))
    return NodeProblem(
        unknowns, parameters, energy, ca.horzcat(*equalities).T, ca.vertcat(*gaps) if gaps else ca.MX(0, 1)
    )


def _square_angles(disk: ca.MX, offset: float) -> ca.MX:
    """Squared angles between consecutive columns of equal length, ``(1, n)``, smooth where they vanish."""
    square = ca.SX.sym("square")
    law = ca.Function("square_angle", [square], [square_angle(square)[0]])
    return law(ca.sum1((disk[:, 1:] - disk[:, :-1]) ** 2) / (4 * offset**2))
