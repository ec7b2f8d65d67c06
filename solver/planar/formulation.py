"""The mathematics of the planar model, written once, in CasADi.

Three layers, all in millimetre and radian:

- *segment laws*: the shape of a segment in one reduced coordinate, which eliminates the length equalities of eq. 4:
  for the uniform cable σ = sin ψ, the sine of the shear angle, for the sliding cable the angle θ between its disks;
- *gap laws*: signed clearance of a point from an obstacle, scaled so that its gradient has unit length on the
  surface and a multiplier has units rad²/mm;
- *node-coordinate problem*: eq. 4/5 of the paper as they stand, for the reference solver and for the certificate.

The first two are turned into C when the package is built (:mod:`solver.codegen`), with their derivatives.
"""

import itertools
from functools import lru_cache
from typing import TYPE_CHECKING

import casadi as ca

from solver.common.gap_laws import (
    TINY,
    GapLaw,
    Symbol,
    _square_distance,
    capsule_gap,
    circle_gap,
    gaps_of,
    half_plane_gap,
    sinc_and_cosine,
)
from solver.common.node_problem import NodeProblem, divided, first_derivatives, norms, second_derivatives

if TYPE_CHECKING:  # the build runs this file alone
    from solver.planar.robot import Robot


def segment_half_sine(sine: ca.SX, pull: ca.SX, length: ca.SX, offset: ca.SX) -> ca.SX:
    """``u = sin θ/2`` of a segment whose cable is ``pull`` shorter than its backbone; θ is the angle between its disks.

    The chord ``2a·u`` between the free ends of the disks is ``l0 cos ψ − sqrt(la² − l0² sin² ψ)`` with
    ``la = l0 − pull``; it is written as a quotient so that no digits are lost for a small pull.
    """
    cable = length - pull
    reach = length * ca.sqrt(1 - sine**2) + ca.sqrt(cable**2 - (length * sine) ** 2)
    return pull * (length + cable) / (reach * 2 * offset)


def segment_closure(half_sine: ca.SX, sine: ca.SX, pull: ca.SX, length: ca.SX, offset: ca.SX) -> ca.SX:
    """Cable length of a segment squared, minus its value: zero at :func:`segment_half_sine` [mm²]."""
    chord = 2 * offset * half_sine
    return chord * (chord - 2 * length * ca.sqrt(1 - sine**2)) + pull * (2 * length - pull)


def ellipse_gap(point: ca.SX, shape: ca.SX) -> ca.SX:
    """Gap to an ellipse ``shape = (x, y, a, b, ux, uy)`` with half-axis a along the unit vector u.

    ``F / |∇F|`` of the implicit form ``F = (p·u / a)² + (p·v / b)² − 1``, both halved.
    """
    local = point - shape[:2]
    along = (local[0] * shape[4] + local[1] * shape[5]) / shape[2]
    across = (local[1] * shape[4] - local[0] * shape[5]) / shape[3]
    steepness = ca.sqrt((along / shape[2]) ** 2 + (across / shape[3]) ** 2)
    return (along**2 + across**2 - 1) / (2 * steepness)


def polygon_gap(point: ca.SX, shape: ca.SX) -> ca.SX:
    """Gap to a convex polygon with rounded corners ``shape = (r, x1, y1, …)``, its core's corners counter-clockwise.

    The distance to the core less the corner radius: that of a half-plane beside an edge, of a point beyond a corner.
    Corners may be repeated to fill the shape up.
    """
    corners = ca.reshape(shape[1:], 2, -1)
    count = corners.shape[1]
    edge, closest = ca.horzcat(corners[:, 0], corners[:, 1]), _square_distance(point, corners[:, 0], corners[:, 1])
    for i in range(1, count):
        start, end = corners[:, i], corners[:, (i + 1) % count]
        distance = _square_distance(point, start, end)
        edge = ca.if_else(distance < closest, ca.horzcat(start, end), edge)
        closest = ca.fmin(distance, closest)
    start, along = edge[:, 0], edge[:, 1] - edge[:, 0]
    size = ca.sumsqr(along)
    fraction = ca.dot(point - start, along) / ca.fmax(size, TINY)
    beside = (along[1] * (point[0] - start[0]) - along[0] * (point[1] - start[1])) / ca.sqrt(ca.fmax(size, TINY))
    corner = start + ca.if_else(fraction > 0.5, 1, 0) * along
    beyond = ca.sqrt(ca.sumsqr(point - corner) + TINY)
    return ca.if_else(ca.logic_and(fraction > 0, fraction < 1), beside, beyond) - shape[0]


