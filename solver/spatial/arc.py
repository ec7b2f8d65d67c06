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

SERIES_TERMS = 9  # of the power series of Stumpff's functions, to the last digit for t up to π


class Shared(NamedTuple):
    """Values of a segment that several of its laws need, each with its slopes: c in b², the others in t²."""

    chord: tuple[ca.SX, ca.SX, ca.SX]
    spread: tuple[ca.SX, ca.SX, ca.SX]
    lean: tuple[ca.SX, ca.SX, ca.SX]
    turn: tuple[ca.SX, ca.SX]


NUMBERS = 11  # of Shared


def shared_values(control: ca.SX, length: ca.SX) -> Shared:
    """Return c, g, p and q of a segment, with their slopes.

    All follow from Stumpff's functions of half the angle, h = t/2, without cancellation: g = c1, p = c2/4 and
    ``q = (c3 + c1 c2)/4``.
    """
    along, along1, along2 = _stumpff(ca.sumsqr(control[:2]) / 4)[0]
    (g, g1, g2), (p, p1, p2), (turn, turn1) = _stumpff(ca.sumsqr(control) / 4)
    return Shared(
        (length * along, length / 4 * along1, length / 16 * along2),
        (g, g1 / 4, g2 / 16),
        (p / 4, p1 / 16, p2 / 64),
        ((turn + g * p) / 4, (turn1 + g1 * p + g * p1) / 16),
    )


_Slopes = tuple[ca.SX, ca.SX, ca.SX]


def _stumpff(square: ca.SX) -> tuple[_Slopes, _Slopes, tuple[ca.SX, ca.SX]]:
    """Return c1 = sin h / h, c2 = (1 − cos h)/h² and c3 = (1 − c1)/h², with slopes in ``square = h²``.

    Two power series give c5 and c6; ``c[k] = 1/k! − h² c[k+2]`` the others, and ``dc[k]/dh² = (k c[k+2] − c[k+1])/2``
    their slopes.
    """
    c5, c6 = (_series(square, k) for k in (5, 6))
    c4, c3 = (1 / math.factorial(k) - square * above for k, above in ((4, c6), (3, c5)))
    c2, c1 = (1 / math.factorial(k) - square * above for k, above in ((2, c4), (1, c3)))
    slope2, slope3, slope4 = c4 - c3 / 2, (3 * c5 - c4) / 2, 2 * c6 - c5 / 2
    return (c1, (c3 - c2) / 2, (slope3 - slope2) / 2), (c2, slope2, slope4 - slope3 / 2), (c3, slope3)


def _series(square: ca.SX, order: int) -> ca.SX:
    value = ca.SX(0)
    for k in reversed(range(SERIES_TERMS)):
        value = (-1) ** k / math.factorial(2 * k + order) + square * value
    return value


def _symbols() -> tuple[ca.SX, Shared]:
    """Return symbols of the shared values, as one vector and by name."""
    numbers = ca.SX.sym("shared", NUMBERS)
    c, c1, c2, g, g1, g2, p, p1, p2, q, q1 = ca.vertsplit(numbers)
    return numbers, Shared((c, c1, c2), (g, g1, g2), (p, p1, p2), (q, q1))


def arc_function() -> ca.Function:
    """Return ``(u, l0) → chord, rotation and their slopes, row by row, (30,), and the Shared values, (11,)``.

    The slopes are those of the chord and of the upper disk's rotation, all in the frame of the lower disk.
    """
    control, length = ca.SX.sym("control", 3), ca.SX.sym("length")
    shared = shared_values(control, length)
    (c, c1, _), (g, g1, _), (p, p1, _), (q, _) = shared
    x, y, z = ca.vertsplit(control)
    square, one, cross, products = ca.sumsqr(control), ca.SX.eye(3), ca.skew(control), control @ control.T
    fall = 1 - p * square
    tangent = ca.vertcat(p * z * x + g / 2 * y, p * z * y - g / 2 * x, p * z * z + fall)
    lean, swing = c * p, c * g / 2
    slope = ca.vertcat(2 * p1 * z * x + g1 * y, 2 * p1 * z * y - g1 * x, 2 * p1 * z * z - 2 * (p1 * square + p))
    slope, shortening = c * slope, 2 * c1 * tangent
    chord_slope = ca.horzcat((slope + shortening) * x, (slope + shortening) * y, slope * z + lean * control)
    chord_slope += ca.diag(ca.vertcat(*[lean * z] * 3))
    chord_slope[0, 1] += swing
    chord_slope[1, 0] -= swing
    halves = g**2 / 2
    rotation = (1 - halves * square) * one + g * fall * cross + halves * products
    turning = (1 - q * square) * one + halves * cross + q * products
    parts = [ca.vec(part.T) for part in (rotation, chord_slope, turning)]
    law = ca.vertcat(c * tangent, *parts), ca.vertcat(*(value for values in shared for value in values))
    return ca.Function("ccr_spatial_arc", [control, length], ca.cse([ca.densify(part) for part in law]))


