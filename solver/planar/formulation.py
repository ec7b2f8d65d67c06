"""Mathematics of the planar models (eq. 4 and 5), stated once, in CasADi.

Three layers, all in millimetres and radians:

- *segment laws*: the shape of a segment in one reduced coordinate, which eliminates the length equalities of eq. 4:
  in the paper's model σ = sin ψ, the sine of the shear angle, in the rod the angle θ between its disks;
- *gap laws*: signed clearance of a point from an obstacle, scaled so that its gradient has unit length on the surface
  and a multiplier has units rad²/mm;
- *node-coordinate problem*: eq. 4 and 5 as they stand in the paper, for the reference solver and the certificate.

The build turns the first two into C, with their derivatives (:mod:`solver.codegen`).
"""

import itertools
from functools import lru_cache

import casadi as ca

from solver.common.gap_laws import (
    TINY,
    GapLaw,
    PointGaps,
    Symbol,
    capsule_gap,
    circle_gap,
    half_plane_gap,
    sinc_and_cosine,
    sinc_and_slopes,
    square_distance,
)
from solver.common.node_problem import NodeProblem, first_derivatives, grow, norms, second_derivatives, subdivide
from solver.common.signals import held_signals
from solver.planar.robot import Robot
from solver.planar.rod_formulation import Pose, pose, rod_inequality_count, rod_objective, rod_segments

MOTIONS = 4  # components of an obstacle's change: shift, turn, growth


def segment_half_sine(sine: ca.SX, pull: ca.SX, length: ca.SX, offset: ca.SX) -> ca.SX:
    """Return ``u = sin θ/2`` of a segment, θ being the angle between its disks, whose cable is shorter by ``pull``.

    The chord ``2a·u`` between the free ends of the disks is ``l0 cos ψ − sqrt(la² − l0² sin² ψ)`` with
    ``la = l0 − pull``. It is written as a quotient, so that a small pull loses no digits.
    """
    cable = length - pull
    reach = length * ca.sqrt(1 - sine**2) + ca.sqrt(cable**2 - (length * sine) ** 2)
    return pull * (length + cable) / (reach * 2 * offset)


def segment_closure(half_sine: ca.SX, sine: ca.SX, pull: ca.SX, length: ca.SX, offset: ca.SX) -> ca.SX:
    """Return the squared cable length of a segment minus its value: zero at :func:`segment_half_sine` [mm²]."""
    chord = 2 * offset * half_sine
    return chord * (chord - 2 * length * ca.sqrt(1 - sine**2)) + pull * (2 * length - pull)


def ellipse_gap(point: ca.SX, shape: ca.SX) -> ca.SX:
    """Return the gap to an ellipse ``shape = (x, y, a, b, ux, uy)`` with half-axis a along the unit vector u.

    It is ``F / |∇F|`` of the implicit form ``F = (p·u / a)² + (p·v / b)² − 1``, both halved.
    """
    local = point - shape[:2]
    along = (local[0] * shape[4] + local[1] * shape[5]) / shape[2]
    across = (local[1] * shape[4] - local[0] * shape[5]) / shape[3]
    steepness = ca.sqrt((along / shape[2]) ** 2 + (across / shape[3]) ** 2)
    return (along**2 + across**2 - 1) / (2 * steepness)


