"""Obstacles of the plane, validated on construction."""

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from solver.common.gap_laws import GapLaw
from solver.common.obstacle import Extent, Obstacle
from solver.common.validation import (
    SMALLEST,
    Pair,
    Point,
    check_pair,
    check_planar_direction,
    check_positive,
    check_sequence,
)
from solver.planar.formulation import CAPSULE, CIRCLE, ELLIPSE, HALF_PLANE, POLYGON, POLYGON_CORNERS


@dataclass(frozen=True, slots=True, kw_only=True)
class Circle(Obstacle):
    """A disc.

    Attributes:
        center: Its centre (x, y) [mm].
        radius: Its radius [mm].

    Raises:
        ValueError: If a value is not finite or the radius is not positive.
    """

    law: ClassVar[GapLaw] = CIRCLE

    center: Pair
    radius: float

    @property
    def parameters(self) -> tuple[float, ...]:
        """Parameters (x, y, r) of the gap law."""
        return (*self.center, self.radius)

    @property
    def extent(self) -> Extent:
        """Size of the disc."""
        return Extent(self.center, self.radius, self.radius, self.radius)

    def outline(self) -> np.ndarray:
        """Return points of the circle, ``(k, 2)`` [mm]."""
        return np.array(self.center) + self.radius * directions()


