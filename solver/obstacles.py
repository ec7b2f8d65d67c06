"""Obstacles of the plane, and what those of space share with them, validated once."""

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple, Self

import numpy as np

from solver import _kernel
from solver.formulation import CAPSULE, CIRCLE, ELLIPSE, HALF_PLANE, POLYGON, POLYGON_CORNERS, GapLaw
from solver.robot import require_positive

Pair = tuple[float, float]
Place = tuple[float, ...]
Matrix = tuple[Place, ...]

SHAPES = {kind: index for index, kind in enumerate(_kernel.SHAPES.split())}


class Extent(NamedTuple):
    """How large an obstacle is.

    Attributes:
        center: Centre of a disc or ball that holds it [mm].
        radius: Radius of that disc [mm]; infinite for a wall.
        inradius: Radius of the largest disc or ball inside it [mm]; infinite for a wall.
        fineness: Smallest radius of curvature of the surface [mm]; infinite for a wall.
    """

    center: Place
    radius: float
    inradius: float
    fineness: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle(ABC):
    """A convex obstacle, fixed or on a spring.

    Attributes:
        nodes: Node indices (base = 0) that can touch it; ``None`` for all.
        stiffness: Of the spring it is mounted on, which lets it shift but not turn [N/mm]: one number, or a symmetric
            matrix, in the plane ``((kxx, kxy), (kxy, kyy))``, kept as that. ``None`` for a fixed obstacle.

    Raises:
        ValueError: If a node index is negative or repeated, or the stiffness is not positive definite.
    """

    space: ClassVar[int] = 2  # dimension of its points

    nodes: tuple[int, ...] | None = None
    stiffness: float | Matrix | None = None

    def __post_init__(self) -> None:
        if self.stiffness is not None:
            object.__setattr__(self, "stiffness", _stiffness(self.stiffness, self.space))
        if self.nodes is not None:
            nodes = tuple(int(node) for node in self.nodes)
            if not nodes or min(nodes) < 0 or len(set(nodes)) != len(nodes):
                raise ValueError(f"nodes is {self.nodes}; it must name at least one node, each once, from 0")
            object.__setattr__(self, "nodes", nodes)

    @property
    @abstractmethod
    def law(self) -> GapLaw:
        """The law of its gap."""

    @property
    def kind(self) -> str:
        """Name of its gap law."""
        return self.law.kind

    @property
    def stiffness_matrix(self) -> np.ndarray:
        """``stiffness`` as an array ``(2, 2)``, in space ``(3, 3)`` [N/mm], zero for a fixed obstacle."""
        return np.zeros((self.space, self.space)) if self.stiffness is None else np.array(self.stiffness)

    @property
    @abstractmethod
    def parameters(self) -> tuple[float, ...]:
        """Its shape as the gap law in :mod:`solver.formulation` takes it."""

    @property
    @abstractmethod
    def extent(self) -> Extent:
        """How large it is."""

    @abstractmethod
    def outline(self) -> np.ndarray:
        """Points of its surface [mm].

        In the plane a closed polygon, ``(k, 2)``, or the surface point of a half-plane; in space a grid, ``(u, v, 3)``.
        """

    @property
    def surface(self) -> np.ndarray:
        """Points of its surface where its gap is no distance, ``(k, 2)`` [mm]; none where it is one."""
        return np.empty((0, self.space))

    @abstractmethod
    def shifted(self, by: Iterable[float]) -> Self:
        """The same obstacle elsewhere, by a shift [mm]."""

    def touchable(self, nodes: int) -> np.ndarray:
        """Which of the nodes 0…n can touch it, ``(nodes,)`` bool.

        Raises:
            ValueError: If a named node does not exist.
        """
        if self.nodes is None:
            return np.ones(nodes, dtype=bool)
        if max(self.nodes) >= nodes:
            raise ValueError(
                f"{type(self).__name__} names node {max(self.nodes)}; the robot's nodes are 0 to {nodes - 1}"
            )
        return np.asarray(np.isin(np.arange(nodes), self.nodes))

    def gap(self, points: np.ndarray) -> np.ndarray:
        """Gaps of points ``(..., 2)``, in space ``(..., 3)`` [mm]; positive outside."""
        return self._law(points)[..., 0]

    def normal_at(self, point: np.ndarray) -> np.ndarray:
        """Gradient of the gap at points, the outward unit normal on the surface, shaped as they are."""
        return self._law(point)[..., 1:]

    def _law(self, points: np.ndarray) -> np.ndarray:
        points = np.ascontiguousarray(points, dtype=float)
        gaps = np.empty((*points.shape[:-1], self.space + 1))
        measure = _kernel.measure_gaps if self.space == 2 else _kernel.measure_spatial_gaps
        measure(SHAPES[self.kind], np.array(self.parameters), points, gaps)
        return gaps


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

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        object.__setattr__(self, "center", pair("center", self.center))
        require_positive("radius", self.radius)

    @property
    def parameters(self) -> tuple[float, ...]:
        """(x, y, r)."""
        return (*self.center, self.radius)

    @property
    def extent(self) -> Extent:
        """The disc itself."""
        return Extent(self.center, self.radius, self.radius, self.radius)

    def shifted(self, by: Iterable[float]) -> Self:
        """The circle elsewhere."""
        return replace(self, center=plus(self.center, by))

    def outline(self) -> np.ndarray:
        """Points of the circle, ``(k, 2)`` [mm]."""
        return np.array(self.center) + self.radius * directions()


