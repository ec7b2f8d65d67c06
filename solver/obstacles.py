"""Obstacles of the plane, validated once."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

Pair = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Circle:
    """A fixed disc.

    Attributes:
        center: Its centre (x, y) [mm].
        radius: Its radius [mm].

    Raises:
        ValueError: If a value is not finite or the radius is not positive.
    """

    kind: ClassVar[str] = "circle"

    center: Pair
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", _pair("center", self.center))
        if not (math.isfinite(self.radius) and self.radius > 0):
            raise ValueError(f"radius is {self.radius}; it must be positive and finite")

    @property
    def parameters(self) -> tuple[float, float, float]:
        """(x, y, r), as the gap law takes them."""
        return (*self.center, self.radius)

    def touchable(self, nodes: int) -> np.ndarray:
        """Which of the nodes 0…n can touch it: all, ``(nodes,)`` bool."""
        return np.ones(nodes, dtype=bool)

    def gap(self, points: np.ndarray) -> np.ndarray:
        """Gaps of points ``(..., 2)`` [mm]; positive outside."""
        return np.asarray((((points - self.center) ** 2).sum(-1) - self.radius**2) / (2 * self.radius))

    def normal_at(self, point: np.ndarray) -> np.ndarray:
        """Gradient of the gap at a point, the outward unit normal on the surface, ``(2,)``."""
        return (point - self.center) / self.radius


@dataclass(frozen=True, slots=True, kw_only=True)
class HalfPlane:
    """A flat wall, or with ``nodes`` the paper's load cell (eq. 12), which only the named nodes meet.

    Attributes:
        point: A point (x, y) of its surface [mm].
        normal: Outward normal, from the wall towards the robot; normalised on construction.
        nodes: Node indices (base = 0) that can touch it; ``None`` for all.

    Raises:
        ValueError: If a value is not finite, the normal vanishes, or a node index is negative or repeated.
    """

    kind: ClassVar[str] = "half_plane"

    point: Pair
    normal: Pair
    nodes: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", _pair("point", self.point))
        x, y = _pair("normal", self.normal)
        size = math.hypot(x, y)
        if size == 0:
            raise ValueError("normal is (0, 0); give the direction from the wall towards the robot")
        object.__setattr__(self, "normal", (x / size, y / size))
        if self.nodes is not None:
            nodes = tuple(int(node) for node in self.nodes)
            if not nodes or min(nodes) < 0 or len(set(nodes)) != len(nodes):
                raise ValueError(f"nodes is {self.nodes}; it must name at least one node, each once, from 0")
            object.__setattr__(self, "nodes", nodes)

    @property
    def parameters(self) -> tuple[float, float, float]:
        """(nx, ny, offset), as the gap law takes them."""
        return (*self.normal, self.normal[0] * self.point[0] + self.normal[1] * self.point[1])

    def touchable(self, nodes: int) -> np.ndarray:
        """Which of the nodes 0…n can touch it, ``(nodes,)`` bool.

        Raises:
            ValueError: If a named node does not exist.
        """
        if self.nodes is None:
            return np.ones(nodes, dtype=bool)
        if max(self.nodes) >= nodes:
            raise ValueError(f"HalfPlane names node {max(self.nodes)}; the robot's nodes are 0 to {nodes - 1}")
        return np.asarray(np.isin(np.arange(nodes), self.nodes))

    def gap(self, points: np.ndarray) -> np.ndarray:
        """Gaps of points ``(..., 2)`` [mm]; positive outside."""
        return np.asarray(points @ np.array(self.normal) - self.parameters[2])

    def normal_at(self, point: np.ndarray) -> np.ndarray:
        """Outward unit normal, the same everywhere, ``(2,)``."""
        return np.array(self.normal)


Obstacle = Circle | HalfPlane


def _pair(name: str, value: Pair) -> Pair:
    try:
        x, y = (float(v) for v in value)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} is {value!r}; it must be a pair (x, y) of numbers") from error
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError(f"{name} is {value}; it must be finite")
    return x, y
