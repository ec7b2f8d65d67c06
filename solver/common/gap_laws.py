"""Gap laws shared by the plane and space: the signed clearance of a point from an obstacle, in CasADi."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple, TypeVar

import casadi as ca

from solver.common.signals import held_signals


def circle_gap(point: ca.SX, shape: ca.SX) -> ca.SX:
    """Return the gap to a circle or a sphere ``shape = (center, r)``: ``(|p − c|² − r²) / 2r``."""
    return (ca.sumsqr(point - shape[:-1]) - shape[-1] ** 2) / (2 * shape[-1])


def half_plane_gap(point: ca.SX, shape: ca.SX) -> ca.SX:
    """Return the gap to a half-plane or half-space ``shape = (n, offset)`` of outward normal n: ``n·p − offset``."""
    return ca.dot(point, shape[:-1]) - shape[-1]


def capsule_gap(point: ca.SX, shape: ca.SX) -> ca.SX:
    """Return the gap to a capsule ``shape = (start, end, r)``: that of the ball about the nearest axis point."""
    start, axis = shape[: point.numel()], shape[point.numel() : -1] - shape[: point.numel()]
    fraction = ca.dot(point - start, axis) / ca.sumsqr(axis)
    nearest = start + ca.fmin(ca.fmax(fraction, 0), 1) * axis
    return circle_gap(point, ca.vertcat(nearest, shape[-1]))


def square_distance(point: ca.SX, start: ca.SX, end: ca.SX) -> ca.SX:
    """Return the squared distance of a point from the line segment between two others."""
    along = end - start
    fraction = ca.dot(point - start, along) / ca.fmax(ca.sumsqr(along), TINY)
    return ca.sumsqr(point - start - ca.fmin(ca.fmax(fraction, 0), 1) * along)


class GapLaw(NamedTuple):
    """Gap law of one kind of obstacle.

    Attributes:
        kind: Name of the kind.
        gap: Gap as a function of (point, shape), with unit slope on the surface.
        size: Number of shape parameters.
        growth: Indices of the shape parameters that grow as much as the obstacle grows outwards.
        space: Dimension of the points.
    """

    kind: str
    gap: Callable[[ca.SX, ca.SX], ca.SX]
    size: int
    growth: tuple[int, ...]
    space: int = 2


TINY = 1e-200  # keeps quotients defined where an edge has no length [mm²]
Symbol = TypeVar("Symbol", ca.SX, ca.MX)
SERIES_TERMS = 12  # of the series below: to the last digit for a quarter turn


def sinc_and_cosine(square: Symbol) -> tuple[Symbol, Symbol]:
    """Return ``sin h / h`` and ``cos h`` of ``square = h²``, smooth at zero, for |h| ≤ π/2.

    The first is a power series. The second is ``d(h sinc h)/dh``, with the slope of that series in ``square``.
    """
    sinc = slope = 0 * square
    for k in reversed(range(SERIES_TERMS)):
        slope = sinc + square * slope
        sinc = (-1) ** k / math.factorial(2 * k + 1) + square * sinc
    return sinc, sinc + 2 * square * slope


def sinc_and_slopes(square: Symbol) -> tuple[Symbol, Symbol, Symbol]:
    """Return S = ``sinc h`` and its first two slopes in z = ``square = h²``, smooth at zero, for |h| ≤ π/2.

    Two power series, of the second and the third slope, give the rest by the differential equation of sinc h,
    4 z S₂ + 6 S₁ + S = 0, and its derivative, 4 z S₃ + 10 S₂ + S₁ = 0.
    """
    second, third = (_sinc_slope(square, order) for order in (2, 3))
    first = -10 * second - 4 * square * third
    return -6 * first - 4 * square * second, first, second


def _sinc_slope(square: Symbol, order: int) -> Symbol:
    """Return the slope of some order of ``sinc h`` in ``square = h²``, by its power series."""
    slope = 0 * square
    for k in reversed(range(order, SERIES_TERMS + 1)):
        slope = (-1) ** k * math.perm(k, order) / math.factorial(2 * k + 1) + square * slope
    return slope


@lru_cache(maxsize=64)
@held_signals()
def gap_function(law: GapLaw) -> ca.Function:
    """Return ``(p, shape) → c, c_x, c_y, c_xx, c_xy, c_yy`` of one kind of obstacle, and likewise in space."""
    point, shape = ca.SX.sym("point", law.space), ca.SX.sym("shape", law.size)
    gap = law.gap(point, shape)
    hessian, gradient = ca.hessian(gap, point)
    upper = [hessian[row, column] for row in range(law.space) for column in range(row, law.space)]
    outputs = ca.vertcat(gap, gradient, *upper)
    return ca.Function(f"ccr_{law.kind}_gap", [point, shape], [ca.cse(ca.densify(outputs))])


@lru_cache(maxsize=64)
@held_signals()
def clearance_function(law: GapLaw) -> ca.Function:
    """Return ``(p, shape) → c`` of one kind of obstacle, where the slopes are not needed."""
    point, shape = ca.SX.sym("point", law.space), ca.SX.sym("shape", law.size)
    return ca.Function(f"ccr_{law.kind}_clearance", [point, shape], [ca.cse(law.gap(point, shape))])


def growth_function(law: GapLaw) -> ca.Function:
    """Return ``(p, shape) → c_g, c_xg, c_yg`` of one kind of obstacle that grows by g, and likewise in space."""
    point, shape = ca.SX.sym("point", law.space), ca.SX.sym("shape", law.size)
    gap = law.gap(point, shape)
    grown = ca.sum1(ca.vertcat(*(ca.gradient(gap, shape)[k] for k in law.growth)))
    outputs = ca.vertcat(grown, ca.gradient(grown, point))
    return ca.Function(f"ccr_{law.kind}_growth", [point, shape], [ca.cse(ca.densify(outputs))])


@lru_cache(maxsize=64)
@held_signals()
def slope_function(law: GapLaw) -> ca.Function:
    """Return ``(p, shape) → c_p`` of one kind of obstacle."""
    point, shape = ca.SX.sym("point", law.space), ca.SX.sym("shape", law.size)
    slope = ca.densify(ca.gradient(law.gap(point, shape), point))
    return ca.Function(f"ccr_{law.kind}_slope", [point, shape], [ca.cse(slope)])


class PointGaps(NamedTuple):
    """Gaps of points to an obstacle.

    Attributes:
        law: Gap law of the obstacle.
        points: The points, as columns ``(d, k)``, in the frame of the obstacle [mm].
        shape: Shape parameters of the obstacle.
    """

    law: GapLaw
    points: ca.MX
    shape: ca.MX

    def values(self) -> ca.MX:
        """Return the gaps, ``(k, 1)`` [mm]."""
        return self._map(clearance_function(self.law)).T

    def slopes(self) -> ca.MX:
        """Return the slopes of the gaps in their points, as columns ``(d, k)``."""
        return self._map(slope_function(self.law))

    def _map(self, function: ca.Function) -> ca.MX:
        count = self.points.shape[1]
        return function.map(count)(self.points, ca.repmat(self.shape, 1, count))