def polygon_gap(point: ca.SX, shape: ca.SX) -> ca.SX:
    """Return the gap to a convex polygon ``shape = (r, x1, y1, …)`` with rounded corners, counter-clockwise.

    It is the distance to the core, that of a half-plane beside an edge and of a point beyond a corner, less the corner
    radius. Corners may be repeated to fill up the shape.
    """
    corners = ca.reshape(shape[1:], 2, -1)
    count = corners.shape[1]
    edge, closest = ca.horzcat(corners[:, 0], corners[:, 1]), square_distance(point, corners[:, 0], corners[:, 1])
    for i in range(1, count):
        start, end = corners[:, i], corners[:, (i + 1) % count]
        distance = square_distance(point, start, end)
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
    """Return the segment law of the paper's model, with its derivatives in the shear.

    ``(σ, pull, l0, a) → θ, θ_σ, θ_σσ, θ_pull, cos ζ, sin ζ, ζ_σ, ζ_σσ, cos θ, sin θ``, where
    ``ζ = ψ − θ/2`` is the direction of the backbone segment in the frame of its lower disk, from that frame's y axis.
    The derivatives of θ follow from the closure by the implicit function theorem, at the cost of a single division.
    """
    sine, pull, length, offset, u = (ca.SX.sym(name) for name in ("sine", "pull", "length", "offset", "half_sine"))
    closure = segment_closure(u, sine, pull, length, offset)
    in_u, in_sine, in_pull = (ca.gradient(closure, variable) for variable in (u, sine, pull))
    cosine, half_cosine = ca.sqrt(1 - sine**2), ca.sqrt(1 - u**2)
    cosines = cosine * half_cosine
    per_all = 1 / (in_u * cosines)  # one division instead of three
    per_closure, per_cosine, per_half_cosine = -per_all * cosines, per_all * in_u * half_cosine, per_all * in_u * cosine
    u_sine = in_sine * per_closure
    u_pull = in_pull * per_closure
    curved = ca.gradient(in_sine, sine) + 2 * ca.gradient(in_sine, u) * u_sine + ca.gradient(in_u, u) * u_sine**2
    slope = 2 * per_half_cosine * u_sine
    curvature = 2 * per_half_cosine * (curved * per_closure + u * (per_half_cosine * u_sine) ** 2)
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


def segment_inputs_function(name: str, *, in_length: bool) -> ca.Function:
    """Return the slopes of the segment law of the paper's model in its pull, or also in its length.

    ``(σ, pull, l0, a) → θ_pull, θ_σpull, θ_pullpull``, or ``→ θ_pull, θ_l0, θ_σpull, θ_σl0, θ_pullpull, θ_pulll0,
    θ_l0l0``, by the implicit function theorem as in :func:`segment_function`.
    """
    sine, pull, length, offset, u = (ca.SX.sym(name) for name in ("sine", "pull", "length", "offset", "half_sine"))
    closure = segment_closure(u, sine, pull, length, offset)
    in_u, half_cosine = ca.gradient(closure, u), ca.sqrt(1 - u**2)
    per_both = 1 / (in_u * half_cosine)
    per_closure, per_half_cosine = -per_both * half_cosine, per_both * in_u

    def first(of: ca.SX) -> ca.SX:
        return ca.gradient(closure, of) * per_closure

    def second(one: ca.SX, other: ca.SX) -> ca.SX:
        mixed = ca.gradient(ca.gradient(closure, one), other) + ca.gradient(in_u, u) * first(one) * first(other)
        mixed += ca.gradient(in_u, one) * first(other) + ca.gradient(in_u, other) * first(one)
        return 2 * per_half_cosine * (mixed * per_closure + u * per_half_cosine**2 * first(one) * first(other))

    inputs = [pull, length] if in_length else [pull]
    slopes = [2 * per_half_cosine * first(one) for one in inputs] + [second(sine, one) for one in inputs]
    curvatures = [second(one, other) for k, one in enumerate(inputs) for other in inputs[k:]]
    half_sine = segment_half_sine(sine, pull, length, offset)
    law = ca.cse(ca.substitute(ca.vertcat(*slopes, *curvatures), u, half_sine))
    return ca.Function(name, [sine, pull, length, offset], [law])


def arc_function() -> ca.Function:
    """Return the segment law of the rod, whose segments are arcs, with its derivatives in the angle.

    ``(θ, l0) → θ, f, g, c'/c, c''/c, cos θ, sin θ, cos θ/2, sin θ/2, s, s', s''``. The chord ``c = l0 sinc θ/2`` along
    the bisector has the components ``l0·(f, g)`` in the frame of the lower disk, ahead and to its left. From a cable at
    the distance a towards +x the segment takes up ``s + 2a sin θ/2`` with ``s = l0 − c`` (Rao 2024).
    """
    angle, length = ca.SX.sym("angle"), ca.SX.sym("length")
    half = angle / 2
    square = half**2
    sinc, first, second = sinc_and_slopes(square)
    sine, cosine = half * sinc, sinc + 2 * square * first
    bent, bent_slope = half * first, square * second + first / 2  # slopes of sinc θ/2 in θ, as d(h²)/dθ = h
    law = ca.vertcat(
        angle,
        sinc * cosine,
        -sinc * sine,
        bent / sinc,
        bent_slope / sinc,
        1 - 2 * sine**2,
        2 * sine * cosine,
        cosine,
        sine,
        length * (1 - sinc),
        -length * bent,
        -length * bent_slope,
    )
    return ca.Function("ccr_arc", [angle, length], [ca.cse(law)])


