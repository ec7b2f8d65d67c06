"""What an episode asks: the obstacles and the force to push them with."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from ccr_gym.bodies import IN_PLANE, IN_SPACE, Body
from solver import Circle, HalfPlane, Robot, Scene
from solver.batch import BaseBatch
from solver.spatial import Cylinder, SpatialRobot, Sphere

MAX_DRAWS = 1000
HALF_CYLINDER_MM = 30.0
PROBE_MM = 0.5  # cable displacement between the equilibria of a trial pull


class Assignment(NamedTuple):
    """One episode's task.

    Attributes:
        scene: The obstacles.
        desired_force: Set-point, the magnitude of the force on the robot or the force itself [N].
        pull: Displacements of the cables per millimetre of the steady pull that shows that it can be reached.
    """

    scene: Scene
    desired_force: float | np.ndarray
    pull: tuple[float, ...] = (1.0,)


class Task(Protocol):
    """A distribution over assignments.

    Attributes:
        body: The model of its robots.
        obstacles: Number of obstacles of every scene.
        force_vector: Whether the set-point is a vector: the force that the trial pull gets to.
    """

    body: ClassVar[Body]
    obstacles: ClassVar[int]

    @property
    def force_vector(self) -> bool:
        """As above."""

    def draw(self, robot: Any, generator: np.random.Generator) -> Assignment:
        """A scene and a desired force."""


@dataclass(frozen=True, slots=True)
class LoadCell:
    """The paper's experiment (Fig. 8–10): a flat load cell beside the robot that only its 15th node meets (eq. 12).

    Attributes:
        distance_mm: Range of the load cell's distance d from the unactuated backbone [mm].
        height_mm: Its height above the base [mm].
        force_n: Range of the desired force [N].
    """

    body: ClassVar[Body] = IN_PLANE
    obstacles: ClassVar[int] = 1
    force_vector: ClassVar[bool] = False

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

    body: ClassVar[Body] = IN_PLANE
    obstacles: ClassVar[int] = 1
    force_vector: ClassVar[bool] = False

    x_mm: tuple[float, float] = (35.0, 75.0)
    y_mm: tuple[float, float] = (75.0, 150.0)
    radius_mm: tuple[float, float] = (10.0, 16.0)
    force_n: tuple[float, float] = (0.02, 0.15)

    def draw(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """A scene and a desired force."""
        x, y, radius, force = uniform(generator, self.x_mm, self.y_mm, self.radius_mm, self.force_n)
        return Assignment(Scene([Circle(center=(x, y), radius=radius)]), force)


@dataclass(frozen=True, slots=True)
class SpatialPush:
    """A sphere or a cylinder somewhere around the robot.

    Attributes:
        distance_mm: Range of its centre's distance from the axis of the straight robot [mm].
        height_mm: Range of its centre's height above the base [mm].
        radius_mm: Range of its radius [mm].
        cylinders: Share of cylinders, which are 60 mm long and lie across the way of the robot.
        tilt: Largest angle of a cylinder's axis from the horizontal [rad].
        force_n: Range of the desired force [N].
        force_vector: Whether a force is asked for in magnitude and direction, instead of the magnitude alone.
        aside: Largest angle between the obstacle's direction and that of the pull whose force is asked for, with
            ``force_vector`` [rad].
    """

    body: ClassVar[Body] = IN_SPACE
    obstacles: ClassVar[int] = 1

    distance_mm: tuple[float, float] = (35.0, 65.0)
    height_mm: tuple[float, float] = (80.0, 150.0)
    radius_mm: tuple[float, float] = (10.0, 16.0)
    cylinders: float = 0.5
    tilt: float = math.pi / 6
    force_n: tuple[float, float] = (0.02, 0.15)
    force_vector: bool = False
    aside: float = 0.25

    def draw(self, robot: SpatialRobot, generator: np.random.Generator) -> Assignment:
        """A scene, a desired force, and a pull towards the obstacle."""
        ranges = (self.distance_mm, self.height_mm, self.radius_mm, self.force_n)
        distance, height, radius, force, azimuth, tilt, aside, kind = uniform(
            generator, *ranges, (-math.pi, math.pi), (-self.tilt, self.tilt), (-self.aside, self.aside), (0.0, 1.0)
        )
        outward = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
        center = distance * outward + [0.0, 0.0, height]
        half = HALF_CYLINDER_MM * np.array([-math.cos(tilt) * outward[1], math.cos(tilt) * outward[0], math.sin(tilt)])
        if kind < self.cylinders:
            start, end = (tuple((center + side * half).tolist()) for side in (-1, 1))
            scene = Scene([Cylinder(start=start, end=end, radius=radius, edge=2.0)])
        else:
            scene = Scene([Sphere(center=tuple(center.tolist()), radius=radius)])
        towards = azimuth + aside if self.force_vector else azimuth
        return Assignment(scene, force, (math.cos(towards), math.cos(towards - robot.angle)))


def uniform(generator: np.random.Generator, *ranges: tuple[float, float]) -> list[float]:
    """A number from each of some ranges, all in one draw."""
    return [
        low + part * (high - low)
        for part, (low, high) in zip(generator.random(len(ranges)).tolist(), ranges, strict=True)
    ]


def assign(
    task: Task,
    solver: BaseBatch,
    robots: Sequence[int],
    generators: Sequence[np.random.Generator],
    cable_limit_mm: float,
) -> np.ndarray:
    """Give some robots scenes and desired forces, each drawn by its own generator.

    Draws again until the force can be reached by pulling steadily, without a stall, jam or snap on the way.

    Args:
        task: Where scenes and forces are drawn from.
        solver: The robots; those named are assigned to their scenes.
        robots: Which.
        generators: One for each of them.
        cable_limit_mm: Largest cable displacement that may be needed [mm].

    Returns:
        Desired force of each, ``(k, 1)``, or ``(k, d)`` where a vector is asked for [N].

    Raises:
        RuntimeError: If no draw of many is feasible: the task and the robot do not fit.
    """
    desired = np.zeros((len(robots), solver.model.space if task.force_vector else 1))
    waiting = list(range(len(robots)))
    for _ in range(MAX_DRAWS):
        drawn = [task.draw(solver.robot, generators[k]) for k in waiting]
        for k, assignment in zip(waiting, drawn, strict=True):
            solver.assign(robots[k], assignment.scene)
        names = [robots[k] for k in waiting]
        forces = np.array([assignment.desired_force for assignment in drawn], float)
        pulls = np.array([assignment.pull for assignment in drawn])
        found, reached = solver.reaches(names, forces, PROBE_MM, cable_limit_mm, pulls)
        desired[waiting] = reached if task.force_vector else forces[:, None]
        waiting = [k for k, success in zip(waiting, found, strict=True) if not success]
        if not waiting:
            return desired
    raise RuntimeError(
        f"none of {MAX_DRAWS} draws of {task} can be pushed as desired within {cable_limit_mm} mm of cable; "
        "widen the task's ranges or the cable limit"
    )
