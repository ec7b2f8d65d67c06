"""What an episode asks: the obstacles and the force to push them with."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from solver import Circle, HalfPlane, Robot, Scene, Solver, Status
from solver.forces import force_true
from solver.free import clearance

MAX_DRAWS = 1000
PROBE_MM = 0.5  # cable displacement between the equilibria of a trial pull


class Assignment(NamedTuple):
    """One episode's task: a solver of its scene and the force set-point [N]."""

    solver: Solver
    desired_force: float


class Task(Protocol):
    """A distribution over assignments."""

    def draw(self, robot: Robot, generator: np.random.Generator) -> tuple[Scene, float]:
        """A scene and a desired force [N]."""


@dataclass(frozen=True, slots=True)
class LoadCell:
    """The paper's experiment (Fig. 8–10): a flat load cell beside the robot that only its 15th node meets (eq. 12).

    Attributes:
        distance_mm: Range of the load cell's distance d from the unactuated backbone [mm].
        height_mm: Its height above the base [mm].
        force_n: Range of the desired force [N].
    """

    distance_mm: tuple[float, float] = (24.0, 51.0)
    height_mm: float = 127.0
    force_n: tuple[float, float] = (0.01, 0.06)

    def draw(self, robot: Robot, generator: np.random.Generator) -> tuple[Scene, float]:
        """A scene and a desired force [N]."""
        node = round(14 / 18 * robot.segments)
        distance = generator.uniform(*self.distance_mm)
        wall = HalfPlane(point=(distance, self.height_mm), normal=(-1.0, 0.0), nodes=(node,))
        return Scene([wall]), generator.uniform(*self.force_n)


@dataclass(frozen=True, slots=True)
class PushObstacle:
    """A circular obstacle somewhere in front of the robot.

    Attributes:
        x_mm: Range of its centre's x [mm].
        y_mm: Range of its centre's y [mm].
        radius_mm: Range of its radius [mm].
        force_n: Range of the desired force [N].
    """

    x_mm: tuple[float, float] = (35.0, 75.0)
    y_mm: tuple[float, float] = (75.0, 150.0)
    radius_mm: tuple[float, float] = (10.0, 16.0)
    force_n: tuple[float, float] = (0.02, 0.15)

    def draw(self, robot: Robot, generator: np.random.Generator) -> tuple[Scene, float]:
        """A scene and a desired force [N]."""
        x, y = generator.uniform(*self.x_mm), generator.uniform(*self.y_mm)
        circle = Circle(center=(x, y), radius=generator.uniform(*self.radius_mm))
        return Scene([circle]), generator.uniform(*self.force_n)


def assign(task: Task, robot: Robot, cable_limit_mm: float, generator: np.random.Generator) -> Assignment:
    """Draw until the desired force can be reached by pulling steadily, without a stall, jam or snap on the way.

    Raises:
        RuntimeError: If no draw of many is feasible: the task and the robot do not fit.
    """
    for _ in range(MAX_DRAWS):
        scene, force = task.draw(robot, generator)
        if clearance(robot, scene, 0.0) <= 0:
            continue
        solver = Solver(robot, scene)
        if _reachable(solver, force, cable_limit_mm):
            return Assignment(solver, force)
    raise RuntimeError(
        f"none of {MAX_DRAWS} draws of {task} can be pushed as desired within {cable_limit_mm} mm of cable; "
        "widen the task's ranges or the cable limit"
    )


def _reachable(solver: Solver, force: float, cable_limit_mm: float) -> bool:
    equilibrium = solver.rest()
    for cable in np.arange(PROBE_MM, cable_limit_mm, PROBE_MM):
        equilibrium = solver.step(equilibrium, float(cable))
        if equilibrium.status is not Status.CONVERGED:
            return False
        if equilibrium.contact.any() and np.linalg.norm(force_true(equilibrium).sum(axis=0)) >= force:
            return True
    return False
