"""The obstacles a robot is among."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from solver.obstacles import Obstacle


@dataclass(frozen=True, slots=True)
class Scene:
    """An ordered set of obstacles; their order is the order of multipliers, gaps and contact flags.

    Attributes:
        obstacles: The obstacles; any iterable is taken.

    Raises:
        TypeError: If an entry is not an obstacle.
    """

    obstacles: tuple[Obstacle, ...]

    def __init__(self, obstacles: Iterable[Obstacle] = ()) -> None:
        object.__setattr__(self, "obstacles", tuple(obstacles))
        for obstacle in self.obstacles:
            if not isinstance(obstacle, Obstacle):
                raise TypeError(f"{obstacle!r} is not an obstacle; give Circle or HalfPlane")

    def __len__(self) -> int:
        return len(self.obstacles)

    def __iter__(self) -> Iterator[Obstacle]:
        return iter(self.obstacles)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Names of the gap laws, in order."""
        return tuple(obstacle.kind for obstacle in self.obstacles)
