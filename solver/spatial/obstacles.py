"""Obstacles of space, validated on construction."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solver.common.gap_laws import GapLaw
from solver.common.obstacle import Extent, Obstacle
from solver.common.validation import SMALLEST, UNIT_ROUNDING, Point, check_direction, check_point, check_positive
from solver.spatial.formulation import BOX, CAPSULE, CYLINDER, HALF_SPACE, SPHERE

PARALLEL = 1e-6  # sine of the least angle between the axes of a box


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialObstacle(Obstacle):
    """A convex obstacle of space, fixed or on a spring; the attributes are those of :class:`solver.Obstacle`."""

    space: ClassVar[int] = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Sphere(SpatialObstacle):
    """A ball.

    Attributes:
        center: Its centre (x, y, z) [mm].
        radius: Its radius [mm].

    Raises:
        ValueError: If a value is not finite or the radius is not positive.
    """

    law: ClassVar[GapLaw] = SPHERE

    center: Point
    radius: float

    @property
    def parameters(self) -> tuple[float, ...]:
        """Parameters (x, y, z, r) of the gap law."""
        return (*self.center, self.radius)

    @property
    def extent(self) -> Extent:
        """Size of the ball."""
        return Extent(self.center, self.radius, self.radius, self.radius)

    def outline(self) -> np.ndarray:
        """Return points of the sphere, ``(u, v, 3)`` [mm]."""
        return np.asarray(self.center + self.radius * _ball(np.eye(3)))


@dataclass(frozen=True, slots=True, kw_only=True)
class HalfSpace(SpatialObstacle):
    """A flat wall, or with ``nodes`` a load cell, which only the named nodes touch.

    Attributes:
        point: A point (x, y, z) of the surface [mm].
        normal: Outward normal, from the wall towards the robot; normalised on construction.

    Raises:
        ValueError: If a value is not finite, or the normal vanishes.
    """

    law: ClassVar[GapLaw] = HALF_SPACE
    point_fields: ClassVar[tuple[str, ...]] = ("point",)
    size_fields: ClassVar[tuple[str, ...]] = ()

    point: Point
    normal: Point

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        object.__setattr__(self, "normal", check_direction("normal", self.normal, "from the wall towards the robot", 3))

    @property
    def parameters(self) -> tuple[float, ...]:
        """Parameters (nx, ny, nz, offset) of the gap law."""
        return (*self.normal, float(np.dot(self.normal, self.point)))

    @property
    def extent(self) -> Extent:
        """Size of the half-space, which is unbounded and flat."""
        return Extent(self.point, math.inf, math.inf, math.inf)

    def outline(self) -> np.ndarray:
        """Return the corners of a square of the surface around the point, ``(2, 2, 3)`` [mm].

        It is twice as wide as the point is far from the base, the only length that a wall has.
        """
        _, first, second = _axes(np.array(self.normal))
        ends = math.hypot(*self.point) * np.array([-1.0, 1.0])
        return np.asarray(self.point + ends[:, None, None] * first + ends[None, :, None] * second)


@dataclass(frozen=True, slots=True, kw_only=True)
class Capsule(SpatialObstacle):
    """All points within a radius of a line segment: a round-ended bar.

    Attributes:
        start: One end (x, y, z) of the line segment [mm].
        end: Its other end [mm].
        radius: The radius [mm].

    Raises:
        ValueError: If a value is not finite, the radius is not positive, or the ends coincide.
    """

    law: ClassVar[GapLaw] = CAPSULE
    point_fields: ClassVar[tuple[str, ...]] = ("start", "end")

    start: Point
    end: Point
    radius: float

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        _check_ends(self.start, self.end)

    @property
    def parameters(self) -> tuple[float, ...]:
        """Parameters (start, end, r) of the gap law."""
        return (*self.start, *self.end, self.radius)

    @property
    def extent(self) -> Extent:
        """Ball about the middle of the line segment."""
        center, half = _middle(self.start, self.end)
        return Extent(center, half + self.radius, self.radius, self.radius)

    def outline(self) -> np.ndarray:
        """Return points of the surface, ``(u, v, 3)`` [mm]."""
        axis = np.subtract(self.end, self.start)
        ball = _ball(_axes(axis / np.linalg.norm(axis)))
        ends = np.where(ball @ axis > 0, 1.0, 0.0)[..., None]
        return self.start + ends * axis + self.radius * ball


@dataclass(frozen=True, slots=True, kw_only=True)
class Cylinder(SpatialObstacle):
    """A cylinder with rounded edges.

    Attributes:
        start: Middle (x, y, z) of one of its flat ends [mm].
        end: Middle of the other [mm].
        radius: Its radius [mm].
        edge: Radius of its edges, at most ``radius`` and half its length [mm].

    Raises:
        ValueError: If a value is not finite or out of range, or the ends coincide.
    """

    law: ClassVar[GapLaw] = CYLINDER
    point_fields: ClassVar[tuple[str, ...]] = ("start", "end")
    size_fields: ClassVar[tuple[str, ...]] = ("radius", "edge")

    start: Point
    end: Point
    radius: float
    edge: float = 1.0

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        _check_ends(self.start, self.end)
        largest = min(self.radius, _middle(self.start, self.end)[1])
        if self.edge > largest:
            raise ValueError(f"edge is {self.edge}; it must be at most {largest:.6g} (radius and half-length)")

    @property
    def parameters(self) -> tuple[float, ...]:
        """Parameters (center, axis, radius and half-length of the core, edge radius) of the gap law."""
        center, half = _middle(self.start, self.end)
        axis = ((b - a) / (2 * half) for a, b in zip(self.start, self.end, strict=True))
        return (*center, *axis, self.radius - self.edge, half - self.edge, self.edge)

    @property
    def extent(self) -> Extent:
        """Ball about the middle of the cylinder."""
        center, half = _middle(self.start, self.end)
        return Extent(center, math.hypot(half, self.radius), min(half, self.radius), self.edge)

    def outline(self) -> np.ndarray:
        """Return points of the surface, ``(u, v, 3)`` [mm]."""
        _, half = _middle(self.start, self.end)
        axis, first, second = _axes(np.subtract(self.end, self.start) / (2 * half))
        turns = np.linspace(0, 2 * math.pi, 33)
        around = np.cos(turns)[:, None] * first + np.sin(turns)[:, None] * second
        profile = ((0.0, 0.0), (0.0, self.radius), (2 * half, self.radius), (2 * half, 0.0))
        return np.stack([self.start + along * axis + radius * around for along, radius in profile])


@dataclass(frozen=True, slots=True, kw_only=True)
class Box(SpatialObstacle):
    """A box with rounded edges.

    Attributes:
        center: Its centre (x, y, z) [mm].
        sizes: Its sizes along its axes [mm].
        edge: Radius of its edges and corners, at most half of the smallest size [mm].
        axis: Direction of its first axis; normalised on construction.
        second: Direction of its second axis, made perpendicular to the first.

    Raises:
        ValueError: If a value is not finite or out of range, or the axes do not span a plane.
    """

    law: ClassVar[GapLaw] = BOX
    size_fields: ClassVar[tuple[str, ...]] = ("edge",)
    moving_fields: ClassVar[tuple[str, ...] | None] = ("center", "sizes", "edge")

    center: Point
    sizes: Point
    edge: float = 1.0
    axis: Point = (1.0, 0.0, 0.0)
    second: Point = (0.0, 1.0, 0.0)

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        object.__setattr__(self, "sizes", check_point("sizes", self.sizes, 3))
        for size in self.sizes:
            check_positive("a size", size)
        if self.edge > min(self.sizes) / 2:
            raise ValueError(
                f"edge is {self.edge}; it must be at most {min(self.sizes) / 2:.6g}, half the smallest size"
            )
        object.__setattr__(self, "axis", check_direction("axis", self.axis, "of the first axis", 3))
        object.__setattr__(self, "second", _across(self.axis, self.second))

    def _radii(self) -> list[tuple[str, float]]:
        return [("edge", self.edge), *(("a size", size) for size in self.sizes)]

    @property
    def axes(self) -> np.ndarray:
        """Axes of the box, one in each row, ``(3, 3)``."""
        return np.array([self.axis, self.second, np.cross(self.axis, self.second)])

    @property
    def parameters(self) -> tuple[float, ...]:
        """Parameters (center, three axes, half-sizes of the core, edge radius) of the gap law."""
        return (*self.center, *self.axes.ravel().tolist(), *(size / 2 - self.edge for size in self.sizes), self.edge)

    @property
    def extent(self) -> Extent:
        """Ball about the centre of the box."""
        return Extent(self.center, math.hypot(*self.sizes) / 2, min(self.sizes) / 2, self.edge)

    def outline(self) -> np.ndarray:
        """Return points of the surface, ``(u, v, 3)`` [mm]."""
        x, y, z = np.array(self.sizes) / 2
        ring = np.array([[-x, -y], [x, -y], [x, y], [-x, y], [-x, -y]])
        walls = [(0.0, -z), (1.0, -z), (1.0, z), (0.0, z)]
        corners = np.array([[(*(scale * corner), height) for corner in ring] for scale, height in walls])
        return np.asarray(self.center + corners @ self.axes)


def _across(axis: Point, second: object) -> Point:
    """Return the direction of the second axis of a box, made perpendicular to the first; one that is so stays."""
    meaning = "of the second axis, across the first"
    unit = check_direction("second", second, meaning, 3)
    while abs(along := np.dot(unit, axis)) > UNIT_ROUNDING:
        across = np.subtract(unit, along * np.array(axis))
        if not np.linalg.norm(across) > PARALLEL:
            raise ValueError(f"second is {second}; give the direction {meaning}")
        unit = check_direction("second", across.tolist(), meaning, 3)
    return unit


def _check_ends(start: Point, end: Point) -> None:
    if math.dist(start, end) < SMALLEST:
        raise ValueError(f"start and end are both {start}; they must differ (a Sphere has one centre)")


def _middle(start: Point, end: Point) -> tuple[Point, float]:
    """Return the middle of a line segment and half its length."""
    return tuple((a + b) / 2 for a, b in zip(start, end, strict=True)), math.dist(start, end) / 2


def _axes(axis: np.ndarray) -> np.ndarray:
    """Return a unit vector and two more that are orthonormal to it, ``(3, 3)``."""
    helper = np.eye(3)[np.abs(axis).argmin()]
    first = np.cross(axis, helper)
    first /= np.linalg.norm(first)
    return np.array([axis, first, np.cross(axis, first)])


def _ball(axes: np.ndarray) -> np.ndarray:
    """Return a grid of unit vectors, from one end of the first axis to the other, ``(u, v, 3)``."""
    down, turns = np.meshgrid(np.linspace(0, math.pi, 18), np.linspace(0, 2 * math.pi, 33), indexing="ij")
    parts = np.stack([np.cos(down), np.sin(down) * np.cos(turns), np.sin(down) * np.sin(turns)], axis=-1)
    return np.asarray(parts @ axes)
