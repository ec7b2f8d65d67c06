"""Mathematics of a segment of the rod in space, stated once, in CasADi.

A segment is an arc, its controls a rotation vector u: bending (the first two components, towards −y and +x) and twist,
in radians. It rotates its upper disk by ``exp u``; its chord lies along the tangent halfway, ``exp(u/2) e_z``, and is
``c = l0 sinc(b/2)`` long, where b is the size of the bending. With t = |u|, ``g = sinc(t/2)``,
``p = (1 − cos(t/2))/t²`` and ``q = (t − sin t)/t³``:

- the tangent halfway is ``p u_z u + g/2 (u_y, −u_x, 0) + (1 − p t²) e_z``;
- ``exp u = I + g cos(t/2) [u] + g²/2 [u]²``, and a change of u turns the upper disk by ``I + g²/2 [u] + q [u]²`` times
  it, [u] the matrix of the cross product;
- a cable through the holes h of both disks is straight between them; in the frame halfway it runs along
  ``c e_z + g u × h``.

All is smooth at u = 0: c is a function of b², the others of t², given with their slopes.
"""

import math
from typing import NamedTuple

import casadi as ca

SERIES_TERMS = 9  # of the power series of q(t/4), to the last digit for t up to π


class Shared(NamedTuple):
    """Values of a segment that several of its laws need, each with its slopes: c in b², the others in t²."""

    chord: tuple[ca.SX, ca.SX, ca.SX]
    spread: tuple[ca.SX, ca.SX, ca.SX]
    lean: tuple[ca.SX, ca.SX, ca.SX]
    turn: tuple[ca.SX, ca.SX]


NUMBERS = 11  # of Shared


def shared_values(control: ca.SX, length: ca.SX) -> Shared:
    """Return c, g, p and q of a segment, with their slopes.

    With h = t/4 and s = h², all follow from ``q(h)`` without cancellation: ``S = sinc h = 1 − s q(h)``,
    ``C = cos h = S + 2 s dS/ds``, g = S C, p = S²/8 and ``q = (q(h) + S K)/16 + g p``, where
    ``K = (1 − C)/s = 3 q(h) + 2 s dq(h)/ds``.
    """
    chord = _spread(*_quarter(ca.sumsqr(control[:2]) / 16)[1:])
    quarter = ca.sumsqr(control) / 16
    (turn, turn1, turn2), sinc, cosine = _quarter(quarter)
    spread, lean = _spread(sinc, cosine), (sinc[0] ** 2 / 8, sinc[0] * sinc[1] / 64)
    fall, fall1 = 3 * turn + 2 * quarter * turn1, 5 * turn1 + 2 * quarter * turn2
    half1 = turn1 + sinc[1] * fall + sinc[0] * fall1
    return Shared(
        (length * chord[0], length * chord[1], length * chord[2]),
        spread,
        (*lean, (sinc[1] ** 2 + sinc[0] * sinc[2]) / 1024),
        ((turn + sinc[0] * fall) / 16 + spread[0] * lean[0], half1 / 256 + spread[1] * lean[0] + spread[0] * lean[1]),
    )


def _quarter(square: ca.SX) -> tuple[tuple[ca.SX, ca.SX, ca.SX], tuple[ca.SX, ca.SX, ca.SX], ca.SX]:
    """Return q and sinc of h with two slopes each in ``square = h²``, and cos h."""
    value = slope = half_curvature = ca.SX(0)
    for k in reversed(range(SERIES_TERMS)):
        half_curvature = slope + square * half_curvature
        slope = value + square * slope
        value = (-1) ** k / math.factorial(2 * k + 3) + square * value
    sinc, sinc1 = 1 - square * value, -value - square * slope
    sinc2 = -2 * slope - 2 * square * half_curvature
    return (value, slope, 2 * half_curvature), (sinc, sinc1, sinc2), sinc + 2 * square * sinc1