def disk_gap(angle: Symbol, length: Symbol, radius: Symbol, thickness: Symbol) -> Symbol:
    """Return the gap between the edges of two disks, on the side to which their segment bends by ``angle`` [mm].

    The arc at the distance ``radius`` on the inner side has the chord ``2 (l0/θ − R) sin θ/2``, of which the disks take
    up ``t cos θ/2``; without thickness they meet at ``θ = l0/R``.
    """
    sinc, cosine = sinc_and_cosine(angle**2 / 4)
    return length * sinc - radius * angle * sinc - thickness * cosine


def disk_gap_function() -> ca.Function:
    """Return ``(θ, l0, R, t) → c, c', c''``: :func:`disk_gap` and its derivatives in the angle."""
    angle, *sizes = (ca.SX.sym(name) for name in ("angle", "length", "radius", "thickness"))
    gap = disk_gap(angle, *sizes)
    slope = ca.gradient(gap, angle)
    return ca.Function("ccr_disk_gap", [angle, *sizes], [ca.cse(ca.vertcat(gap, slope, ca.gradient(slope, angle)))])


def disk_gap_length_function() -> ca.Function:
    """Return ``θ → c_l0, c'_l0``: the slope of :func:`disk_gap` in the length, and that one's in the angle."""
    angle, length = ca.SX.sym("angle"), ca.SX.sym("length")
    slope = ca.gradient(disk_gap(angle, length, ca.SX(0), ca.SX(0)), length)
    return ca.Function("ccr_disk_gap_length", [angle], [ca.cse(ca.vertcat(slope, ca.gradient(slope, angle)))])


def node_problem(
    robot: Robot, laws: tuple[GapLaw, ...], mounted: tuple[bool, ...], change: ca.MX | None = None
) -> NodeProblem:
    """Build eq. 5 (eq. 4 when there are no obstacles) for a robot and obstacles of given kinds.

    The arccosine of eq. 4 is written as an arctangent of the same disk directions, which is smooth at zero.

    Args:
        robot: The robot, with c cables.
        laws: Gap laws of the obstacles.
        mounted: Which obstacles are on springs.
        change: Change of (l of each cable, L0), then of each obstacle its motion (x, y, turn about the origin, growth),
            ``(c + 1 + 4m,)`` [mm, rad]; ``None`` for none.

    Returns:
        The problem. ``unknowns``: backbone points of nodes 1…n, then the points of their disks at the distance a
        towards +x, then the displacements of the obstacles on springs, each as x, y pairs, ``(4n + 2s,)`` [mm].
        ``parameters``: ``(l of each cable, L0, a, EI)``, the shapes of the obstacles, one after the other, and
        ``(kxx, kxy, kyy)`` of those on springs. ``equalities``: three for each segment, ``(3n,)`` [mm]; see
        :func:`_paper_segments` and :func:`~solver.planar.rod_formulation.rod_segments`. ``inequalities``: those of the
        robot, see :func:`robot_inequality_count`, then the gaps to obstacles [mm].
    """
    n, cables = robot.segments, len(robot.cables)
    unknowns = ca.MX.sym("unknowns", 4 * n + 2 * sum(mounted))
    starts = list(itertools.accumulate((law.size for law in laws), initial=cables + 3))
    parameters = ca.MX.sym("parameters", starts[-1] + 3 * sum(mounted))
    commands = parameters[: cables + 1] if change is None else parameters[: cables + 1] + change[: cables + 1]
    pulls, total, offset = commands[:cables], commands[cables], parameters[cables + 1]
    shape_now = pose(unknowns[: 4 * n], offset)
    segments = rod_segments if robot.model == "rod" else _paper_segments
    equalities, limits = segments(robot, shape_now, pulls, total, offset)
    displacements = ca.reshape(unknowns[4 * n :], 2, -1)
    springs = ca.reshape(parameters[starts[-1] :], 3, -1)
    energy_scale = parameters[cables + 2] * n / (2 * total)
    is_rod = robot.model == "rod"
    energy = rod_objective(robot, shape_now, total, energy_scale) if is_rod else ca.sumsqr(shape_now.angle)
    gaps = []
    for j, law in enumerate(laws):
        own = None if change is None else change[cables + 1 + MOTIONS * j : cables + 1 + MOTIONS * (j + 1)]
        shape, shift, turn = _moved(law, parameters[starts[j] : starts[j + 1]], own)
        if mounted[j]:
            mount = sum(mounted[:j])
            moved = displacements[:, mount]
            energy += _twice_spring_energy(springs[:, mount], moved) / (2 * energy_scale)
            shift = shift + moved
        for line in robot.lines_mm:
            points = subdivide(shape_now.line(line / robot.offset_mm), robot.between)[:, 1:]
            gaps.append(PointGaps(law, turn.T @ (points - ca.repmat(shift, 1, points.shape[1])), shape))
    return NodeProblem(unknowns, parameters, energy, equalities.T, limits, gaps)