POLYGON_CORNERS = 8
CIRCLE = GapLaw("circle", circle_gap, 3, (2,))
HALF_PLANE = GapLaw("half_plane", half_plane_gap, 3, (2,))
ELLIPSE = GapLaw("ellipse", ellipse_gap, 6, (2, 3))
CAPSULE = GapLaw("capsule", capsule_gap, 5, (4,))
POLYGON = GapLaw("polygon", polygon_gap, 1 + 2 * POLYGON_CORNERS, (0,))
GAP_LAWS = (CIRCLE, HALF_PLANE, ELLIPSE, CAPSULE, POLYGON)


def segment_function() -> ca.Function:
    """``(σ, pull, l0, a) → θ, θ_σ, θ_σσ, θ_pull, cos ζ, sin ζ, ζ_σ, ζ_σσ, cos θ, sin θ``.

    ``ζ = ψ − θ/2`` is the direction of the backbone segment in the frame of its lower disk, from that frame's y axis.
    The derivatives of θ follow from the closure by the implicit function theorem, which costs one division in all.
    """
    sine, pull, length, offset, u = (ca.SX.sym(name) for name in ("sine", "pull", "length", "offset", "half_sine"))
    closure = segment_closure(u, sine, pull, length, offset)
    in_u, in_sine, in_pull = (ca.gradient(closure, variable) for variable in (u, sine, pull))
    cosine, half_cosine = ca.sqrt(1 - sine**2), ca.sqrt(1 - u**2)
    cosines = cosine * half_cosine
    per_all = 1 / (in_u * cosines)  # one division serves for three
    per_closure, per_cosine, per_half_cosine = -per_all * cosines, per_all * in_u * half_cosine, per_all * in_u * cosine
    u_sine = in_sine * per_closure
    u_pull = in_pull * per_closure
    bent = ca.gradient(in_sine, sine) + 2 * ca.gradient(in_sine, u) * u_sine + ca.gradient(in_u, u) * u_sine**2
    slope = 2 * per_half_cosine * u_sine
    curvature = 2 * per_half_cosine * (bent * per_closure + u * (per_half_cosine * u_sine) ** 2)
    law = ca.vertcat(
        2 * ca.asin(u),
        slope,
        curvature,
        2 * per_half_cosine * u_pull,
        cosine * half_cosine + sine * u,
        sine * half_cosine - cosine * u,
        per_cosine - slope / 2,
        sine * per_cosine**3 - curvature / 2,
        1 - 2 * u**2,
        2 * u * half_cosine,
    )
    law = ca.cse(ca.substitute(law, u, segment_half_sine(sine, pull, length, offset)))
    return ca.Function("ccr_segment", [sine, pull, length, offset], [law])


