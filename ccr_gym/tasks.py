"""Tasks: what an episode asks, as distributions over obstacles and set-points."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import Field, dataclass, replace
from typing import Any, ClassVar, Generic, NamedTuple

import numpy as np

from ccr_gym.adapters import AnyAdapter, CableAdapter, InsertionAdapter, SpatialAdapter
from ccr_gym.checks import (
    check_fields,
    check_flag,
    check_instance,
    check_number,
    check_range,
    check_ranges,
    check_type,
    checked,
)
from ccr_gym.scales import FORCE_SCALE_N
from ccr_gym.settings import RobotT
from solver import Circle, HalfPlane, Robot, Scene
from solver.common.scene import MAX_OBSTACLES
from solver.common.validation import SMALLEST, check_whole
from solver.spatial import Cylinder, SpatialRobot, Sphere

Range = tuple[float, float]
MAX_STEPS = 2**31 - 1
PROFILE_STEPS = 128  # of a moving set-point
LEVELS = (0.3, 1.0)  # range of its levels, before they are scaled to a maximum of 1
HALF_CYLINDER_MM = 30.0
CYLINDER_EDGE_MM = 2.0
LEAST_FORCE_N, FORCE_REASON = 1e-6 * FORCE_SCALE_N, "what the observation can show, in N"
CIRCLE: tuple[dict[str, float], ...] = ({}, {}, {"low": SMALLEST})  # bounds of x, y and radius


def check_force_range(name: str, value: object) -> Range:
    """Return the range of the magnitude of a set-point [N]; see :func:`ccr_gym.checks.check_range`."""
    return check_range(name, value, low=LEAST_FORCE_N, high=FORCE_SCALE_N, reason=FORCE_REASON)


def check_force(name: str, value: object) -> float:
    """Return the magnitude of a set-point as a float [N].

    Raises:
        ValueError: If it is not a number that the observation can show.
    """
    return check_number(name, value, low=LEAST_FORCE_N, high=FORCE_SCALE_N, reason=FORCE_REASON)


class Assignment(NamedTuple):
    """Obstacles and set-point of one episode.

    Attributes:
        scene: The obstacles.
        desired_force: Set-point: the magnitude of the force on the robot, or the force itself ``(d,)`` [N].
        pull: Cable displacements per millimetre of the ramp that must reach the set-point, ``(cables,)``.
        profile: Factors of the set-point at every step, ``(PROFILE_STEPS,)``, the last one kept from then on; ``None``
            for a constant set-point.
    """

    scene: Scene
    desired_force: float | np.ndarray
    pull: tuple[float, ...] = (1.0,)
    profile: np.ndarray | None = None


class Task(ABC, Generic[RobotT]):
    """A distribution over assignments.

    Subclasses are frozen dataclasses whose fields are declared with :func:`ccr_gym.checks.checked`.

    Attributes:
        adapter: Adapter of its robots.
        obstacles: Number of obstacles of every scene.
        target: Index of the obstacle whose contact force is regulated; ``None`` for the sum over all.
        moving: Whether the set-point moves, and is previewed.
        steps: Steps of an episode.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[object]]]  # of its subclasses

    adapter: ClassVar[type[AnyAdapter]] = CableAdapter
    obstacles: ClassVar[int] = 1
    target: ClassVar[int | None] = None
    moving: ClassVar[bool] = False
    steps: ClassVar[int] = 64

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def force_vector(self) -> bool:
        """Whether the set-point is a force vector, the one that the ramp ends with, instead of a magnitude."""
        return False

    @abstractmethod
    def sample(self, robot: RobotT, generator: np.random.Generator) -> Assignment:
        """Return the assignment of an episode; it is sampled again if it turns out to be infeasible."""

    def narrowest_scenes(self) -> Sequence[Scene]:
        """Return scenes of the narrowest possible obstacles, which must not fit between the points of the robot."""
        return ()


AnyTask = Task[Any]  # samples for robots of its own adapter, whatever they are


