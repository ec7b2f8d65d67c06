"""Base class of all obstacles, and their extent."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from solver import _kernel
from solver.common.gap_laws import GapLaw
from solver.common.validation import (
    Matrix,
    Point,
    check_point,
    check_points,
    check_positive,
    check_sequence,
    check_spring,
    check_whole,
    refusal,
    shown,
)

SHAPES = {shape.name.lower(): shape for shape in _kernel.Shape}
FARTHEST = 100.0  # position or size of an obstacle, over the robot's longest length
SHIFT_ROUNDING = 1e-12  # difference of the shifts of an obstacle's points, over their coordinates
MAX_NODES = 4097  # of a robot
SHARPEST = 1e-9  # smallest radius of an obstacle's surface, over that length


class Extent(NamedTuple):
    """Size of an obstacle.

    Attributes:
        center: Centre of a disc or ball that encloses it [mm].
        radius: Radius of that disc or ball [mm]; infinite for a wall.
        inradius: Radius of the largest disc or ball inside it [mm]; infinite for a wall.
        min_curvature_radius: Smallest radius of curvature of the surface [mm]; infinite for a wall.
    """

    center: Point
    radius: float
    inradius: float
    min_curvature_radius: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle(ABC):
    """A convex obstacle, fixed or on a spring.

    Attributes:
        nodes: Indices of the nodes that can touch it, the base being 0; ``None`` for all.
        spring: Stiffness of the spring it is mounted on, which lets it shift but not turn [N/mm]: one number, or a
            symmetric matrix, in the plane ``((kxx, kxy), (kxy, kyy))``; stored as a matrix. ``None`` for a fixed
            obstacle.

    Raises:
        ValueError: If a node index is negative or repeated, or the spring's stiffness is not positive definite.
    """

    space: ClassVar[int] = 2  # dimension of its points
    point_fields: ClassVar[tuple[str, ...]] = ("center",)  # which move with it
    size_fields: ClassVar[tuple[str, ...]] = ("radius",)
    moving_fields: ClassVar[tuple[str, ...] | None] = None  # what may change in a motion; None for the two above

    nodes: tuple[int, ...] | None = None
    spring: float | Matrix | None = None

    def __post_init__(self) -> None:
        if self.spring is not None:
            object.__setattr__(self, "spring", check_spring("spring", self.spring, self.space))
        if self.nodes is not None:
            object.__setattr__(self, "nodes", _check_nodes(self.nodes))
        for name in self.point_fields:
            object.__setattr__(self, name, check_point(name, getattr(self, name), self.space))
        for name in self.size_fields:
            object.__setattr__(self, name, check_positive(name, getattr(self, name)))

    @property
    @abstractmethod
    def law(self) -> GapLaw:
        """Gap law of the obstacle."""

    @property
    def kind(self) -> str:
        """Name of the gap law."""
        return self.law.kind

    @property
    def spring_matrix(self) -> np.ndarray:
        """``spring`` as an array ``(2, 2)``, in space ``(3, 3)`` [N/mm], zero for a fixed obstacle."""
        return np.zeros((self.space, self.space)) if self.spring is None else np.array(self.spring)

    @property
    @abstractmethod
    def parameters(self) -> tuple[float, ...]:
        """Parameters of the gap law."""

    @property
    @abstractmethod
    def extent(self) -> Extent:
        """Size of the obstacle."""

    @abstractmethod
    def outline(self) -> np.ndarray:
        """Return points of the surface [mm].

        These are a closed polygon in the plane, ``(k, 2)``, or one point of a half-plane; in space a grid,
        ``(u, v, 3)``.
        """

    @property
    def surface(self) -> np.ndarray:
        """Points of the surface, ``(k, 2)`` [mm], for shapes whose gap is no exact distance; empty for others."""
        return np.empty((0, self.space))

    def shifted(self, by: Iterable[float]) -> Self:
        """Return the obstacle moved by a shift [mm].

        Raises:
            ValueError: If the shift is not as many finite numbers as there are dimensions.
        """
        shift = check_point("by", by, self.space)
        moved: dict[str, Any] = {name: _sum(getattr(self, name), shift) for name in self.point_fields}
        return replace(self, **moved)  # fields of the subclass

    def moved_towards(self, other: Self, part: float) -> Self:
        """Return the obstacle part of its way to another, its points and sizes in proportion.

        Raises:
            ValueError: If the other is not this one shifted, with other sizes or not.
        """
        self.check_motion(other)
        names = self._moving_names()
        return replace(self, **{name: _mix(getattr(self, name), getattr(other, name), part) for name in names})

    def check_motion(self, other: object) -> float:
        """Return a bound on how far the surface is from that of another, which must be a motion of this one [mm].

        Raises:
            ValueError: As :meth:`moved_towards`.
        """
        names = self._moving_names()
        same = type(other) is type(self) and replace(self, **{name: getattr(other, name) for name in names}) == other
        if not (same and isinstance(other, Obstacle) and self._is_shift(other)):
            raise ValueError(
                f"{shown(other)} is no motion of {shown(self)}: within a step an obstacle may shift and change its "
                "sizes, but not turn or become another; begin at rest in the new scene"
            )
        sizes = zip(self._radii(), other._radii(), strict=True)
        return math.dist(self._points()[0][1], other._points()[0][1]) + sum(abs(b - a) for (_, a), (_, b) in sizes)

    def _is_shift(self, other: "Obstacle") -> bool:
        """Return whether all points of another are those of this one shifted alike, but for rounding."""
        points, others = (np.array([point for _, point in obstacle._points()]) for obstacle in (self, other))
        if points.shape != others.shape:
            return False
        shifts = others - points
        return bool(np.abs(shifts - shifts[0]).max() <= SHIFT_ROUNDING * np.abs([points, others]).max())

    def _moving_names(self) -> tuple[str, ...]:
        return self.moving_fields or (*self.point_fields, *self.size_fields)

    def check_proportion(self, length_mm: float) -> None:
        """Check that the obstacle is not too far, too large or too sharp for a robot of some length.

        Raises:
            ValueError: Naming the value and the bound.
        """
        length_mm = check_positive("length_mm", length_mm)
        largest, smallest = FARTHEST * length_mm, SHARPEST * length_mm
        for name, point in self._points():
            distance = math.hypot(*point)
            if distance > largest:
                raise self._too_large(f"{name} of {shown(self)} is {distance:.6g} mm from the base", largest)
        for name, size in self._radii():
            if size > largest:
                raise self._too_large(f"{name} of {shown(self)} is {size:.6g} mm", largest)
            if size < smallest:
                raise ValueError(
                    f"{name} of {shown(self)} is {size:.6g} mm; it must be at least {smallest:.6g} mm, {SHARPEST:g} of "
                    "the robot's longest length: round it more"
                )

    @staticmethod
    def _too_large(what: str, largest: float) -> ValueError:
        return ValueError(
            f"{what}, beyond {largest:.6g} mm, {FARTHEST:g} times the robot's longest length, or rounding of its gap "
            "would exceed the solver's tolerance; use a HalfPlane, in space a HalfSpace, for a wall, or leave out what "
            "the robot cannot reach"
        )

    def _points(self) -> list[tuple[str, Point]]:
        """Return its points with their names."""
        return [(name, getattr(self, name)) for name in self.point_fields]

    def _radii(self) -> list[tuple[str, float]]:
        """Return its radii and sizes with their names."""
        return [(name, getattr(self, name)) for name in self.size_fields]

    def touchable(self, nodes: int) -> np.ndarray:
        """Return which of the nodes 0…n can touch it, ``(nodes,)`` bool.

        Raises:
            ValueError: If a named node does not exist.
        """
        nodes = check_whole("nodes", nodes, 1, MAX_NODES)
        if self.nodes is None:
            return np.ones(nodes, dtype=bool)
        if max(self.nodes) >= nodes:
            raise ValueError(
                f"{type(self).__name__} names node {max(self.nodes)}; the robot's nodes are 0 to {nodes - 1}"
            )
        return np.asarray(np.isin(np.arange(nodes), self.nodes))

    def gap(self, points: np.ndarray) -> np.ndarray:
        """Return the gaps of points ``(..., 2)``, in space ``(..., 3)`` [mm]; positive outside.

        Raises:
            ValueError: If the points are not finite or not of its space.
        """
        return self.measure(check_points(points, self.space))[..., 0]

    def normal_at(self, points: np.ndarray) -> np.ndarray:
        """Return the gradient of the gap at points, on the surface the outward unit normal, in their shape.

        Raises:
            ValueError: If the points are not finite or not of its space.
        """
        return self.measure(check_points(points, self.space))[..., 1:]

    def measure(self, points: np.ndarray) -> np.ndarray:
        """Return gap and gradient at points, a contiguous array of floats that is not checked, ``(..., d + 1)``."""
        gaps = np.empty((*points.shape[:-1], self.space + 1))
        measure = _kernel.measure_gaps if self.space == 2 else _kernel.measure_spatial_gaps
        measure(SHAPES[self.kind], np.array(self.parameters), points, gaps)
        return gaps


def _mix(start: Any, end: Any, part: float) -> Any:
    """Return a number, or nested tuples of them, part of the way to another, as the kernel does."""
    if isinstance(start, tuple):
        return tuple(_mix(a, b, part) for a, b in zip(start, end, strict=True))
    return end if part == 1 or start == end else start + part * (end - start)


def _sum(point: Point, shift: Point) -> Point:
    """Return a point moved by a shift."""
    return tuple(a + b for a, b in zip(point, shift, strict=True))


def _check_nodes(nodes: object) -> tuple[int, ...]:
    bound = "a tuple of node indices, (14,) for one; it must name at least one node, each once, from 0"
    try:
        entries = check_sequence("nodes", nodes, bound)
        indices = tuple(check_whole("a node", node, 0, MAX_NODES - 1) for node in entries)
    except ValueError as error:
        raise refusal("nodes", nodes, f"{bound} to {MAX_NODES - 1}") from error
    if not indices or len(set(indices)) != len(indices):
        raise refusal("nodes", nodes, bound)
    return indices
