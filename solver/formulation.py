"""The mathematics of the planar model, written once, in CasADi.

Three layers, all in millimetre and radian:

- *segment law*: the angle between consecutive disks as a function of σ = sin ψ, the sine of the shear angle, which
  is the reduced coordinate that eliminates the length equalities of eq. 4;
- *gap laws*: signed clearance of a point from an obstacle, scaled so that its gradient has unit length on the
  surface and a multiplier has units rad²/mm;
- *node-coordinate problem*: eq. 4/5 of the paper as they stand, for the reference solver and for the certificate.

The first two are turned into C when the package is built (:mod:`solver.codegen`), with their derivatives.
"""

from functools import lru_cache
from typing import NamedTuple

import casadi as ca


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


def circle_gap(point: ca.SX, shape: ca.SX) -> ca.SX:
    """Gap to a circle ``shape = (x, y, r)``: ``(|p − c|² − r²) / 2r``."""
    return (ca.sumsqr(point - shape[:2]) - shape[2] ** 2) / (2 * shape[2])


def half_plane_gap(point: ca.SX, shape: ca.SX) -> ca.SX:
    """Gap to a half-plane ``shape = (nx, ny, offset)`` with unit outward normal: ``n·p − offset`` (eq. 12)."""
    return ca.dot(point, shape[:2]) - shape[2]


GAP_LAWS = {"circle": circle_gap, "half_plane": half_plane_gap}


def segment_function() -> ca.Function:
    """``(σ, pull, l0, a) → θ, θ_σ, θ_σσ, θ_pull, cos ζ, sin ζ, ζ_σ, ζ_σσ, cos θ, sin θ``.

    ``ζ = ψ − θ/2`` is the direction of the backbone segment in the frame of its lower disk, from that frame's y axis.
    The derivatives of θ follow from the closure by the implicit function theorem, which costs one division in all.
    """
    sine, pull, length, offset, u = (ca.SX.sym(name) for name in ("sine", "pull", "length", "offset", "half_sine"))
    closure = segment_closure(u, sine, pull, length, offset)
    in_u, in_sine, in_pull = (ca.gradient(closure, variable) for variable in (u, sine, pull))
    per_closure = -1 / in_u
    u_sine = in_sine * per_closure
    u_pull = in_pull * per_closure
    bent = ca.gradient(in_sine, sine) + 2 * ca.gradient(in_sine, u) * u_sine + ca.gradient(in_u, u) * u_sine**2
    cosine, half_cosine = ca.sqrt(1 - sine**2), ca.sqrt(1 - u**2)
    per_cosine, per_half_cosine = 1 / cosine, 1 / half_cosine
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


def gap_function(kind: str) -> ca.Function:
    """``(p, shape) → c, c_x, c_y, c_xx, c_xy, c_yy`` for one kind of obstacle."""
    point, shape = ca.SX.sym("point", 2), ca.SX.sym("shape", 3)
    gap = GAP_LAWS[kind](point, shape)
    hessian, gradient = ca.hessian(gap, point)
    outputs = ca.vertcat(gap, gradient, hessian[0, 0], hessian[0, 1], hessian[1, 1])
    return ca.Function(f"ccr_{kind}_gap", [point, shape], [ca.densify(outputs)])


class NodeProblem(NamedTuple):
    """Eq. 5 in node coordinates, symbolic.

    Attributes:
        unknowns: Backbone then cable points of nodes 1…n, each as x, y pairs, ``(4n,)`` [mm].
        parameters: ``(l, L0, a)`` then the shapes of the obstacles, ``(3 + 3m,)``.
        objective: Sum of squared disk angles [rad²].
        equalities: Backbone, cable and disk lengths of the segments minus their values, ``(3n,)`` [mm].
        gaps: Gap of every point of nodes 1…n to every obstacle, ordered (obstacle, point, node), ``(2nm,)`` [mm].
    """

    unknowns: ca.MX
    parameters: ca.MX
    objective: ca.MX
    equalities: ca.MX
    gaps: ca.MX


def node_problem(segments: int, kinds: tuple[str, ...]) -> NodeProblem:
    """Build eq. 5 (eq. 4 when ``kinds`` is empty) for ``segments`` segments and the given kinds of obstacle.

    The arccosine of eq. 4 is written as an arctangent of the same disk directions, which is smooth at zero.
    """
    unknowns = ca.MX.sym("unknowns", 4 * segments)
    parameters = ca.MX.sym("parameters", 3 + 3 * len(kinds))
    pull, total, offset = parameters[0], parameters[1], parameters[2]
    backbone = ca.horzcat(ca.vertcat(0, 0), ca.reshape(unknowns[: 2 * segments], 2, segments))
    cable = ca.horzcat(ca.vertcat(offset, 0), ca.reshape(unknowns[2 * segments :], 2, segments))
    disk = cable - backbone
    before, after = disk[:, :-1], disk[:, 1:]
    turned = before[0, :] * after[1, :] - before[1, :] * after[0, :]
    angle = ca.atan2(turned, ca.sum1(before * after))
    equalities = ca.horzcat(
        _norms(backbone[:, 1:] - backbone[:, :-1]) - total / segments,
        _norms(cable[:, 1:] - cable[:, :-1]) - (total - pull) / segments,
        _norms(after) - offset,
    )
    gaps = [
        _gaps(kind, points[:, 1:], parameters[3 + 3 * j : 6 + 3 * j])
        for j, kind in enumerate(kinds)
        for points in (backbone, cable)
    ]
    return NodeProblem(unknowns, parameters, ca.sumsqr(angle), equalities.T, ca.vertcat(*gaps) if gaps else ca.MX(0, 1))


def _norms(columns: ca.MX) -> ca.MX:
    return ca.sqrt(ca.sum1(columns**2))


def _gaps(kind: str, points: ca.MX, shape: ca.MX) -> ca.MX:
    count = points.shape[1]
    return gap_function(kind).map(count)(points, ca.repmat(shape, 1, count))[0, :].T


@lru_cache(maxsize=32)
def node_derivatives(segments: int, kinds: tuple[str, ...]) -> ca.Function:
    """``(unknowns, parameters) → ∇J, equalities, their Jacobian, gaps, their Jacobian`` of :func:`node_problem`."""
    problem = node_problem(segments, kinds)
    outputs = [
        ca.gradient(problem.objective, problem.unknowns),
        problem.equalities,
        ca.jacobian(problem.equalities, problem.unknowns),
        problem.gaps,
        ca.jacobian(problem.gaps, problem.unknowns),
    ]
    return ca.Function("node_derivatives", [problem.unknowns, problem.parameters], outputs)
