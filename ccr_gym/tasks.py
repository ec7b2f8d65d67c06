"""What an episode asks: the obstacles and the force to push them with."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from solver import Circle, HalfPlane, Robot, Scene
from solver.batch import BatchSolver

MAX_DRAWS = 1000
PROBE_MM = 0.5  # cable displacement between the equilibria of a trial pull


class Assignment(NamedTuple):
    """One episode's task: its scene and the force set-point [N]."""

    scene: Scene
    desired_force: float


class Task(Protocol):
    """A distribution over assignments.

    Attributes:
        obstacles: Number of obstacles of every scene.
    """

    obstacles: ClassVar[int]

    def draw(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """A scene and a desired force."""


@dataclass(frozen=True, slots=True)
class LoadCell:
    """The paper's experiment (Fig. 8–10): a flat load cell beside the robot that only its 15th node meets (eq. 12).

    Attributes:
        distance_mm: Range of the load cell's distance d from the unactuated backbone [mm].
        height_mm: Its height above the base [mm].
        force_n: Range of the desired force [N].
    """

    obstacles: ClassVar[int] = 1

    distance_mm: tuple[float, float] = (24.0, 51.0)
    height_mm: float = 127.0
    force_n: tuple[float, float] = (0.01, 0.06)

    def draw(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """A scene and a desired force."""
        node = round(14 / 18 * robot.segments)
        distance, force = uniform(generator, self.distance_mm, self.force_n)
        wall = HalfPlane(point=(distance, self.height_mm), normal=(-1.0, 0.0), nodes=(node,))
        return Assignment(Scene([wall]), force)


@dataclass(frozen=True, slots=True)
class PushObstacle:
    """A circular obstacle somewhere in front of the robot.

    Attributes:
        x_mm: Range of its centre's x [mm].
        y_mm: Range of its centre's y [mm].
        radius_mm: Range of its radius [mm].
        force_n: Range of the desired force [N].
    """

    obstacles: ClassVar[int] = 1

    x_mm: tuple[float, float] = (35.0, 75.0)
    y_mm: tuple[float, float] = (75.0, 150.0)
    radius_mm: tuple[float, float] = (10.0, 16.0)
    force_n: tuple[float, float] = (0.02, 0.15)

    def draw(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """A scene and a desired force."""
        x, y, radius, force = uniform(generator, self.x_mm, self.y_mm, self.radius_mm, self.force_n)
        return Assignment(Scene([Circle(center=(x, y), radius=radius)]), force)


def uniform(generator: np.random.Generator, *ranges: tuple[float, float]) -> list[float]:
    """A number from each of some ranges, all in one draw."""
    return [
        low + part * (high - low)
        for part, (low, high) in zip(generator.random(len(ranges)).tolist(), ranges, strict=True)
    ]


def assign(
    task: Task,
    solver: BatchSolver,
    robots: Sequence[int],
    generators: Sequence[np.random.Generator],
    cable_limit_mm: float,
    desired: np.ndarray,
) -> None:
    """Give some robots scenes and desired forces, each drawn by its own generator.

    Draws again until the force can be reached by pulling steadily, without a stall, jam or snap on the way.

    Args:
        task: Where scenes and forces are drawn from.
        solver: The robots; those named are assigned to their scenes.
        robots: Which.
        generators: One for each of them.
        cable_limit_mm: Largest cable displacement that may be needed [mm].
        desired: Desired force of every robot of the solver, written in place, ``(N,)`` [N].

    Raises:
        RuntimeError: If no draw of many is feasible: the task and the robot do not fit.
    """
    waiting = list(zip(robots, generators, strict=True))
    for _ in range(MAX_DRAWS):
        for robot, generator in waiting:
            scene, desired[robot] = task.draw(solver.robot, generator)
            solver.assign(robot, scene)
        names = [robot for robot, _ in waiting]
        found = solver.reaches(names, desired[names], PROBE_MM, cable_limit_mm)
        waiting = [pair for pair, reached in zip(waiting, found, strict=True) if not reached]
        if not waiting:
            return
    raise RuntimeError(
        f"none of {MAX_DRAWS} draws of {task} can be pushed as desired within {cable_limit_mm} mm of cable; "
        "widen the task's ranges or the cable limit"
    )