def _spread(sinc: tuple[ca.SX, ca.SX, ca.SX], cosine: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return sinc(2h) with its slopes in 16 h², from sinc and cosine of h."""
    value, slope, curvature = sinc
    return value * cosine, (slope * cosine - value**2 / 2) / 16, (curvature * cosine - 1.5 * value * slope) / 256


def _symbols() -> tuple[ca.SX, Shared]:
    """Return symbols of the shared values, as one vector and by name."""
    numbers = ca.SX.sym("shared", NUMBERS)
    c, c1, c2, g, g1, g2, p, p1, p2, q, q1 = ca.vertsplit(numbers)
    return numbers, Shared((c, c1, c2), (g, g1, g2), (p, p1, p2), (q, q1))


def arc_function() -> ca.Function:
    """Return ``(u, l0) → chord, rotation``, their slopes, row by row, and the :class:`Shared` values, ``(41,)``.

    The slopes are those of the chord and of the upper disk's rotation, all in the frame of the lower disk.
    """
    control, length = ca.SX.sym("control", 3), ca.SX.sym("length")
    shared = shared_values(control, length)
    (c, c1, _), (g, g1, _), (p, p1, _), (q, _) = shared
    x, y, z = ca.vertsplit(control)
    square, up, cross = ca.sumsqr(control), ca.vertcat(0, 0, 1), ca.skew(control)
    aside, across = ca.vertcat(y, -x, 0), ca.vertcat(ca.horzcat(0, 1, 0), ca.horzcat(-1, 0, 0), ca.horzcat(0, 0, 0))
    tangent = p * z * control + g / 2 * aside + (1 - p * square) * up
    slope = 2 * p1 * z * control + g1 * aside - 2 * (p1 * square + p) * up
    tangent_slope = slope @ control.T + p * (z * ca.SX.eye(3) + control @ up.T) + g / 2 * across
    chord_slope = c * tangent_slope + 2 * c1 * tangent @ ca.vertcat(x, y, 0).T
    half_cosine, twice = g + 2 * square * g1, cross @ cross
    rotation = ca.SX.eye(3) + g * half_cosine * cross + g**2 / 2 * twice
    turning = ca.SX.eye(3) + g**2 / 2 * cross + q * twice
    parts = [ca.vec(part.T) for part in (rotation, chord_slope, turning)]
    law = ca.vertcat(c * tangent, *parts, *(value for values in shared for value in values))
    return ca.Function("ccr_spatial_arc", [control, length], [ca.cse(ca.densify(law))])


def arc_hessian_function() -> ca.Function:
    """Return ``(u, shared, force, moment) → Hessian in the control, row by row``, ``(9,)``.

    It is that of the work of a force on the chord and of a moment on the rotation of the upper disk, in the frame of
    the lower one; the moment's is symmetrised.
    """
    control, force, moment = (ca.SX.sym(name, 3) for name in ("control", "force", "moment"))
    numbers, ((c, c1, c2), (g, g1, g2), (p, p1, p2), (q, q1)) = _symbols()
    x, y, z = ca.vertsplit(control)
    square, bent, up, one = ca.sumsqr(control), ca.vertcat(x, y, 0), ca.vertcat(0, 0, 1), ca.SX.eye(3)
    # The force's work over c is p a + g/2 b + f_z.
    a, b = z * ca.dot(force, control) - force[2] * square, force[0] * y - force[1] * x
    a_slope = force * z + up * ca.dot(force, control) - 2 * force[2] * control
    b_slope = ca.vertcat(-force[1], force[0], 0)
    curved = 4 * (p2 * a + g2 / 2 * b) * control @ control.T + 2 * (p1 * a + g1 / 2 * b - p * force[2]) * one
    curved += _both(control, 2 * p1 * a_slope + g1 * b_slope) + p * _both(force, up)
    work = p * a + g / 2 * b + force[2]
    slope = (2 * p1 * a + g1 * b) * control + p * a_slope + g / 2 * b_slope
    hessian = c * curved + 2 * c1 * _both(bent, slope)
    hessian += work * (2 * c1 * ca.diag(ca.vertcat(1, 1, 0)) + 4 * c2 * bent @ bent.T)
    along = ca.dot(control, moment)
    turned = q1 * (control * along - square * moment) - g * g1 * ca.cross(control, moment) - q / 2 * moment
    hessian += _both(turned, control) + q * along * one
    law = ca.densify(ca.vec(hessian))
    return ca.Function("ccr_spatial_arc_hessian", [control, numbers, force, moment], [ca.cse(law)])


def cable_function() -> ca.Function:
    """Return ``(u, l0, hole, shared) → taken, its slope``: what a segment takes up from a cable [mm], ``(4,)``.

    It is l0 less the distance of the holes.
    """
    control, length, hole = ca.SX.sym("control", 3), ca.SX.sym("length"), ca.SX.sym("hole", 2)
    numbers, shared = _symbols()
    ahead, aside, ahead_slope, aside_slope = _cable(control, hole, shared)
    size = ca.sqrt(ahead**2 + aside**2)
    slope = (ahead * ahead_slope + aside * aside_slope) / size
    return ca.Function(
        "ccr_spatial_cable", [control, length, hole, numbers], [ca.cse(ca.vertcat(length - size, -slope))]
    )


def cable_hessian_function() -> ca.Function:
    """Return ``(u, hole, shared) → Hessian, row by row``, of what a segment takes up from a cable [mm], ``(9,)``."""
    control, hole = ca.SX.sym("control", 3), ca.SX.sym("hole", 2)
    numbers, shared = _symbols()
    (_, c1, c2), (_, g1, g2), *_ = shared
    ahead, aside, ahead_slope, aside_slope = _cable(control, hole, shared)
    bent, along, one = ca.vertcat(control[:2], 0), ca.vertcat(0, 0, 1), ca.SX.eye(3)
    spread_hessian = 2 * g1 * one + 4 * g2 * control @ control.T
    towards, offset = ca.vertcat(hole[1], -hole[0], 0), ca.sqrt(ca.sumsqr(hole))
    chord_hessian = 2 * c1 * ca.diag(ca.vertcat(1, 1, 0)) + 4 * c2 * bent @ bent.T
    ahead_hessian = chord_hessian + spread_hessian * ca.dot(control, towards) + 2 * g1 * _both(control, towards)
    aside_hessian = offset * (spread_hessian * control[2] + 2 * g1 * _both(control, along))
    size = ca.sqrt(ahead**2 + aside**2)
    slope = (ahead * ahead_slope + aside * aside_slope) / size
    hessian = ahead * ahead_hessian + aside * aside_hessian + ahead_slope @ ahead_slope.T + aside_slope @ aside_slope.T
    law = ca.densify(-ca.vec(hessian - slope @ slope.T) / size)
    return ca.Function("ccr_spatial_cable_hessian", [control, hole, numbers], [ca.cse(law)])


def _cable(control: ca.SX, hole: ca.SX, shared: Shared) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """Return how far a cable runs ahead in the frame halfway, and by the twist aside, with their slopes."""
    (c, c1, _), (g, g1, _), *_ = shared
    towards, offset, twist = ca.vertcat(hole[1], -hole[0], 0), ca.sqrt(ca.sumsqr(hole)), control[2]
    moved = ca.dot(control, towards)
    ahead_slope = 2 * c1 * ca.vertcat(control[:2], 0) + 2 * g1 * moved * control + g * towards
    aside_slope = offset * (2 * g1 * twist * control + g * ca.vertcat(0, 0, 1))
    return c + g * moved, offset * g * twist, ahead_slope, aside_slope


def _both(a: ca.SX, b: ca.SX | ca.DM) -> ca.SX:
    """Return ``a bᵀ + b aᵀ``."""
    return a @ b.T + b @ a.T