def arc_hessian_function() -> ca.Function:
    """Return ``(u, shared, force, moment) → Hessian in the control``, its lower triangle row by row, ``(6,)``.

    It is that of the work of a force on the chord and of a moment on the rotation of the upper disk, in the frame of
    the lower one; the moment's is symmetrised.
    """
    control, force, moment = (ca.SX.sym(name, 3) for name in ("control", "force", "moment"))
    numbers, ((c, c1, c2), (g, g1, g2), (p, p1, p2), (q, q1)) = _symbols()
    x, y, z = ca.vertsplit(control)
    square, bent, up, one = ca.sumsqr(control), ca.vertcat(x, y, 0), ca.vertcat(0, 0, 1), ca.SX.eye(3)
    # The force's work over c is p a + g/2 b + f_z.
    pull, along = ca.dot(force, control), ca.dot(control, moment)
    a, b = z * pull - force[2] * square, force[0] * y - force[1] * x
    a_slope = force * z + up * pull - 2 * force[2] * control
    b_slope = ca.vertcat(-force[1], force[0], 0)
    work = p * a + g / 2 * b + force[2]
    rise, curl = 2 * p1 * a + g1 * b, 2 * (p2 * a + g2 / 2 * b)
    sloped = c * (2 * p1 * a_slope + g1 * b_slope + curl * control)
    turned = q1 * (control * along - square * moment) - g * g1 * ca.cross(control, moment) - q / 2 * moment
    slope = 2 * c1 * (rise * control + p * a_slope + g / 2 * b_slope) + 2 * c2 * work * bent
    hessian = _both(control, sloped + turned) + _both(bent, slope) + c * p * _both(force, up)
    hessian += (c * (rise - 2 * p * force[2]) + q * along) * one + 2 * c1 * work * ca.diag(ca.vertcat(1, 1, 0))
    return ca.Function("ccr_spatial_arc_hessian", [control, numbers, force, moment], [ca.cse(_triangle(hessian))])


def cable_function() -> ca.Function:
    """Return ``(u, hole, shared) → distance and its slope``, of the holes of a cable in both disks [mm], ``(4,)``.

    A hole is its two coordinates and its distance from the backbone.
    """
    control, hole = ca.SX.sym("control", 3), ca.SX.sym("hole", 3)
    numbers, shared = _symbols()
    ahead, aside, ahead_slope, aside_slope = _cable(control, hole, shared)
    size = ca.sqrt(ahead**2 + (hole[2] * aside) ** 2)
    per_size = 1 / size
    slope = ahead * per_size * ahead_slope + hole[2] ** 2 * aside * per_size * aside_slope
    return ca.Function("ccr_spatial_cable", [control, hole, numbers], [ca.cse(ca.vertcat(size, slope))])


def cable_hessian_function() -> ca.Function:
    """Return ``(u, hole, shared) → Hessian of that distance``, its lower triangle row by row, ``(6,)``."""
    control, hole = ca.SX.sym("control", 3), ca.SX.sym("hole", 3)
    numbers, shared = _symbols()
    (_, c1, c2), (_, g1, g2), *_ = shared
    ahead, aside, ahead_slope, aside_slope = _cable(control, hole, shared)
    bent, one = ca.vertcat(control[:2], 0), ca.SX.eye(3)
    chord_hessian = 2 * c1 * ca.diag(ca.vertcat(1, 1, 0)) + 4 * c2 * bent @ bent.T
    spread_hessian = 2 * g1 * one + 4 * g2 * control @ control.T
    across = ca.vertcat(ahead * hole[1], -ahead * hole[0], hole[2] ** 2 * aside)
    per_size = 1 / ca.sqrt(ahead**2 + (hole[2] * aside) ** 2)
    # The distance is that of two coordinates, which turns as they change.
    turning = hole[2] * per_size * (aside * ahead_slope - ahead * aside_slope)
    hessian = ahead * chord_hessian + ca.dot(control, across) * spread_hessian + _both(2 * g1 * control, across)
    hessian = per_size * (hessian + turning @ turning.T)
    return ca.Function("ccr_spatial_cable_hessian", [control, hole, numbers], [ca.cse(_triangle(hessian))])


def cable_length_function() -> ca.Function:
    """Return ``(u, hole, shared) → slopes in log l0 of that distance and of its slope``, ``(4,)`` [mm]."""
    control, hole = ca.SX.sym("control", 3), ca.SX.sym("hole", 3)
    numbers, shared = _symbols()
    ahead, aside, ahead_slope, aside_slope = _cable(control, hole, shared)
    size = ca.sqrt(ahead**2 + (hole[2] * aside) ** 2)
    slope = (ahead * ahead_slope + hole[2] ** 2 * aside * aside_slope) / size
    chord = ca.vertcat(numbers[:3], ca.SX.zeros(NUMBERS - 3))  # of the shared values only c grows with the length
    law = ca.jtimes(ca.vertcat(size, slope), numbers, chord)
    return ca.Function("ccr_spatial_cable_length", [control, hole, numbers], [ca.cse(ca.densify(law))])


def _cable(control: ca.SX, hole: ca.SX, shared: Shared) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """Return how far a cable runs ahead in the frame halfway, and by the twist aside, with their slopes.

    The way aside is that per distance from the backbone, the same for all cables.
    """
    (c, c1, _), (g, g1, _), *_ = shared
    towards, twist, spreading = ca.vertcat(hole[1], -hole[0], 0), control[2], 2 * g1 * control
    moved = control[0] * hole[1] - control[1] * hole[0]
    ahead_slope = 2 * c1 * ca.vertcat(control[:2], 0) + spreading * moved + g * towards
    return c + g * moved, g * twist, ahead_slope, spreading * twist + g * ca.vertcat(0, 0, 1)


def _both(a: ca.SX, b: ca.SX | ca.DM) -> ca.SX:
    """Return ``a bᵀ + b aᵀ``."""
    return a @ b.T + b @ a.T


def _triangle(matrix: ca.SX) -> ca.SX:
    """Return the lower triangle of a matrix, row by row."""
    return ca.densify(ca.vertcat(*(matrix[row, column] for row in range(3) for column in range(row + 1))))
