"""The base class of all obstacles, and how large one is."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from solver import _kernel
from solver.common.gap_laws import GapLaw
from solver.common.validation import Matrix, Point, check_points, point, positive, sequence, shown, spring, whole

SHAPES = {shape.name.lower(): shape for shape in _kernel.Shape}
FARTHEST = 100.0  # place or size of an obstacle, over the robot's longest length
MAX_NODES = 4097  # of a robot
SHARPEST = 1e-9  # smallest radius of an obstacle's surface, over that length


class Extent(NamedTuple):
    """How large an obstacle is.

    Attributes:
        center: Centre of a disc or ball that holds it [mm].
        radius: Radius of that disc [mm]; infinite for a wall.
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
        nodes: Node indices (base = 0) that can touch it; ``None`` for all.
        spring: Stiffness of the spring it is mounted on, which lets it shift but not turn [N/mm]: one number, or a
            symmetric matrix, in the plane ``((kxx, kxy), (kxy, kyy))``, kept as that. ``None`` for a fixed obstacle.

    Raises:
        ValueError: If a node index is negative or repeated, or the spring's stiffness is not positive definite.
    """

    space: ClassVar[int] = 2  # dimension of its points
    places: ClassVar[tuple[str, ...]] = ("center",)  # fields that are points, and move with it
    lengths: ClassVar[tuple[str, ...]] = ("radius",)  # fields that are radii or sizes

    nodes: tuple[int, ...] | None = None
    spring: float | Matrix | None = None

    def __post_init__(self) -> None:
        if self.spring is not None:
            object.__setattr__(self, "spring", spring("spring", self.spring, self.space))
        if self.nodes is not None:
            object.__setattr__(self, "nodes", _nodes(self.nodes))
        for name in self.places:
            object.__setattr__(self, name, point(name, getattr(self, name), self.space))
        for name in self.lengths:
            object.__setattr__(self, name, positive(name, getattr(self, name)))

    @property
    @abstractmethod
    def law(self) -> GapLaw:
        """The law of its gap."""

    @property
    def kind(self) -> str:
        """Name of its gap law."""
        return self.law.kind

    @property
    def spring_matrix(self) -> np.ndarray:
        """``spring`` as an array ``(2, 2)``, in space ``(3, 3)`` [N/mm], zero for a fixed obstacle."""
        return np.zeros((self.space, self.space)) if self.spring is None else np.array(self.spring)

    @property
    @abstractmethod
    def parameters(self) -> tuple[float, ...]:
        """Its shape as the gap law in :mod:`solver.planar.formulation` takes it."""

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

    def shifted(self, by: Iterable[float]) -> Self:
        """The same obstacle elsewhere, by a shift [mm].

        Raises:
            ValueError: If the shift is not as many finite numbers as there are dimensions.
        """
        shift = point("by", by, self.space)
        places: dict[str, Any] = {name: plus(getattr(self, name), shift) for name in self.places}
        return replace(self, **places)

    def check_proportion(self, length_mm: float) -> None:
        """Refuse an obstacle too far from a robot of some length, or too large or too sharp beside it.

        Raises:
            ValueError: Naming the value and the bound.
        """
        largest, smallest = FARTHEST * length_mm, SHARPEST * length_mm
        remedy = (
            f"{largest:.6g} mm, {FARTHEST:g} times the robot's longest length, or rounding of its gap would exceed the "
            "solver's tolerance; use a HalfPlane, in space a HalfSpace, for a wall, or leave out what the robot cannot "
            "reach"
        )
        for name, place in self._points():
            if math.hypot(*place) > largest:
                raise ValueError(
                    f"{name} of {shown(self)} is {math.hypot(*place):.6g} mm from the base, beyond {remedy}"
                )
        for name, size in self._radii():
            if size > largest:
                raise ValueError(f"{name} of {shown(self)} is {size:.6g} mm, beyond {remedy}")
            if size < smallest:
                raise ValueError(
                    f"{name} of {shown(self)} is {size:.6g} mm; it must be at least {smallest:.6g} mm, {SHARPEST:g} of "
                    "the robot's longest length: round it more"
                )

    def _points(self) -> list[tuple[str, Point]]:
        """Its points and their names."""
        return [(name, getattr(self, name)) for name in self.places]

    def _radii(self) -> list[tuple[str, float]]:
        """Its radii and sizes and their names."""
        return [(name, getattr(self, name)) for name in self.lengths]

    def touchable(self, nodes: int) -> np.ndarray:
        """Which of the nodes 0…n can touch it, ``(nodes,)`` bool.

        Raises:
            ValueError: If a named node does not exist.
        """
        nodes = whole("nodes", nodes, 1, MAX_NODES)
        if self.nodes is None:
            return np.ones(nodes, dtype=bool)
        if max(self.nodes) >= nodes:
            raise ValueError(
                f"{type(self).__name__} names node {max(self.nodes)}; the robot's nodes are 0 to {nodes - 1}"
            )
        return np.asarray(np.isin(np.arange(nodes), self.nodes))

    def gap(self, points: np.ndarray) -> np.ndarray:
        """Gaps of points ``(..., 2)``, in space ``(..., 3)`` [mm]; positive outside.

        Raises:
            ValueError: If they are not finite or not of its space.
        """
        return self.measure(check_points(points, self.space))[..., 0]

    def normal_at(self, points: np.ndarray) -> np.ndarray:
        """Gradient of the gap at points, the outward unit normal on the surface, shaped as they are.

        Raises:
            ValueError: If they are not finite or not of its space.
        """
        return self.measure(check_points(points, self.space))[..., 1:]

    def measure(self, points: np.ndarray) -> np.ndarray:
        """Gap and gradient at points that need no check, a contiguous array of floats, ``(..., d + 1)``."""
        gaps = np.empty((*points.shape[:-1], self.space + 1))
        measure = _kernel.measure_gaps if self.space == 2 else _kernel.measure_spatial_gaps
        measure(SHAPES[self.kind], np.array(self.parameters), points, gaps)
        return gaps


def plus(place: Point, shift: Point) -> Point:
    """A point moved by a shift."""
    return tuple(a + b for a, b in zip(place, shift, strict=True))


def _nodes(nodes: Any) -> tuple[int, ...]:
    wanted = "a tuple of node indices, (14,) for one; it must name at least one node, each once, from 0"
    try:
        indices = tuple(whole("a node", node, 0, MAX_NODES - 1) for node in sequence("nodes", nodes, wanted))
    except ValueError as error:
        raise ValueError(f"nodes is {shown(nodes)}; it must be {wanted} to {MAX_NODES - 1}") from error
    if not indices or len(set(indices)) != len(indices):
        raise ValueError(f"nodes is {shown(nodes)}; it must be {wanted}")
    return indices
