"""The obstacles a robot is among."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from solver.obstacles import Obstacle

MAX_OBSTACLES = 32


@dataclass(frozen=True, slots=True)
class Scene:
    """An ordered set of obstacles; their order is the order of multipliers, gaps and contact flags.

    Attributes:
        obstacles: The obstacles; any iterable is taken.

    Raises:
        TypeError: If an entry is not an obstacle.
        ValueError: If there are more than 32.
    """

    obstacles: tuple[Obstacle, ...]

    def __init__(self, obstacles: Iterable[Obstacle] = ()) -> None:
        object.__setattr__(self, "obstacles", tuple(obstacles))
        if len(self.obstacles) > MAX_OBSTACLES:
            raise ValueError(f"obstacles has {len(self.obstacles)} entries; a scene holds at most {MAX_OBSTACLES}")
        for obstacle in self.obstacles:
            if not isinstance(obstacle, Obstacle):
                raise TypeError(
                    f"{obstacle!r} is not an obstacle; give a Circle, HalfPlane, Ellipse, Capsule or Polygon"
                )

    def __len__(self) -> int:
        return len(self.obstacles)

    def __iter__(self) -> Iterator[Obstacle]:
        return iter(self.obstacles)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Names of the gap laws, in order."""
        return tuple(obstacle.kind for obstacle in self.obstacles)
