"""Obstacles on their way to where they are dragged, and to the size they are given."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from solver import Obstacle, Scene

STEP = 0.04  # that an obstacle moves or grows in a tick at most [L]
RATIOS = (0.3, 3.0)  # of the size of an obstacle over that at the start
FARTHEST = 3.0  # of an obstacle from the base [L]
NEAR = 1e-9  # distance at which an obstacle has arrived [L]


class Dragging:
    """Targets of obstacles, which they reach in small steps, so that the robot follows and a tick stays short.

    Args:
        scene: The obstacles at the start.
        length_mm: Length of the robot [mm].

    Attributes:
        ratios: Size of each obstacle over that at the start, as last set.
        stops: How often obstacles were stopped; a page puts its handles back when this changes.
    """

    def __init__(self, scene: Scene, length_mm: float) -> None:
        self.ratios, self.stops = [1.0] * len(scene), 0
        self._start, self._length_mm = scene.obstacles, length_mm
        self._centers: dict[int, tuple[float, ...]] = {}
        self._sizes: dict[int, Obstacle] = {}

    @property
    def active(self) -> bool:
        """Whether an obstacle is on its way."""
        return bool(self._centers or self._sizes)

    def drag(self, index: int, center_mm: tuple[float, ...]) -> None:
        """Set where the middle of an obstacle moves to [mm].

        Raises:
            ValueError: If there is no such obstacle or point.
        """
        self._check(index)
        space = self._start[index].space
        if len(center_mm) != space or not all(map(math.isfinite, center_mm)):
            raise ValueError(f"the middle is {center_mm}; it must be {space} finite numbers")
        distance = math.hypot(*center_mm) / self._length_mm
        inward = min(1.0, FARTHEST / max(distance, FARTHEST))
        self._centers[index] = tuple(inward * value for value in center_mm)

    def resize(self, index: int, ratio: float) -> None:
        """Set the size of an obstacle over that at the start.

        Raises:
            ValueError: If there is no such obstacle, or the ratio is out of range.
        """
        self._check(index)
        low, high = RATIOS
        if not low <= ratio <= high:
            raise ValueError(f"the size is {ratio} times that at the start; it must be from {low} to {high}")
        start = self._start[index]
        self.ratios[index] = ratio
        self._sizes[index] = replace(start, **{name: ratio * getattr(start, name) for name in start.size_fields})

    def stop(self) -> None:
        """Let all obstacles stay where they are."""
        self._centers.clear()
        self._sizes.clear()
        self.stops += 1

    def next_scene(self, scene: Scene) -> Scene | None:
        """Return the scene part of its way to the targets, or None where all obstacles have arrived."""
        if not self.active:
            return None
        moved = Scene(self._next(index, obstacle) for index, obstacle in enumerate(scene))
        return None if moved == scene else moved

    def _next(self, index: int, obstacle: Obstacle) -> Obstacle:
        return self._resized(index, self._shifted(index, obstacle))

    def _shifted(self, index: int, obstacle: Obstacle) -> Obstacle:
        if index not in self._centers:
            return obstacle
        way = np.subtract(self._centers[index], obstacle.extent.center)
        size, most = float(np.linalg.norm(way)), STEP * self._length_mm
        if size <= most:
            del self._centers[index]
        if size <= NEAR * self._length_mm:
            return obstacle
        return obstacle.shifted((way * min(1.0, most / size)).tolist())

    def _resized(self, index: int, obstacle: Obstacle) -> Obstacle:
        if index not in self._sizes:
            return obstacle
        goal, most, sizes = self._sizes[index], STEP * self._length_mm, {}
        steps: dict[str, Any] = {name: getattr(goal, name) - getattr(obstacle, name) for name in obstacle.size_fields}
        part = min(1.0, most / max([abs(step) for step in steps.values()] + [1e-12 * most]))
        for name, step in steps.items():
            sizes[name] = getattr(goal, name) if part == 1 else getattr(obstacle, name) + part * step
        if part == 1:
            del self._sizes[index]
        return replace(obstacle, **sizes)

    def _check(self, index: int) -> None:
        if not 0 <= index < len(self._start):
            raise ValueError(f"obstacle {index} is out of range; the scene has {len(self._start)}")
