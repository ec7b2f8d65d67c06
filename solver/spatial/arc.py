"""Mathematics of a segment of the rod in space, stated once, in CasADi.

A segment is an arc, its controls a rotation vector u: bending (the first two components, towards −y and +x) and twist,
in radians. It rotates its upper disk by ``exp u``; its chord lies along the tangent halfway, in the direction
``exp(u/2) e_z``, and is ``l0 sinc(b/2)`` long, where b is the size of the bending. A cable through the holes h of both
disks is straight between them, and in the frame halfway runs along ``l0 sinc(b/2) e_z + sinc(t/2) u × h``, t = |u|.
All is smooth at u = 0: power series in t².
"""

import math

import casadi as ca

from solver.common.gap_laws import sinc_and_slopes

SERIES_TERMS = 9  # of the power series of a quarter of an angle up to π


def half_rotation(square: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """Return ``cos t/4, sin(t/4)/t, cos t/2, sin(t/2)/t`` of ``square = t²``, smooth at zero, for t ≤ π."""
    quarter, sine = square / 16, ca.SX(0)
    cosine = ca.SX(0)
    for k in reversed(range(SERIES_TERMS + 1)):
        sine = (-1) ** k / math.factorial(2 * k + 1) + quarter * sine
        cosine = (-1) ** k / math.factorial(2 * k) + quarter * cosine
    return cosine, sine / 4, 1 - square * sine**2 / 8, cosine * sine / 2


def turning_coefficient(square: ca.SX) -> ca.SX:
    """Return ``(t − sin t) / t³`` of ``square = t²``, smooth at zero, for t ≤ π, by two halvings of a power series."""
    value = ca.SX(0)
    for k in reversed(range(SERIES_TERMS)):
        value = (-1) ** k / math.factorial(2 * k + 3) + square / 16 * value
    # (1 − sinc t)/t² = (1 − sinc h)/4h² + 2 sinc h (sin(h/2)/t)², h = t/2; sinc h = 2 sin(h)/t
    for part in (square / 4, square):
        _, quarter_sine, _, half_sine = half_rotation(part)
        value = value / 4 + 4 * half_sine * quarter_sine**2
    return value


class _Arc:
    """Symbols of a segment of the rod, and what follows from them."""

    def __init__(self) -> None:
        self.control, self.length = ca.SX.sym("control", 3), ca.SX.sym("length")
        self.square = ca.sumsqr(self.control)
        self.quarter_cosine, self.quarter_sine, self.half_cosine, self.half_sine = half_rotation(self.square)
        sincs = sinc_and_slopes(ca.sumsqr(self.control[:2]) / 4)
        self.sizes = [self.length * sinc / 4**k for k, sinc in enumerate(sincs)]  # of the chord, and slopes in b²
        self.size = self.sizes[0]

    @property
    def chord(self) -> ca.SX:
        """Backbone in the frame of the lower disk, ``(3,)`` [mm]."""
        x, y, z = ca.vertsplit(self.quarter_sine * self.control)
        w = self.quarter_cosine
        tangent = ca.vertcat(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))
        return ca.SX(self.size * tangent)

    @property
    def rotation(self) -> ca.SX:
        """Rotation from the upper disk's frame to the lower one's, ``(3, 3)``."""
        turn = ca.skew(self.control)
        return ca.SX.eye(3) + 2 * self.half_sine * self.half_cosine * turn + 2 * self.half_sine**2 * turn @ turn

    @property
    def turning(self) -> ca.SX:
        """Rotation of the upper disk in the frame of the lower one, per change of the control, ``(3, 3)``."""
        turn = ca.skew(self.control)
        return ca.SX.eye(3) + 2 * self.half_sine**2 * turn + turning_coefficient(self.square) * turn @ turn


def arc_function() -> ca.Function:
    """Return ``(u, l0) → chord, rotation``, their slopes, row by row, and what :func:`cable_function` takes, ``(36,)``.

    The slopes are those of the chord and of the upper disk's rotation, all in the frame of the lower disk. A cable
    needs the length of the chord with two slopes in b², and ``sinc(t/2)`` with two in t².
    """
    arc = _Arc()
    parts = arc.rotation, ca.jacobian(arc.chord, arc.control), arc.turning
    spread = [sinc / 4**k for k, sinc in enumerate(sinc_and_slopes(arc.square / 4))]
    law = ca.vertcat(arc.chord, *(ca.vec(part.T) for part in parts), *arc.sizes, *spread)
    return ca.Function("ccr_spatial_arc", [arc.control, arc.length], [ca.cse(ca.densify(law))])


def arc_hessian_function() -> ca.Function:
    """Return ``(u, l0, force, moment) → Hessian in the control, row by row``, ``(9,)``.

    It is that of the work of a force on the chord and of a moment on the rotation of the upper disk, in the frame of
    the lower one.
    """
    arc, force, moment = _Arc(), ca.SX.sym("force", 3), ca.SX.sym("moment", 3)
    moments = ca.jacobian(arc.turning.T @ moment, arc.control)
    hessian = ca.hessian(ca.dot(force, arc.chord), arc.control)[0] + (moments + moments.T) / 2
    law = ca.densify(ca.vec(hessian))
    return ca.Function("ccr_spatial_arc_hessian", [arc.control, arc.length, force, moment], [ca.cse(law)])


def cable_function() -> ca.Function:
    """Return ``(u, l0, hole, chord, spread) → taken, its slope, its Hessian row by row``, ``(13,)``.

    It is what a segment takes up from a cable [mm]: l0 less the distance of the holes. ``chord`` and ``spread`` are
    the last six numbers of :func:`arc_function`.
    """
    control, length, hole = ca.SX.sym("control", 3), ca.SX.sym("length"), ca.SX.sym("hole", 2)
    chord, spread = ca.SX.sym("chord", 3), ca.SX.sym("spread", 3)
    bent, towards = ca.vertcat(control[:2], 0), ca.vertcat(hole[1], -hole[0], 0)
    chord_slope = 2 * chord[1] * bent
    chord_hessian = 2 * chord[1] * ca.diag(ca.vertcat(1, 1, 0)) + 4 * chord[2] * bent @ bent.T
    spread_slope = 2 * spread[1] * control
    spread_hessian = 2 * spread[1] * ca.SX.eye(3) + 4 * spread[2] * control @ control.T
    # The cable runs `ahead` across the frame halfway, and by the twist `aside`.
    offset, moved, twist, along = ca.sqrt(ca.sumsqr(hole)), ca.dot(control, towards), control[2], ca.vertcat(0, 0, 1)
    ahead, aside = chord[0] + spread[0] * moved, offset * spread[0] * twist
    ahead_slope = chord_slope + spread_slope * moved + spread[0] * towards
    aside_slope = offset * (spread_slope * twist + spread[0] * along)
    mixed, twisted = spread_slope @ towards.T, spread_slope @ along.T
    ahead_hessian = chord_hessian + spread_hessian * moved + mixed + mixed.T
    aside_hessian = offset * (spread_hessian * twist + twisted + twisted.T)
    size = ca.sqrt(ahead**2 + aside**2)
    slope = (ahead * ahead_slope + aside * aside_slope) / size
    hessian = ahead * ahead_hessian + aside * aside_hessian + ahead_slope @ ahead_slope.T + aside_slope @ aside_slope.T
    hessian = (hessian - slope @ slope.T) / size
    law = ca.densify(ca.vertcat(length - size, -slope, -ca.vec(hessian)))
    return ca.Function("ccr_spatial_cable", [control, length, hole, chord, spread], [ca.cse(law)])