@dataclass(frozen=True, slots=True)
class LoadCell(Task[Robot]):
    """The paper's experiment (Fig. 8–10): a flat load cell beside the robot that only its 15th node meets (eq. 12).

    Attributes:
        distance_mm: Range of the load cell's distance d from the unactuated backbone [mm].
        height_mm: Height of the load cell above the base [mm].
        force_n: Range of the set-point [N].
    """

    distance_mm: Range = checked((24.0, 51.0), check_range, low=SMALLEST)
    height_mm: float = checked(127.0, check_number)
    force_n: Range = checked((0.01, 0.06), check_force_range)

    def sample(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """Return a load cell and a set-point."""
        node = round(14 / 18 * robot.segments)
        distance, force = uniform(generator, self.distance_mm, self.force_n)
        wall = HalfPlane(point=(distance, self.height_mm), normal=(-1.0, 0.0), nodes=(node,))
        return Assignment(Scene([wall]), force)


@dataclass(frozen=True, slots=True)
class PushObstacle(Task[Robot]):
    """A circular obstacle somewhere in front of the robot.

    Attributes:
        x_mm: Range of its centre's x [mm].
        y_mm: Range of its centre's y [mm].
        radius_mm: Range of its radius [mm].
        force_n: Range of the set-point [N].
    """

    x_mm: Range = checked((35.0, 75.0), check_range)
    y_mm: Range = checked((75.0, 150.0), check_range)
    radius_mm: Range = checked((10.0, 16.0), check_range, low=SMALLEST)
    force_n: Range = checked((0.02, 0.15), check_force_range)

    def sample(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """Return a circle and a set-point."""
        x, y, radius, force = uniform(generator, self.x_mm, self.y_mm, self.radius_mm, self.force_n)
        return Assignment(Scene([Circle(center=(x, y), radius=radius)]), force)

    def narrowest_scenes(self) -> Sequence[Scene]:
        """Return the smallest circle."""
        return (Scene([_smallest_circle(self.x_mm, self.y_mm, self.radius_mm)]),)


@dataclass(frozen=True, slots=True)
class TrackForce(PushObstacle):
    """A circular obstacle, and a set-point that steps and swings and is previewed.

    Attributes:
        jumps: Number of level changes of the set-point in an episode.
        swing: Range of the amplitude of its swing, as a fraction of the level; below 1 to keep the set-point positive.
        period: Range of the period of its swing [steps].
    """

    moving: ClassVar[bool] = True
    steps: ClassVar[int] = PROFILE_STEPS

    jumps: int = checked(3, check_whole, low=0, high=PROFILE_STEPS)
    swing: Range = checked((0.1, 0.4), check_range, low=0, below=1)
    period: Range = checked((24.0, 64.0), check_range, low=1)

    def sample(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """Return a circle, the largest set-point of the episode, and its profile."""
        sampled = PushObstacle.sample(self, robot, generator)
        swing, period, phase, _ = uniform(generator, self.swing, self.period, (0.0, 2 * math.pi), (0.0, 1.0))
        times = np.sort(generator.uniform(0, PROFILE_STEPS, self.jumps))
        levels = generator.uniform(*LEVELS, self.jumps + 1)
        now = np.arange(PROFILE_STEPS)
        profile = levels[np.searchsorted(times, now)] * (1 + swing * np.sin(2 * math.pi * now / period + phase))
        return sampled._replace(profile=profile / profile.max())


@dataclass(frozen=True, slots=True)
class BracedPush(Task[Robot]):
    """Two circular obstacles, as in the paper's Fig. 4b: the robot braces on the lower one and pushes the upper one.

    Attributes:
        brace_mm: Ranges of x, y and radius of the lower one [mm].
        goal_mm: Ranges of x, y and radius of the upper one, whose contact force is regulated [mm].
        force_n: Range of the set-point [N].
    """

    obstacles: ClassVar[int] = 2
    target: ClassVar[int | None] = 1

    brace_mm: tuple[Range, ...] = checked(((27.0, 38.0), (75.0, 95.0), (10.0, 14.0)), check_ranges, bounds=CIRCLE)
    goal_mm: tuple[Range, ...] = checked(((52.0, 72.0), (125.0, 150.0), (12.0, 16.0)), check_ranges, bounds=CIRCLE)
    force_n: Range = checked((0.02, 0.12), check_force_range)

    def sample(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """Return two circles and a set-point."""
        x, y, radius, goal_x, goal_y, goal_radius, force = uniform(
            generator, *self.brace_mm, *self.goal_mm, self.force_n
        )
        goal = Circle(center=(goal_x, goal_y), radius=goal_radius)
        return Assignment(Scene([Circle(center=(x, y), radius=radius), goal]), force)

    def narrowest_scenes(self) -> Sequence[Scene]:
        """Return the smallest circles."""
        return (Scene([_smallest_circle(*self.brace_mm), _smallest_circle(*self.goal_mm)]),)


@dataclass(frozen=True, slots=True)
class SoftObstacle(PushObstacle):
    """A circular obstacle on a spring of unknown stiffness, which yields when pushed.

    Attributes:
        spring: Range of the spring's stiffness, sampled uniformly in its logarithm [N/mm].
    """

    spring: Range = checked((0.003, 0.1), check_range, low=SMALLEST)

    def sample(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """Return a circle on a spring and a set-point."""
        sampled = PushObstacle.sample(self, robot, generator)
        (exponent,) = uniform(generator, (math.log(self.spring[0]), math.log(self.spring[1])))
        return sampled._replace(scene=Scene(replace(o, spring=math.exp(exponent)) for o in sampled.scene))


@dataclass(frozen=True, slots=True)
class InsertAndPush(PushObstacle):
    """A circular obstacle, pushed with the cable and the insertion of the base."""

    adapter: ClassVar[type[AnyAdapter]] = InsertionAdapter

    y_mm: Range = checked((75.0, 130.0), check_range)


@dataclass(frozen=True, slots=True)
class SpatialPush(Task[SpatialRobot]):
    """A sphere or a cylinder somewhere around the robot.

    Attributes:
        distance_mm: Range of its centre's distance from the axis of the straight robot [mm].
        height_mm: Range of its centre's height above the base [mm].
        radius_mm: Range of its radius [mm].
        cylinder_fraction: Fraction of cylinders, which are 60 mm long and lie across the robot's path.
        max_tilt: Largest angle between a cylinder's axis and the horizontal, at most π/2 [rad].
        force_n: Range of the set-point [N].
        force_vector: Whether the set-point is a force vector instead of a magnitude.
        max_ramp_angle: Largest angle between obstacle and ramp, with ``force_vector``, at most π/2 [rad].
    """

    adapter: ClassVar[type[AnyAdapter]] = SpatialAdapter

    distance_mm: Range = checked((35.0, 65.0), check_range, low=0)
    height_mm: Range = checked((80.0, 150.0), check_range)
    radius_mm: Range = checked((10.0, 16.0), check_range, low=SMALLEST)
    cylinder_fraction: float = checked(0.5, check_number, low=0, high=1)
    max_tilt: float = checked(math.pi / 6, check_number, low=0, high=math.pi / 2)
    force_n: Range = checked((0.02, 0.15), check_force_range)
    force_vector: bool = checked(False, check_flag)
    max_ramp_angle: float = checked(0.25, check_number, low=0, high=math.pi / 2)

    def sample(self, robot: SpatialRobot, generator: np.random.Generator) -> Assignment:
        """Return a sphere or a cylinder, a set-point, and a ramp towards the obstacle."""
        ranges = (self.distance_mm, self.height_mm, self.radius_mm, self.force_n)
        distance, height, radius, force, azimuth, tilt, ramp_angle, kind = uniform(
            generator,
            *ranges,
            (-math.pi, math.pi),
            (-self.max_tilt, self.max_tilt),
            (-self.max_ramp_angle, self.max_ramp_angle),
            (0.0, 1.0),
        )
        outward = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
        center = distance * outward + [0.0, 0.0, height]
        half = HALF_CYLINDER_MM * np.array([-math.cos(tilt) * outward[1], math.cos(tilt) * outward[0], math.sin(tilt)])
        if kind < self.cylinder_fraction:
            scene = Scene([_cylinder(center, half, radius)])
        else:
            scene = Scene([Sphere(center=tuple(center.tolist()), radius=radius)])
        towards = azimuth + ramp_angle if self.force_vector else azimuth
        return Assignment(scene, force, (math.cos(towards), math.cos(towards - robot.angle)))

    def narrowest_scenes(self) -> Sequence[Scene]:
        """Return the smallest sphere and the smallest cylinder, if they can be sampled."""
        center = np.array([self.distance_mm[0], 0.0, self.height_mm[0]])
        half, radius = np.array([0.0, HALF_CYLINDER_MM, 0.0]), self.radius_mm[0]
        spheres = [Sphere(center=tuple(center.tolist()), radius=radius)] if self.cylinder_fraction < 1 else []
        cylinders = [_cylinder(center, half, radius)] if self.cylinder_fraction > 0 else []
        return [Scene([obstacle]) for obstacle in (*spheres, *cylinders)]


TASKS: dict[str, type[AnyTask]] = {
    task.__name__: task
    for task in (LoadCell, PushObstacle, TrackForce, BracedPush, SoftObstacle, InsertAndPush, SpatialPush)
}


def make_task(task_class: type[AnyTask], task: AnyTask | Mapping[str, object] | None) -> AnyTask:
    """Return a task, given as a task of any class, as a mapping of the fields of this class, or as None."""
    if isinstance(task, Task):
        return task
    return check_instance("task", task, kind=task_class, default=task_class)


def uniform(generator: np.random.Generator, *ranges: Range) -> list[float]:
    """Return a number from each range, all sampled in one call of the generator."""
    return [
        low + part * (high - low)
        for part, (low, high) in zip(generator.random(len(ranges)).tolist(), ranges, strict=True)
    ]


def check_task(task: object) -> None:
    """Raise an error for an object that is not a task, or one with impossible obstacles, target or steps.

    Raises:
        TypeError: If it is not a task.
        ValueError: If an attribute is not a whole number within bounds.
    """
    check_type("task", task, Task)
    assert isinstance(task, Task)
    check_whole("obstacles of the task", task.obstacles, 1, MAX_OBSTACLES)
    check_whole("steps of the task", task.steps, 1, MAX_STEPS)
    if task.target is not None:
        check_whole("target of the task", task.target, 0, task.obstacles - 1)


def _smallest_circle(x_mm: Range, y_mm: Range, radius_mm: Range) -> Circle:
    return Circle(center=(x_mm[0], y_mm[0]), radius=radius_mm[0])


def _cylinder(center: np.ndarray, half: np.ndarray, radius: float) -> Cylinder:
    """Return a cylinder around a centre whose axis extends by ``half`` either way."""
    start, end = (tuple((center + side * half).tolist()) for side in (-1, 1))
    return Cylinder(start=start, end=end, radius=radius, edge=CYLINDER_EDGE_MM)