def arc_function() -> ca.Function:
    """``(θ, l0, a) → θ, f, g, c'/c, c''/c, cos θ, sin θ, s, s', s''`` of a segment that is an arc, for a sliding cable.

    The chord ``c = l0 sinc θ/2`` along the bisector has the components ``l0·(f, g)`` in the frame of the lower disk,
    ahead and to its left; ``s = l0 − c + 2a sin θ/2`` is what the segment takes from the cable (Rao 2024).
    """
    angle, length, offset = (ca.SX.sym(name) for name in ("angle", "length", "offset"))
    sinc, cosine = sinc_and_cosine(angle**2 / 4)
    sine = angle / 2 * sinc
    bent = ca.gradient(sinc, angle)
    shortening = length * (1 - sinc) + 2 * offset * sine
    taken = ca.gradient(shortening, angle)
    law = ca.vertcat(
        angle,
        sinc * cosine,
        -sinc * sine,
        bent / sinc,
        ca.gradient(bent, angle) / sinc,
        1 - 2 * sine**2,
        2 * sine * cosine,
        shortening,
        taken,
        ca.gradient(taken, angle),
    )
    return ca.Function("ccr_arc", [angle, length, offset], [ca.cse(law)])


def disk_gap(angle: Symbol, length: Symbol, radius: Symbol, thickness: Symbol) -> Symbol:
    """What is left between two disks, at their edges on the side that a segment bends to by ``angle`` [mm].

    The arc at the distance ``radius`` on the inner side has the chord ``2 (l0/θ − R) sin θ/2``, of which the disks take
    ``t cos θ/2``; without thickness they meet at ``θ = l0/R``.
    """
    sinc, cosine = sinc_and_cosine(angle**2 / 4)
    return length * sinc - radius * angle * sinc - thickness * cosine


def disk_gap_function() -> ca.Function:
    """``(θ, l0, R, t) → c, c', c''`` of :func:`disk_gap` in the angle."""
    angle, *sizes = (ca.SX.sym(name) for name in ("angle", "length", "radius", "thickness"))
    gap = disk_gap(angle, *sizes)
    slope = ca.gradient(gap, angle)
    return ca.Function("ccr_disk_gap", [angle, *sizes], [ca.cse(ca.vertcat(gap, slope, ca.gradient(slope, angle)))])


