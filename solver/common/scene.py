"""The obstacles around a robot."""

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np

from solver.common.gap_laws import GapLaw
from solver.common.obstacle import Obstacle
from solver.common.validation import shown

MAX_OBSTACLES = 32


@dataclass(frozen=True, slots=True)
class Scene:
    """An ordered set of obstacles; their order is that of multipliers, gaps and contact flags.

    Attributes:
        obstacles: The obstacles; any iterable is accepted.

    Raises:
        TypeError: If an entry is not an obstacle.
        ValueError: If there are more than 32, or some of the plane and some of space.
    """

    obstacles: tuple[Obstacle, ...]

    def __init__(self, obstacles: Iterable[Obstacle] = ()) -> None:
        listed = type(obstacles) is list or type(obstacles) is tuple
        if not listed and (isinstance(obstacles, Obstacle) or not isinstance(obstacles, Iterable)):
            raise TypeError(f"obstacles is {shown(obstacles)}; give a list of obstacles, [] for none")
        object.__setattr__(self, "obstacles", tuple(itertools.islice(obstacles, MAX_OBSTACLES + 1)))
        if len(self.obstacles) > MAX_OBSTACLES:
            raise ValueError(f"obstacles has more than {MAX_OBSTACLES} entries; a scene holds at most {MAX_OBSTACLES}")
        for obstacle in self.obstacles:
            if not isinstance(obstacle, Obstacle):
                raise TypeError(
                    f"an entry of obstacles is {shown(obstacle)}; give a Circle, HalfPlane, Ellipse, Capsule, "
                    "Polygon or Custom, or in space one of solver.spatial"
                )
        if len(self.obstacles) > 1 and len({obstacle.space for obstacle in self.obstacles}) > 1:
            raise ValueError(
                "obstacles has some of the plane and some of space; a scene holds either, solver's or solver.spatial's"
            )

    def __len__(self) -> int:
        return len(self.obstacles)

    def __iter__(self) -> Iterator[Obstacle]:
        return iter(self.obstacles)

    def moved_towards(self, other: Self, part: float) -> Self:
        """Return the scene part of its way to another, all obstacles moved in proportion.

        Raises:
            ValueError: As :meth:`check_motion`.
        """
        self.check_motion(other)
        if part == 1:
            return other
        return type(self)(a.moved_towards(b, part) for a, b in zip(self, other, strict=True))

    def check_motion(self, other: Self) -> list[float]:
        """Return bounds on how far the surface of each obstacle is from that in another scene [mm].

        Raises:
            ValueError: If an obstacle of the other scene is not that of this one shifted, with other sizes or not.
        """
        if len(other) != len(self):
            raise ValueError(f"the scene moves to one of {len(other)} obstacles; it must keep its {len(self)}")
        return [a.check_motion(b) for a, b in zip(self, other, strict=True)]

    @property
    def mounted(self) -> tuple[bool, ...]:
        """Which obstacles are on springs, in order."""
        return tuple(obstacle.spring is not None for obstacle in self.obstacles)

    @property
    def parameters(self) -> tuple[float, ...]:
        """Shapes of all obstacles, then (kxx, kxy, kyy) of every obstacle on a spring [N/mm]; in space six numbers."""
        shapes = [value for obstacle in self.obstacles for value in obstacle.parameters]
        springs = [o.spring_matrix[np.triu_indices(o.space)] for o in self.obstacles if o.spring]
        return (*shapes, *np.ravel(springs).tolist())

    @property
    def laws(self) -> tuple[GapLaw, ...]:
        """Gap laws of the obstacles, in order."""
        return tuple(obstacle.law for obstacle in self.obstacles)