@dataclass(frozen=True, slots=True, kw_only=True)
class HalfPlane(Obstacle):
    """A flat wall, or with ``nodes`` the paper's load cell (eq. 12), which only the named nodes meet.

    Attributes:
        point: A point (x, y) of its surface [mm].
        normal: Outward normal, from the wall towards the robot; normalised on construction.

    Raises:
        ValueError: If a value is not finite, the normal vanishes, or a node index is negative or repeated.
    """

    law: ClassVar[GapLaw] = HALF_PLANE

    point: Pair
    normal: Pair

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        object.__setattr__(self, "point", pair("point", self.point))
        object.__setattr__(self, "normal", unit("normal", self.normal, "from the wall towards the robot"))

    @property
    def parameters(self) -> tuple[float, ...]:
        """(nx, ny, offset)."""
        return (*self.normal, self.normal[0] * self.point[0] + self.normal[1] * self.point[1])

    @property
    def extent(self) -> Extent:
        """Without bounds, and flat."""
        return Extent(self.point, math.inf, math.inf, math.inf)

    def shifted(self, by: Iterable[float]) -> Self:
        """The wall elsewhere."""
        return replace(self, point=plus(self.point, by))

    def outline(self) -> np.ndarray:
        """The point of the surface, ``(1, 2)`` [mm]."""
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

    center: Pair
    radii: Pair
    axis: Pair = (1.0, 0.0)

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        object.__setattr__(self, "center", pair("center", self.center))
        object.__setattr__(self, "radii", pair("radii", self.radii))
        object.__setattr__(self, "axis", unit("axis", self.axis, "of the first half-axis"))
        for radius in self.radii:
            require_positive("a half-axis of radii", radius)

    @property
    def parameters(self) -> tuple[float, ...]:
        """(x, y, a, b, ux, uy)."""
        return (*self.center, *self.radii, *self.axis)

    @property
    def extent(self) -> Extent:
        """The disc of the larger half-axis, and the curvature at its end."""
        small, large = sorted(self.radii)
        return Extent(self.center, large, small, small**2 / large)

    @property
    def surface(self) -> np.ndarray:
        """Points of its surface, ``(k, 2)`` [mm]."""
        return self.outline()

    def shifted(self, by: Iterable[float]) -> Self:
        """The ellipse elsewhere."""
        return replace(self, center=plus(self.center, by))

    def outline(self) -> np.ndarray:
        """Points of the ellipse, ``(k, 2)`` [mm]."""
        x, y = self.axis
        return np.asarray(self.center + directions() * self.radii @ np.array([[x, y], [-y, x]]))