def node_problem(
    robot: "Robot", laws: tuple[GapLaw, ...], mounted: tuple[bool, ...], change: ca.MX | None = None
) -> NodeProblem:
    """Build eq. 5 (eq. 4 when there are no obstacles) for a robot's segments and points, and obstacles of given kinds.

    The arccosine of eq. 4 is written as an arctangent of the same disk directions, which is smooth at zero.

    Args:
        robot: The robot.
        laws: Gap laws of the obstacles.
        mounted: Which obstacles are on springs.
        change: Of (l, L0), then of each obstacle its motion (x, y, turn about the origin, growth), ``(2 + 4m,)``
            [mm, rad]; ``None`` for none.
    """
    segments = robot.segments
    unknowns = ca.MX.sym("unknowns", 4 * segments + 2 * sum(mounted))
    starts = list(itertools.accumulate((law.size for law in laws), initial=4))
    parameters = ca.MX.sym("parameters", starts[-1] + 3 * sum(mounted))
    pull, total, offset = parameters[0], parameters[1], parameters[2]
    if change is not None:
        pull, total = pull + change[0], total + change[1]
    energy_scale = parameters[3] * segments / (2 * total)
    backbone = ca.horzcat(ca.vertcat(0, 0), ca.reshape(unknowns[: 2 * segments], 2, segments))
    cable = ca.horzcat(ca.vertcat(offset, 0), ca.reshape(unknowns[2 * segments : 4 * segments], 2, segments))
    disk = cable - backbone
    before, after = disk[:, :-1], disk[:, 1:]
    turned = before[0, :] * after[1, :] - before[1, :] * after[0, :]
    angle = ca.atan2(turned, ca.sum1(before * after))
    chords, cables = norms(backbone[:, 1:] - backbone[:, :-1]), norms(cable[:, 1:] - cable[:, :-1])
    if robot.model == "rod":
        sinc, _ = sinc_and_cosine(angle**2 / 4)
        astride = ca.sum1((backbone[:, 1:] - backbone[:, :-1]) * (before + after)) / (2 * offset)
        equalities = ca.horzcat(chords - total / segments * sinc, astride, norms(after) - offset)
        ahead = ca.vertcat(-before[1, :] - after[1, :], before[0, :] + after[0, :])  # across the bisector of the disks
        ahead = ahead / ca.repmat(norms(ahead), 2, 1)
        # The way of the cable lies across the bisector; its length has no slope where the holes of two disks meet.
        way = ca.sum2(ca.sum1((cable[:, 1:] - cable[:, :-1]) * ahead))
        limited = ca.vertcat(total - pull - way, *_disk_gaps(robot, backbone, disk, ahead))
    else:
        share = (total - pull) / segments
        equalities = ca.horzcat(chords - total / segments, cables - share, norms(after) - offset)
        limited = ca.MX(0, 1)
    lines = {"backbone": backbone, "cable": cable, "rim": 2 * backbone - cable}
    displacements = ca.reshape(unknowns[4 * segments :], 2, -1)
    springs = ca.reshape(parameters[starts[-1] :], 3, -1)
    gaps, energy = [], ca.sumsqr(angle)
    for j, law in enumerate(laws):
        shape, shift, turn = parameters[starts[j] : starts[j + 1]], ca.MX.zeros(2), ca.MX.eye(2)
        if change is not None:
            x, y, angle_turned, growth = ca.vertsplit(change[2 + 4 * j : 6 + 4 * j])
            shift, turn = ca.vertcat(x, y), _rotation(angle_turned)
            shape = shape + growth * ca.DM([k in law.growth for k in range(law.size)])
        if mounted[j]:
            mount = sum(mounted[:j])
            moved, (xx, xy, yy) = displacements[:, mount], ca.vertsplit(springs[:, mount])
            energy += (xx * moved[0] ** 2 + 2 * xy * moved[0] * moved[1] + yy * moved[1] ** 2) / (2 * energy_scale)
            shift = shift + moved
        for line in robot.touch:
            points = divided(lines[line], robot.between)[:, 1:]
            gaps.append(gaps_of(law, turn.T @ (points - ca.repmat(shift, 1, points.shape[1])), shape))
    return NodeProblem(unknowns, parameters, energy, equalities.T, ca.vertcat(limited, *gaps))


def limits(robot: "Robot") -> int:
    """How many inequalities a robot's node problem has before the gaps to obstacles."""
    return 1 + 2 * robot.segments if robot.model == "rod" else 0


def _disk_gaps(robot: "Robot", backbone: ca.MX, disk: ca.MX, ahead: ca.MX) -> list[ca.MX]:
    """What is left between consecutive disks at their edges, across their bisector, on each side [mm]."""
    radius, thickness = robot.disk_radius_mm, robot.disk_thickness_mm
    assert radius is not None
    half_cosine = norms(disk[:, :-1] + disk[:, 1:]) / (2 * robot.offset_mm)
    gaps = []
    for side in (1, -1):
        edges = backbone + side * radius / robot.offset_mm * disk
        apart = ca.sum1((edges[:, 1:] - edges[:, :-1]) * ahead)
        gaps.append((apart - thickness * half_cosine).T)
    return gaps


def _rotation(angle: ca.MX) -> ca.MX:
    cosine, sine = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(cosine, -sine), ca.horzcat(sine, cosine))


@lru_cache(maxsize=32)
def node_derivatives(robot: "Robot", laws: tuple[GapLaw, ...], mounted: tuple[bool, ...]) -> ca.Function:
    """:func:`first_derivatives` of :func:`node_problem`."""
    return first_derivatives(node_problem(robot, laws, mounted))


@lru_cache(maxsize=32)
def kkt_derivatives(robot: "Robot", laws: tuple[GapLaw, ...], mounted: tuple[bool, ...]) -> ca.Function:
    """:func:`second_derivatives` of :func:`node_problem`."""
    change = ca.MX.sym("change", 2 + 4 * len(laws))
    return second_derivatives(node_problem(robot, laws, mounted, change), change)