@dataclass(frozen=True, slots=True, kw_only=True)
class HalfPlane(Obstacle):
    """A flat wall, or with ``nodes`` the paper's load cell (eq. 12), which only the named nodes touch.

    Attributes:
        point: A point (x, y) of the surface [mm].
        normal: Outward normal, from the wall towards the robot; normalised on construction.

    Raises:
        ValueError: If a value is not finite, the normal vanishes, or a node index is negative or repeated.
    """

    law: ClassVar[GapLaw] = HALF_PLANE
    point_fields: ClassVar[tuple[str, ...]] = ("point",)
    size_fields: ClassVar[tuple[str, ...]] = ()

    point: Pair
    normal: Pair

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        normal = check_planar_direction("normal", self.normal, "from the wall towards the robot")
        object.__setattr__(self, "normal", normal)

    @property
    def parameters(self) -> tuple[float, ...]:
        """Parameters (nx, ny, offset) of the gap law."""
        return (*self.normal, self.normal[0] * self.point[0] + self.normal[1] * self.point[1])

    @property
    def extent(self) -> Extent:
        """Size of the half-plane, which is unbounded and flat."""
        return Extent(self.point, math.inf, math.inf, math.inf)

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Unit vectors into the wall and along its surface, ``(2,)`` each."""
        x, y = self.normal
        return np.array([-x, -y]), np.array([-y, x])

    def nearest(self, point: np.ndarray) -> np.ndarray:
        """Return the point of the surface nearest to a point, ``(2,)`` [mm]."""
        inward, _ = self.axes
        return np.asarray(point - ((point - self.point) @ inward) * inward)

    def outline(self) -> np.ndarray:
        """Return the given point of the surface, ``(1, 2)`` [mm]."""
        return np.array([self.point])


@dataclass(frozen=True, slots=True, kw_only=True)
class Ellipse(Obstacle):
    """An ellipse.

    Attributes:
        center: Its centre (x, y) [mm].
        radii: Its half-axes, along ``axis`` and across it [mm].
        axis: Direction of the first half-axis; normalised on construction.

    Raises:
        ValueError: If a value is not finite, a half-axis not positive, or the axis vanishes.
    """

    law: ClassVar[GapLaw] = ELLIPSE
    size_fields: ClassVar[tuple[str, ...]] = ()
    moving_fields: ClassVar[tuple[str, ...] | None] = ("center", "radii")

    center: Pair
    radii: Pair
    axis: Pair = (1.0, 0.0)

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        first, second = check_pair("radii", self.radii)
        for radius in (first, second):
            check_positive("a half-axis of radii", radius)
        object.__setattr__(self, "radii", (first, second))
        object.__setattr__(self, "axis", check_planar_direction("axis", self.axis, "of the first half-axis"))

    @property
    def parameters(self) -> tuple[float, ...]:
        """Parameters (x, y, a, b, ux, uy) of the gap law."""
        return (*self.center, *self.radii, *self.axis)

    @property
    def extent(self) -> Extent:
        """Disc of the larger half-axis, and the curvature at its end; the inner radius is that of the outline."""
        small, large = sorted(self.radii)
        inradius = float(distance_to_outline(self.outline(), np.array([self.center]))[0])
        return Extent(self.center, large, inradius, small**2 / large)

    @property
    def surface(self) -> np.ndarray:
        """Points of the surface, ``(k, 2)`` [mm]."""
        return self.outline()

    def _radii(self) -> list[tuple[str, float]]:
        small, large = sorted(self.radii)
        return [("a half-axis", small), ("a half-axis", large), ("the sharpest radius", small * (small / large))]

    def outline(self) -> np.ndarray:
        """Return points of the ellipse, ``(k, 2)`` [mm]."""
        x, y = self.axis
        return np.asarray(self.center + directions() * self.radii @ np.array([[x, y], [-y, x]]))


@dataclass(frozen=True, slots=True, kw_only=True)
class Capsule(Obstacle):
    """All points within a radius of a line segment: a round-ended bar.

    Attributes:
        start: One end (x, y) of the line segment [mm].
        end: Its other end [mm].
        radius: The radius [mm].

    Raises:
        ValueError: If a value is not finite, the radius is not positive, or the ends coincide.
    """

    law: ClassVar[GapLaw] = CAPSULE
    point_fields: ClassVar[tuple[str, ...]] = ("start", "end")

    start: Pair
    end: Pair
    radius: float

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        if math.dist(self.start, self.end) < SMALLEST:
            raise ValueError(f"start and end are both {self.start}; they must differ (a Circle has one centre)")

    @property
    def parameters(self) -> tuple[float, ...]:
        """Parameters (x1, y1, x2, y2, r) of the gap law."""
        return (*self.start, *self.end, self.radius)

    @property
    def extent(self) -> Extent:
        """Disc about the middle of the line segment."""
        middle = ((self.start[0] + self.end[0]) / 2, (self.start[1] + self.end[1]) / 2)
        return Extent(middle, math.dist(self.start, self.end) / 2 + self.radius, self.radius, self.radius)

    def outline(self) -> np.ndarray:
        """Return points of the surface, ``(k, 2)`` [mm]."""
        return _rounded(np.array([self.start, self.end]), self.radius)


@dataclass(frozen=True, slots=True, kw_only=True)
class Polygon(Obstacle):
    """A convex polygon with rounded corners: all points within a radius of its core.

    Attributes:
        corners: Corners (x, y) of the core, 3 to 8, in either sense [mm]; kept counter-clockwise.
        radius: Radius of the corners, which also lies around the edges [mm].

    Raises:
        ValueError: If a value is not finite, the radius is not positive, or the corners are too few, too many or not
            those of a convex polygon.
    """

    law: ClassVar[GapLaw] = POLYGON
    point_fields: ClassVar[tuple[str, ...]] = ()
    moving_fields: ClassVar[tuple[str, ...] | None] = ("corners", "radius")

    corners: tuple[Pair, ...]
    radius: float

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        given = check_sequence("corners", self.corners, "a tuple of pairs (x, y)")
        corners = tuple(check_pair("a corner", corner) for corner in given[: POLYGON_CORNERS + 1])
        if not 3 <= len(corners) <= POLYGON_CORNERS:
            raise ValueError(f"corners has {len(given)} points; it must have 3 to {POLYGON_CORNERS}")
        turns = _turns(corners)
        shortest = min(math.dist(*edge) for edge in zip(corners, corners[1:] + corners[:1], strict=True))
        if all(turn < 0 for turn in turns):
            corners, turns = corners[::-1], [-turn for turn in turns]
        if not (all(turn > 0 for turn in turns) and sum(turns) < 3 * math.pi and shortest >= SMALLEST):
            raise ValueError(f"corners is {self.corners}; they must go once round a convex polygon, none straight")
        object.__setattr__(self, "corners", corners)

    @property
    def parameters(self) -> tuple[float, ...]:
        """Parameters (r, x1, y1, …) of the gap law, the last corner repeated to fill up."""
        filled = self.corners + (POLYGON_CORNERS - len(self.corners)) * self.corners[-1:]
        return (self.radius, *(value for corner in filled for value in corner))

    @property
    def extent(self) -> Extent:
        """Disc about the mean of the corners."""
        x, y = np.mean(self.corners, axis=0).tolist()
        farthest = max(math.dist((x, y), corner) for corner in self.corners)
        return Extent((x, y), farthest + self.radius, _inradius(np.array(self.corners)) + self.radius, self.radius)

    def shifted(self, by: Iterable[float]) -> Self:
        """Return the polygon moved by a shift [mm]."""
        shift = check_pair("by", by)
        return replace(self, corners=tuple((x + shift[0], y + shift[1]) for x, y in self.corners))

    def _points(self) -> list[tuple[str, Point]]:
        return [("a corner", corner) for corner in self.corners]

    def outline(self) -> np.ndarray:
        """Return points of the surface, ``(k, 2)`` [mm]."""
        return _rounded(np.array(self.corners), self.radius)


def _turns(corners: tuple[Pair, ...]) -> list[float]:
    """Return the angle turned at each corner, counter-clockwise positive [rad]."""
    edges = np.roll(corners, -1, axis=0) - np.asarray(corners)
    headings = np.arctan2(edges[:, 1], edges[:, 0])
    return list(np.remainder(headings - np.roll(headings, 1) + np.pi, 2 * np.pi) - np.pi)


def _inradius(corners: np.ndarray) -> float:
    """Return the radius of the largest disc in a convex, counter-clockwise polygon; it touches three edges [mm]."""
    edges = np.roll(corners, -1, axis=0) - corners
    inward = np.column_stack([-edges[:, 1], edges[:, 0]]) / np.linalg.norm(edges, axis=1)[:, None]
    offsets = (inward * corners).sum(axis=1)
    largest = 0.0
    for three in map(list, itertools.combinations(range(len(corners)), 3)):
        edges = np.column_stack([inward[three], -np.ones(3)])  # distance of the centre from each, less the radius
        if abs(np.linalg.det(edges)) > 1e-12:
            x, y, radius = np.linalg.solve(edges, offsets[three])
            if (inward @ (x, y) - offsets).min() >= radius * (1 - 1e-9):
                largest = max(largest, float(radius))
    return largest


def directions() -> np.ndarray:
    """Return evenly spaced unit vectors, ``(96, 2)``."""
    angles = np.linspace(0, 2 * np.pi, 97)[:-1]
    return np.column_stack([np.cos(angles), np.sin(angles)])


def distance_to_outline(outline: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the distances of points ``(n, 2)`` from the polygon of an outline ``(k, 2)``, ``(n,)`` [mm].

    Inside, this is the depth as the kernel takes it for shapes whose gap is no distance.
    """
    chords, offset = np.roll(outline, -1, axis=0) - outline, points[:, None] - outline
    share = np.clip((offset * chords).sum(axis=2) / np.maximum((chords**2).sum(axis=1), SMALLEST**2), 0, 1)
    return np.asarray(np.linalg.norm(offset - share[..., None] * chords, axis=2).min(axis=1))


def _rounded(core: np.ndarray, radius: float) -> np.ndarray:
    """Return the outline of all points within a radius of a convex core, given by its corners, ``(k, 2)``."""
    around = directions()
    return np.asarray(core[(around @ core.T).argmax(axis=1)] + radius * around)