@dataclass(frozen=True, slots=True, kw_only=True)
class Capsule(Obstacle):
    """All points within a radius of a line: a rod, a rounded bar.

    Attributes:
        start: One end (x, y) of the line [mm].
        end: Its other end [mm].
        radius: The radius [mm].

    Raises:
        ValueError: If a value is not finite, the radius is not positive, or the ends coincide.
    """

    law: ClassVar[GapLaw] = CAPSULE

    start: Pair
    end: Pair
    radius: float

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        object.__setattr__(self, "start", pair("start", self.start))
        object.__setattr__(self, "end", pair("end", self.end))
        require_positive("radius", self.radius)
        if self.start == self.end:
            raise ValueError(f"start and end are both {self.start}; they must differ (a Circle has one centre)")

    @property
    def parameters(self) -> tuple[float, ...]:
        """(x1, y1, x2, y2, r)."""
        return (*self.start, *self.end, self.radius)

    @property
    def extent(self) -> Extent:
        """The disc about the middle of the line."""
        middle = ((self.start[0] + self.end[0]) / 2, (self.start[1] + self.end[1]) / 2)
        return Extent(middle, math.dist(self.start, self.end) / 2 + self.radius, self.radius, self.radius)

    def shifted(self, by: Iterable[float]) -> Self:
        """The capsule elsewhere."""
        return replace(self, start=plus(self.start, by), end=plus(self.end, by))

    def outline(self) -> np.ndarray:
        """Points of its surface, ``(k, 2)`` [mm]."""
        return _rounded(np.array([self.start, self.end]), self.radius)


@dataclass(frozen=True, slots=True, kw_only=True)
class Polygon(Obstacle):
    """A convex polygon with rounded corners: all points within a radius of its core.

    Attributes:
        corners: Corners (x, y) of the core, 3 to 8, in either sense [mm]; kept counter-clockwise.
        radius: Radius of the corners, which also lies around the edges [mm].

    Raises:
        ValueError: If a value is not finite, the radius not positive, or the corners are too few, too many or not
            those of a convex polygon.
    """

    law: ClassVar[GapLaw] = POLYGON

    corners: tuple[Pair, ...]
    radius: float

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        corners = tuple(pair("a corner", corner) for corner in self.corners)
        if not 3 <= len(corners) <= POLYGON_CORNERS:
            raise ValueError(f"corners has {len(corners)} points; it must have 3 to {POLYGON_CORNERS}")
        turns = _turns(corners)
        if all(turn < 0 for turn in turns):
            corners, turns = corners[::-1], [-turn for turn in turns]
        if not (all(turn > 0 for turn in turns) and sum(turns) < 3 * math.pi):
            raise ValueError(f"corners is {self.corners}; they must go once round a convex polygon, none straight")
        object.__setattr__(self, "corners", corners)
        require_positive("radius", self.radius)

    @property
    def parameters(self) -> tuple[float, ...]:
        """(r, x1, y1, …), the last corner repeated to fill up."""
        filled = self.corners + (POLYGON_CORNERS - len(self.corners)) * self.corners[-1:]
        return (self.radius, *(value for corner in filled for value in corner))

    @property
    def extent(self) -> Extent:
        """The disc about the mean of the corners."""
        x, y = np.mean(self.corners, axis=0).tolist()
        farthest = max(math.dist((x, y), corner) for corner in self.corners)
        return Extent((x, y), farthest + self.radius, _inradius(np.array(self.corners)) + self.radius, self.radius)

    def shifted(self, by: Iterable[float]) -> Self:
        """The polygon elsewhere."""
        return replace(self, corners=tuple(plus(corner, by) for corner in self.corners))

    def outline(self) -> np.ndarray:
        """Points of its surface, ``(k, 2)`` [mm]."""
        return _rounded(np.array(self.corners), self.radius)


