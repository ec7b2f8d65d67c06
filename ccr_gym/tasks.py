"""Tasks: what an episode asks, as distributions over obstacles and set-points.

Their ranges are multiples of the robot's natural units (:class:`ccr_gym.scales.Scales`), so that a task suits robots of
any size: places and radii of its length L, forces of EI/L², stiffnesses of EI/L³.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ccr_gym.adapters import AnyAdapter, InsertionAdapter, SpatialAdapter
from ccr_gym.checks import check_flag, check_fractions, check_instance, check_number, check_range, check_ranges, checked
from ccr_gym.scales import Scales
from ccr_gym.task import PROFILE_STEPS, AnyTask, Assignment, Range, Task, check_force_range, uniform
from solver import Circle, HalfPlane, Robot, Scene
from solver.common.validation import SMALLEST, Point, check_whole
from solver.spatial import Cylinder, SpatialRobot, Sphere

PAPER_MM = 180.0  # length of the paper's robot
HALF_CYLINDER = 1 / 6  # half the length of a cylinder [L]
CYLINDER_EDGE = 1 / 90  # rounding of its edges [L]
TURN = (0.0, 2 * math.pi)  # range of an angle
BREATHS = 64  # as many as an episode can have, and more
LEVELS = (0.3, 1.0)  # range of the levels of a moving set-point, before they are scaled to a maximum of 1
FARTHEST = 10.0  # coordinate of an obstacle, far beyond what a robot reaches [L]
PLACE = {"low": -FARTHEST, "high": FARTHEST}
RADIUS = {"low": SMALLEST, "high": FARTHEST}
CIRCLE: tuple[dict[str, float], ...] = (PLACE, PLACE, RADIUS)  # bounds of x, y and radius
SPRING = {"low": 1e-6, "high": 1e6}  # of an obstacle that is hardly there, or hardly moves [EI/L³]


@dataclass(frozen=True, slots=True)
class LoadCell(Task[Robot]):
    """The paper's experiment (Fig. 8–10): a flat load cell beside the robot that only its 15th node meets (eq. 12).

    Attributes:
        distance: Range of the load cell's distance d from the unactuated backbone [L].
        height: Height of the load cell above the base [L].
        force: Range of the set-point, that of the paper's Table 1 [EI/L²].
    """

    distance: Range = checked((24 / PAPER_MM, 51 / PAPER_MM), check_range, low=SMALLEST, high=FARTHEST)
    height: float = checked(127 / PAPER_MM, check_number, **PLACE)
    force: Range = checked((0.2, 1.5), check_force_range)

    def sample(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """Return a load cell and a set-point."""
        scales, node = Scales.of(robot), round(14 / 18 * robot.segments)
        distance, force = uniform(generator, self.distance, self.force)
        point = distance * scales.length_mm, self.height * scales.length_mm
        wall = HalfPlane(point=point, normal=(-1.0, 0.0), nodes=(node,))
        return Assignment(Scene([wall]), force * scales.force_n)


@dataclass(frozen=True, slots=True)
class PushObstacle(Task[Robot]):
    """A circular obstacle somewhere in front of the robot.

    Attributes:
        x: Range of its centre's x [L].
        y: Range of its centre's y [L].
        radius: Range of its radius [L].
        force: Range of the set-point [EI/L²].
    """

    x: Range = checked((0.2, 0.42), check_range, **PLACE)
    y: Range = checked((0.42, 0.83), check_range, **PLACE)
    radius: Range = checked((0.056, 0.09), check_range, **RADIUS)
    force: Range = checked((0.4, 2.9), check_force_range)

    def sample(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """Return a circle and a set-point."""
        *circle, force = uniform(generator, self.x, self.y, self.radius, self.force)
        scales = Scales.of(robot)
        return Assignment(Scene([_circle(scales, *circle)]), force * scales.force_n)

    def narrowest_scenes(self, robot: Robot) -> Sequence[Scene]:
        """Return the smallest circle."""
        return (Scene([_smallest_circle(robot, self.x, self.y, self.radius)]),)


@dataclass(frozen=True, slots=True)
class TrackForce(PushObstacle):
    """A circular obstacle, and a set-point that changes its level, swings, and is previewed.

    Attributes:
        changes: Number of level changes of the set-point in an episode.
        ramp: Steps that a change of level takes; more than the robot needs, so that its controller decides the error.
        swing: Range of the amplitude of its swing, as a fraction of the level; below 1 to keep the set-point positive.
        period: Range of the period of its swing [steps].
    """

    moving: ClassVar[bool] = True
    steps: ClassVar[int] = PROFILE_STEPS

    changes: int = checked(3, check_whole, low=0, high=PROFILE_STEPS)
    ramp: int = checked(16, check_whole, low=1, high=PROFILE_STEPS)
    swing: Range = checked((0.1, 0.4), check_range, low=0, below=1)
    period: Range = checked((24.0, 64.0), check_range, low=1)

    def sample(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """Return a circle, the largest set-point of the episode, and its profile."""
        sampled = PushObstacle.sample(self, robot, generator)
        swing, period, phase, _ = uniform(generator, self.swing, self.period, (0.0, 2 * math.pi), (0.0, 1.0))
        times = np.sort(generator.uniform(0, PROFILE_STEPS, self.changes))
        levels = generator.uniform(*LEVELS, self.changes + 1)
        level = levels[np.searchsorted(times, np.arange(1 - self.ramp, PROFILE_STEPS))]
        ramps = np.convolve(level, np.full(self.ramp, 1 / self.ramp), "valid")  # a jump becomes a ramp
        now = np.arange(PROFILE_STEPS)
        profile = ramps * (1 + swing * np.sin(2 * math.pi * now / period + phase))
        return sampled._replace(profile=profile / profile.max())


@dataclass(frozen=True, slots=True)
class BracedPush(Task[Robot]):
    """Two circular obstacles, as in the paper's Fig. 4b: the robot braces on the lower one and pushes the upper one.

    Attributes:
        brace: Ranges of x, y and radius of the lower one [L].
        goal: Ranges of x, y and radius of the upper one, whose contact force is regulated [L].
        force: Range of the set-point, that of the load cell: errors of sensors do not grow with it [EI/L²].
    """

    obstacles: ClassVar[int] = 2
    target: ClassVar[int | None] = 1

    brace: tuple[Range, ...] = checked(((0.15, 0.21), (0.42, 0.53), (0.056, 0.078)), check_ranges, bounds=CIRCLE)
    goal: tuple[Range, ...] = checked(((0.29, 0.4), (0.69, 0.83), (0.067, 0.09)), check_ranges, bounds=CIRCLE)
    force: Range = checked((0.2, 1.5), check_force_range)

    def sample(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """Return two circles and a set-point."""
        *numbers, force = uniform(generator, *self.brace, *self.goal, self.force)
        scales = Scales.of(robot)
        scene = Scene([_circle(scales, *numbers[:3]), _circle(scales, *numbers[3:])])
        return Assignment(scene, force * scales.force_n)

    def narrowest_scenes(self, robot: Robot) -> Sequence[Scene]:
        """Return the smallest circles."""
        return (Scene([_smallest_circle(robot, *self.brace), _smallest_circle(robot, *self.goal)]),)


@dataclass(frozen=True, slots=True)
class SoftObstacle(PushObstacle):
    """A circular obstacle on a spring of unknown stiffness, which yields when pushed.

    Attributes:
        spring: Range of the spring's stiffness, sampled uniformly in its logarithm [EI/L³].
        force: Range of the set-point, that of the load cell; it moves the softest obstacle by up to 0.15 L [EI/L²].
    """

    spring: Range = checked((10.0, 350.0), check_range, **SPRING)
    force: Range = checked((0.2, 1.5), check_force_range)

    def sample(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """Return a circle on a spring and a set-point."""
        sampled = PushObstacle.sample(self, robot, generator)
        (exponent,) = uniform(generator, (math.log(self.spring[0]), math.log(self.spring[1])))
        scales = Scales.of(robot)
        spring = math.exp(exponent) * (scales.force_n / scales.length_mm)
        return sampled._replace(scene=Scene(replace(obstacle, spring=spring) for obstacle in sampled.scene))


@dataclass(frozen=True, slots=True)
class MovingObstacle(PushObstacle):
    """A circular obstacle that breathes, and may drift meanwhile.

    A breath moves it by ``depth · sin⁴(π t/T)`` in a direction of the episode and back, as organs rest between breaths;
    depth and period T vary from breath to breath.

    Attributes:
        depth: Range of the depth of a breath [L].
        period: Range of its period [steps].
        variation: Largest deviations of depth and period of a single breath, as fractions.
        drift: Range of the drift over the episode, in a direction of its own [L].
    """

    obstacles_move: ClassVar[bool] = True
    steps: ClassVar[int] = PROFILE_STEPS

    depth: Range = checked((1 / PAPER_MM, 2 / PAPER_MM), check_range, low=0, high=0.1)
    period: Range = checked((16.0, 48.0), check_range, low=4, high=PROFILE_STEPS)
    variation: Range = checked((0.25, 0.15), check_fractions, count=2)
    drift: Range = checked((0.0, 0.0), check_range, low=0, high=0.1)

    def sample(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """Return a circle, a set-point, and the motion of the circle."""
        sampled = PushObstacle.sample(self, robot, generator)
        depth, period, drift, *directions = uniform(generator, self.depth, self.period, self.drift, TURN, TURN)
        deviations = generator.uniform(-1, 1, (2, BREATHS)) * np.array(self.variation)[:, None]
        breathing, drifting = ((math.cos(angle), math.sin(angle)) for angle in directions)
        ends = np.cumsum(period * (1 + deviations[1]))
        now = np.arange(PROFILE_STEPS)
        breath = np.searchsorted(ends, now, side="right")
        phase = (ends[breath] - now) / (period * (1 + deviations[1, breath]))
        moved = depth * (1 + deviations[0, breath]) * np.sin(math.pi * phase) ** 4
        motion = np.outer(moved, breathing) + np.outer(drift * now / PROFILE_STEPS, drifting)
        return sampled._replace(motion=Scales.of(robot).length_mm * motion)


@dataclass(frozen=True, slots=True)
class InsertAndPush(PushObstacle):
    """A circular obstacle, pushed with the cable and the insertion of the base."""

    adapter: ClassVar[type[AnyAdapter]] = InsertionAdapter

    y: Range = checked((0.47, 0.8), check_range, **PLACE)
    radius: Range = checked((0.064, 0.1), check_range, **RADIUS)
    force: Range = checked((0.2, 1.5), check_force_range)  # as BracedPush


@dataclass(frozen=True, slots=True)
class SpatialPush(Task[SpatialRobot]):
    """A sphere or a cylinder somewhere around the robot.

    Attributes:
        distance: Range of its centre's distance from the axis of the straight robot [L].
        height: Range of its centre's height above the base [L].
        radius: Range of its radius [L].
        cylinder_fraction: Fraction of cylinders, which are L/3 long and lie across the robot's path.
        max_tilt: Largest angle between a cylinder's axis and the horizontal, at most π/2 [rad].
        force: Range of the set-point [EI/L²].
        force_vector: Whether the set-point is a force vector instead of a magnitude.
        max_ramp_angle: Largest angle between obstacle and ramp, with ``force_vector``, at most π/2 [rad].
    """

    adapter: ClassVar[type[AnyAdapter]] = SpatialAdapter

    distance: Range = checked((0.2, 0.36), check_range, low=0, high=FARTHEST)
    height: Range = checked((0.45, 0.83), check_range, **PLACE)
    radius: Range = checked((0.056, 0.09), check_range, **RADIUS)
    cylinder_fraction: float = checked(0.5, check_number, low=0, high=1)
    max_tilt: float = checked(math.pi / 6, check_number, low=0, high=math.pi / 2)
    force: Range = checked((0.4, 2.9), check_force_range)
    force_vector: bool = checked(False, check_flag)
    max_ramp_angle: float = checked(0.25, check_number, low=0, high=math.pi / 2)

    def sample(self, robot: SpatialRobot, generator: np.random.Generator) -> Assignment:
        """Return a sphere or a cylinder, a set-point, and a ramp towards the obstacle."""
        scales = Scales.of(robot)
        ranges = (self.distance, self.height, self.radius, self.force)
        distance, height, radius, force, azimuth, tilt, ramp_angle, kind = uniform(
            generator,
            *ranges,
            (-math.pi, math.pi),
            (-self.max_tilt, self.max_tilt),
            (-self.max_ramp_angle, self.max_ramp_angle),
            (0.0, 1.0),
        )
        x, y, level = math.cos(azimuth), math.sin(azimuth), math.cos(tilt)  # of directions: outward, and its tilt
        center = distance * x, distance * y, height
        across = -level * y, level * x, math.sin(tilt)
        make = _cylinder if kind < self.cylinder_fraction else _sphere
        towards = azimuth + ramp_angle if self.force_vector else azimuth
        scene = Scene([make(scales, center, radius, across)])
        return Assignment(scene, force * scales.force_n, (math.cos(towards), math.sin(towards)))

    def narrowest_scenes(self, robot: SpatialRobot) -> Sequence[Scene]:
        """Return the smallest sphere and the smallest cylinder, if they can be sampled."""
        center, across = (self.distance[0], 0.0, self.height[0]), (0.0, 1.0, 0.0)
        sampled = (_sphere, self.cylinder_fraction < 1), (_cylinder, self.cylinder_fraction > 0)
        scales = Scales.of(robot)
        return [Scene([make(scales, center, self.radius[0], across)]) for make, possible in sampled if possible]


TASKS: dict[str, type[AnyTask]] = {
    task.__name__: task
    for task in (
        LoadCell,
        PushObstacle,
        TrackForce,
        BracedPush,
        SoftObstacle,
        MovingObstacle,
        InsertAndPush,
        SpatialPush,
    )
}


def make_task(task_class: type[AnyTask], task: AnyTask | Mapping[str, object] | None) -> AnyTask:
    """Return a task, given as a task of any class, as a mapping of the fields of this class, or as None."""
    if isinstance(task, Task):
        return task
    return check_instance("task", task, kind=task_class, default=task_class)


def _smallest_circle(robot: Robot, x: Range, y: Range, radius: Range) -> Circle:
    return _circle(Scales.of(robot), x[0], y[0], radius[0])


def _circle(scales: Scales, x: float, y: float, radius: float) -> Circle:
    """Return a circle, given in multiples of L."""
    length = scales.length_mm
    return Circle(center=(x * length, y * length), radius=radius * length)


def _sphere(scales: Scales, center: Point, radius: float, _: Point) -> Sphere:
    """Return a sphere, given in multiples of L."""
    return Sphere(center=_point(scales, center), radius=radius * scales.length_mm)


def _cylinder(scales: Scales, center: Point, radius: float, axis: Point) -> Cylinder:
    """Return a cylinder around a centre, given in multiples of L."""
    halves = -HALF_CYLINDER, HALF_CYLINDER
    start, end = (tuple(x + half * along for x, along in zip(center, axis, strict=True)) for half in halves)
    length = scales.length_mm
    edge = CYLINDER_EDGE * length
    return Cylinder(start=_point(scales, start), end=_point(scales, end), radius=radius * length, edge=edge)


def _point(scales: Scales, place: Point) -> Point:
    return tuple(x * scales.length_mm for x in place)