def robot_inequality_count(robot: Robot) -> int:
    """Return how many inequalities of the node problem come before the gaps to obstacles.

    These are the slack of each cable of the rod, then the gap between the disks of each segment on the side of +x, then
    on the other; the paper's model has none.
    """
    return rod_inequality_count(robot) if robot.model == "rod" else 0


def _paper_segments(robot: Robot, shape: Pose, pull: ca.MX, total: ca.MX, offset: ca.MX) -> tuple[ca.MX, ca.MX]:
    """Return the equalities of the paper's segments: lengths of backbone, cable and disk minus their values."""
    chords = norms(shape.backbone[:, 1:] - shape.backbone[:, :-1])
    cables = norms(shape.edge[:, 1:] - shape.edge[:, :-1])
    share = (total - pull) / robot.segments
    lengths = chords - total / robot.segments, cables - share, norms(shape.disk[:, 1:]) - offset
    return ca.horzcat(*lengths), ca.MX(0, 1)


def _moved(law: GapLaw, shape: ca.MX, change: ca.MX | None) -> tuple[ca.MX, ca.MX, ca.MX]:
    """Return the shape, shift and rotation of an obstacle after a change of its own."""
    if change is None:
        return shape, ca.MX.zeros(2), ca.MX.eye(2)
    x, y, turn, growth = ca.vertsplit(change)
    cosine, sine = ca.cos(turn), ca.sin(turn)
    rotation = ca.vertcat(ca.horzcat(cosine, -sine), ca.horzcat(sine, cosine))
    return grow(law, shape, growth), ca.vertcat(x, y), rotation


def _twice_spring_energy(spring: ca.MX, moved: ca.MX) -> ca.MX:
    """Return twice the energy of a spring ``(kxx, kxy, kyy)`` [N·mm]."""
    xx, xy, yy = ca.vertsplit(spring)
    return xx * moved[0] ** 2 + 2 * xy * moved[0] * moved[1] + yy * moved[1] ** 2


@lru_cache(maxsize=32)
@held_signals()
def node_derivatives(robot: Robot, laws: tuple[GapLaw, ...], mounted: tuple[bool, ...]) -> ca.Function:
    """Return the :func:`~solver.common.node_problem.first_derivatives` of :func:`node_problem`."""
    return first_derivatives(node_problem(robot, laws, mounted))


@lru_cache(maxsize=32)
@held_signals()
def kkt_derivatives(robot: Robot, laws: tuple[GapLaw, ...], mounted: tuple[bool, ...]) -> ca.Function:
    """Return the :func:`~solver.common.node_problem.second_derivatives` of :func:`node_problem`."""
    change = ca.MX.sym("change", len(robot.cables) + 1 + MOTIONS * len(laws))
    return second_derivatives(node_problem(robot, laws, mounted, change), change)