def place(name: str, value: Iterable[float], space: int = 2) -> Place:
    """As many finite numbers as the space has dimensions.

    Raises:
        ValueError: Naming what they are.
    """
    wanted = "a pair (x, y)" if space == 2 else "three coordinates (x, y, z)"
    try:
        numbers = tuple(float(v) for v in value)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} is {value!r}; it must be {wanted} of numbers") from error
    if len(numbers) != space:
        raise ValueError(f"{name} is {value!r}; it must be {wanted} of numbers")
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"{name} is {value}; it must be finite")
    return numbers


def pair(name: str, value: Iterable[float]) -> Pair:
    """Two finite numbers.

    Raises:
        ValueError: Naming what they are.
    """
    x, y = place(name, value)
    return x, y


def plus(point: Pair, by: Iterable[float]) -> Pair:
    """A point of the plane moved by a shift."""
    x, y = by
    return point[0] + float(x), point[1] + float(y)


def _stiffness(value: float | Matrix, space: int) -> Matrix:
    try:
        matrix = np.array(value, dtype=float)
        matrix = np.diag([matrix] * space) if matrix.ndim == 0 else matrix.reshape(space, space)
    except (TypeError, ValueError) as error:
        form = "((kxx, kxy), (kxy, kyy))" if space == 2 else "of three rows"
        raise ValueError(f"stiffness is {value!r}; it must be a number or a matrix {form}") from error
    sound = np.isfinite(matrix).all() and (matrix == matrix.T).all()
    if not (sound and np.linalg.eigvalsh(matrix)[0] > 0):
        raise ValueError(f"stiffness is {value}; it must be finite, symmetric and positive definite")
    return tuple(map(tuple, matrix.tolist()))


def unit(name: str, value: Iterable[float], meaning: str) -> Pair:
    """A direction of the plane, normalised.

    Raises:
        ValueError: If it has none, naming what it is for.
    """
    x, y = direction(name, value, meaning)
    return x, y


def direction(name: str, value: Iterable[float], meaning: str, space: int = 2) -> Place:
    """A direction of the plane or of space, normalised.

    Raises:
        ValueError: If it has none, naming what it is for.
    """
    numbers = place(name, value, space)
    size = math.hypot(*numbers)
    if size == 0:
        raise ValueError(f"{name} is ({', '.join('0' * space)}); give the direction {meaning}")
    return tuple(number / size for number in numbers)


def _turns(corners: tuple[Pair, ...]) -> list[float]:
    """Angle turned at each corner, counter-clockwise positive [rad]."""
    edges = np.roll(corners, -1, axis=0) - np.asarray(corners)
    headings = np.arctan2(edges[:, 1], edges[:, 0])
    return list(np.remainder(headings - np.roll(headings, 1) + np.pi, 2 * np.pi) - np.pi)


def _inradius(corners: np.ndarray) -> float:
    """Radius of the largest disc in a convex polygon, corners counter-clockwise; it touches three of the edges [mm]."""
    edges = np.roll(corners, -1, axis=0) - corners
    inward = np.column_stack([-edges[:, 1], edges[:, 0]]) / np.linalg.norm(edges, axis=1)[:, None]
    offsets = (inward * corners).sum(axis=1)
    largest = 0.0
    for three in map(list, itertools.combinations(range(len(corners)), 3)):
        sides = np.column_stack([inward[three], -np.ones(3)])  # distance of the centre from each, less the radius
        if abs(np.linalg.det(sides)) > 1e-12:
            x, y, radius = np.linalg.solve(sides, offsets[three])
            if (inward @ (x, y) - offsets).min() >= radius * (1 - 1e-9):
                largest = max(largest, float(radius))
    return largest


def directions() -> np.ndarray:
    """Unit vectors once round, ``(96, 2)``."""
    angles = np.linspace(0, 2 * np.pi, 97)[:-1]
    return np.column_stack([np.cos(angles), np.sin(angles)])


def _rounded(core: np.ndarray, radius: float) -> np.ndarray:
    """Outline of everything within a radius of the polygon or line through some points, ``(k, 2)``."""
    around = directions()
    return np.asarray(core[(around @ core.T).argmax(axis=1)] + radius * around)
