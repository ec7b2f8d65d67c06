"""What an episode asks: the obstacles and the force to push them with."""

import math
import zlib
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ccr_gym.bodies import IN_PLANE, IN_SPACE, INSERTED, Body
from ccr_gym.checks import (
    check_array,
    check_fields,
    check_flag,
    check_number,
    check_range,
    check_ranges,
    check_type,
    check_whole,
    checked,
    refusal,
)
from ccr_gym.observation import FORCE_SCALE_N
from solver import Circle, HalfPlane, Robot, Scene
from solver.common.batch import BaseBatch
from solver.common.checks import check_core
from solver.common.scene import MAX_OBSTACLES
from solver.common.validation import SMALLEST
from solver.spatial import Cylinder, SpatialRobot, Sphere

MAX_DRAWS = 1000
HALF_CYLINDER_MM = 30.0
COURSE_STEPS = 128  # of a set-point that moves
TEST_SHARE = 5  # one scene in so many is a test scene
PROBE_MM = 0.5  # cable displacement between the equilibria of a trial pull
SET_POINT = {"low": 1e-6 * FORCE_SCALE_N, "high": FORCE_SCALE_N, "reason": "what the observation can show, in N"}
CIRCLE: tuple[dict[str, float], ...] = ({}, {}, {"low": SMALLEST})  # bounds of x, y and radius


class Assignment(NamedTuple):
    """One episode's task.

    Attributes:
        scene: The obstacles.
        desired_force: Set-point, the magnitude of the force on the robot or the force itself [N].
        pull: Displacements of the cables per millimetre of the steady pull that shows that it can be reached.
        course: Of a set-point that moves, its part of the desired force at every step, the last one for good.
    """

    scene: Scene
    desired_force: float | np.ndarray
    pull: tuple[float, ...] = (1.0,)
    course: np.ndarray | None = None


class Task(ABC):
    """A distribution over assignments.

    A dataclass of this kind checks the fields that it declares with :func:`ccr_gym.checks.checked`.

    Attributes:
        body: The model of its robots.
        obstacles: Number of obstacles of every scene.
        target: The obstacle whose contact force is asked for; ``None`` for all together.
        force_vector: Whether the set-point is a vector: the force that the trial pull gets to.
        moving: Whether the set-point moves, and is seen ahead.
        steps: Steps of an episode.
    """

    body: ClassVar[Body] = IN_PLANE
    obstacles: ClassVar[int] = 1
    target: ClassVar[int | None] = None
    moving: ClassVar[bool] = False
    steps: ClassVar[int] = 64

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def force_vector(self) -> bool:
        """As above."""
        return False

    @abstractmethod
    def draw(self, robot: Any, generator: np.random.Generator) -> Assignment:
        """A scene and a desired force."""

    def narrowest(self) -> Sequence[Scene]:
        """Scenes of the narrowest obstacles there can be, which must not fit between the points of the robot."""
        return ()


@dataclass(frozen=True, slots=True)
class LoadCell(Task):
    """The paper's experiment (Fig. 8–10): a flat load cell beside the robot that only its 15th node meets (eq. 12).

    Attributes:
        distance_mm: Range of the load cell's distance d from the unactuated backbone [mm].
        height_mm: Its height above the base [mm].
        force_n: Range of the desired force [N].
    """

    distance_mm: tuple[float, float] = checked((24.0, 51.0), check_range, low=SMALLEST)
    height_mm: float = checked(127.0, check_number)
    force_n: tuple[float, float] = checked((0.01, 0.06), check_range, **SET_POINT)

    def draw(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """A scene and a desired force."""
        node = round(14 / 18 * robot.segments)
        distance, force = uniform(generator, self.distance_mm, self.force_n)
        wall = HalfPlane(point=(distance, self.height_mm), normal=(-1.0, 0.0), nodes=(node,))
        return Assignment(Scene([wall]), force)


@dataclass(frozen=True, slots=True)
class PushObstacle(Task):
    """A circular obstacle somewhere in front of the robot.

    Attributes:
        x_mm: Range of its centre's x [mm].
        y_mm: Range of its centre's y [mm].
        radius_mm: Range of its radius [mm].
        force_n: Range of the desired force [N].
    """

    x_mm: tuple[float, float] = checked((35.0, 75.0), check_range)
    y_mm: tuple[float, float] = checked((75.0, 150.0), check_range)
    radius_mm: tuple[float, float] = checked((10.0, 16.0), check_range, low=SMALLEST)
    force_n: tuple[float, float] = checked((0.02, 0.15), check_range, **SET_POINT)

    def draw(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """A scene and a desired force."""
        x, y, radius, force = uniform(generator, self.x_mm, self.y_mm, self.radius_mm, self.force_n)
        return Assignment(Scene([Circle(center=(x, y), radius=radius)]), force)

    def narrowest(self) -> Sequence[Scene]:
        """The smallest circle."""
        return (Scene([_circle(self.x_mm, self.y_mm, self.radius_mm)]),)


@dataclass(frozen=True, slots=True)
class TrackForce(PushObstacle):
    """The same with a set-point that steps and swings, and is seen some steps ahead.

    Attributes:
        jumps: Number of jumps of the set-point in an episode, at most one a step.
        swing: Range of its swing's amplitude, over its level; below 1, so that the set-point stays positive.
        period: Range of the swing's period, from a step on [steps].
    """

    moving: ClassVar[bool] = True
    steps: ClassVar[int] = COURSE_STEPS

    jumps: int = checked(3, check_whole, low=0, high=COURSE_STEPS)
    swing: tuple[float, float] = checked((0.1, 0.4), check_range, low=0, below=1)
    period: tuple[float, float] = checked((24.0, 64.0), check_range, low=1)

    def draw(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """A scene, the highest force, and the way to it."""
        drawn = PushObstacle.draw(self, robot, generator)
        swing, period, phase, _ = uniform(generator, self.swing, self.period, (0.0, 2 * math.pi), (0.0, 1.0))
        times = np.sort(generator.uniform(0, COURSE_STEPS, self.jumps))
        levels = generator.uniform(0.3, 1.0, self.jumps + 1)
        now = np.arange(COURSE_STEPS)
        course = levels[np.searchsorted(times, now)] * (1 + swing * np.sin(2 * math.pi * now / period + phase))
        return drawn._replace(course=course / course.max())


@dataclass(frozen=True, slots=True)
class BracedPush(Task):
    """Two circular obstacles, as in the paper's Fig. 4b: the robot braces on the lower one and pushes the upper one.

    Attributes:
        brace_mm: Ranges of x, y and radius of the lower one [mm].
        goal_mm: Ranges of x, y and radius of the upper one, whose contact force is asked for [mm].
        force_n: Range of the desired force [N].
    """

    obstacles: ClassVar[int] = 2
    target: ClassVar[int | None] = 1

    brace_mm: tuple[tuple[float, float], ...] = checked(
        ((27.0, 38.0), (75.0, 95.0), (10.0, 14.0)), check_ranges, bounds=CIRCLE
    )
    goal_mm: tuple[tuple[float, float], ...] = checked(
        ((52.0, 72.0), (125.0, 150.0), (12.0, 16.0)), check_ranges, bounds=CIRCLE
    )
    force_n: tuple[float, float] = checked((0.02, 0.12), check_range, **SET_POINT)

    def draw(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """A scene and a desired force."""
        x, y, radius, goal_x, goal_y, goal_radius, force = uniform(
            generator, *self.brace_mm, *self.goal_mm, self.force_n
        )
        goal = Circle(center=(goal_x, goal_y), radius=goal_radius)
        return Assignment(Scene([Circle(center=(x, y), radius=radius), goal]), force)

    def narrowest(self) -> Sequence[Scene]:
        """The smallest circles."""
        return (Scene([_circle(*self.brace_mm), _circle(*self.goal_mm)]),)


@dataclass(frozen=True, slots=True)
class SoftObstacle(PushObstacle):
    """A circular obstacle on a spring of unknown stiffness, which gives way when it is pushed.

    Attributes:
        spring: Range of the spring's stiffness, drawn evenly in its logarithm [N/mm].
    """

    spring: tuple[float, float] = checked((0.003, 0.1), check_range, low=SMALLEST)

    def draw(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """A scene and a desired force."""
        drawn = PushObstacle.draw(self, robot, generator)
        (exponent,) = uniform(generator, (math.log(self.spring[0]), math.log(self.spring[1])))
        return drawn._replace(scene=Scene(replace(o, spring=math.exp(exponent)) for o in drawn.scene))


@dataclass(frozen=True, slots=True)
class InsertAndPush(PushObstacle):
    """A circular obstacle, pushed with the cable and with the insertion of the base."""

    body: ClassVar[Body] = INSERTED

    y_mm: tuple[float, float] = checked((75.0, 130.0), check_range)


@dataclass(frozen=True, slots=True)
class SpatialPush(Task):
    """A sphere or a cylinder somewhere around the robot.

    Attributes:
        distance_mm: Range of its centre's distance from the axis of the straight robot [mm].
        height_mm: Range of its centre's height above the base [mm].
        radius_mm: Range of its radius [mm].
        cylinders: Share of cylinders, which are 60 mm long and lie across the way of the robot.
        tilt: Largest angle of a cylinder's axis from the horizontal, at most a quarter turn [rad].
        force_n: Range of the desired force [N].
        force_vector: Whether a force is asked for in magnitude and direction, instead of the magnitude alone.
        aside: Largest angle between the obstacle's direction and that of the pull whose force is asked for, with
            ``force_vector``, at most a quarter turn [rad].
    """

    body: ClassVar[Body] = IN_SPACE

    distance_mm: tuple[float, float] = checked((35.0, 65.0), check_range, low=0)
    height_mm: tuple[float, float] = checked((80.0, 150.0), check_range)
    radius_mm: tuple[float, float] = checked((10.0, 16.0), check_range, low=SMALLEST)
    cylinders: float = checked(0.5, check_number, low=0, high=1)
    tilt: float = checked(math.pi / 6, check_number, low=0, high=math.pi / 2)
    force_n: tuple[float, float] = checked((0.02, 0.15), check_range, **SET_POINT)
    force_vector: bool = checked(False, check_flag)
    aside: float = checked(0.25, check_number, low=0, high=math.pi / 2)

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
            scene = Scene([_cylinder(center, half, radius)])
        else:
            scene = Scene([Sphere(center=tuple(center.tolist()), radius=radius)])
        towards = azimuth + aside if self.force_vector else azimuth
        return Assignment(scene, force, (math.cos(towards), math.cos(towards - robot.angle)))

    def narrowest(self) -> Sequence[Scene]:
        """The smallest sphere and the smallest cylinder, of those there are."""
        center = np.array([self.distance_mm[0], 0.0, self.height_mm[0]])
        across, radius = np.array([0.0, HALF_CYLINDER_MM, 0.0]), self.radius_mm[0]
        spheres = [Sphere(center=tuple(center.tolist()), radius=radius)] if self.cylinders < 1 else []
        cylinders = [_cylinder(center, across, radius)] if self.cylinders > 0 else []
        return [Scene([obstacle]) for obstacle in (*spheres, *cylinders)]


def _circle(x_mm: tuple[float, float], y_mm: tuple[float, float], radius_mm: tuple[float, float]) -> Circle:
    """The smallest circle of some ranges."""
    return Circle(center=(x_mm[0], y_mm[0]), radius=radius_mm[0])


def _cylinder(center: np.ndarray, half: np.ndarray, radius: float) -> Cylinder:
    """A cylinder about a centre, to half its axis either way."""
    start, end = (tuple((center + side * half).tolist()) for side in (-1, 1))
    return Cylinder(start=start, end=end, radius=radius, edge=2.0)


def check_task(task: Any) -> None:
    """Refuse what is no task, or one whose obstacles, target or steps make no sense.

    Raises:
        TypeError: If it is no task.
        ValueError: If one of them is no whole number, or out of range.
    """
    check_type("task", task, Task)
    check_whole("obstacles of the task", task.obstacles, low=1, high=MAX_OBSTACLES)
    check_whole("steps of the task", task.steps, low=1)
    if task.target is not None:
        check_whole("target of the task", task.target, low=0, high=task.obstacles - 1)


def check_robot(task: Task, robot: Any) -> None:
    """Refuse a robot that some obstacle of a task could slip through, and a task whose narrowest obstacles are none.

    Raises:
        ValueError: Naming the task, the obstacle, its width and what the robot needs.
    """
    try:
        for scene in task.narrowest():
            check_core(robot, scene)
    except ValueError as error:
        raise ValueError(f"the narrowest obstacles of {task} cannot be: {error}") from error


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
    split: str = "all",
) -> tuple[np.ndarray, list[Assignment]]:
    """Give some robots scenes and desired forces, each drawn by its own generator.

    Draws again until the force can be reached by pulling steadily, without a stall, block or snap on the way.

    Args:
        task: Where scenes and forces are drawn from.
        solver: Robots to try scenes with; those named are assigned to theirs.
        robots: Which.
        generators: One for each of them.
        cable_limit_mm: Largest cable displacement that may be needed [mm].
        split: ``"all"``, ``"train"`` or ``"test"`` scenes.

    Returns:
        Desired force of each, ``(k, 1)``, or ``(k, d)`` where a vector is asked for [N], and what was drawn.

    Raises:
        RuntimeError: If no draw of many is feasible: the task and the robot do not fit.
        TypeError: If the task draws something else than an :class:`Assignment`.
        ValueError: If it draws a scene or a set-point that it must not.
    """
    desired = np.zeros((len(robots), solver.model.space if task.force_vector else 1))
    assignments: list[Any] = [None] * len(robots)
    waiting = list(range(len(robots)))
    for _ in range(MAX_DRAWS):
        drawn, clear = [], []
        for k in waiting:
            assignment = _draw(task, solver.robot, generators[k], split)
            if solver.leaves_clear(assignment.scene):
                solver.assign(robots[k], assignment.scene)
                assignments[k] = assignment
                drawn.append(assignment)
                clear.append(k)
        if not clear:
            continue
        names = [robots[k] for k in clear]
        forces = np.array([assignment.desired_force for assignment in drawn], float)
        pulls = np.array([assignment.pull for assignment in drawn])
        found, reached = solver.ramp_reaches_force(names, forces, PROBE_MM, cable_limit_mm, pulls, task.target)
        if task.force_vector:
            found &= np.linalg.norm(reached, axis=1) <= FORCE_SCALE_N
        desired[clear] = reached if task.force_vector else forces[:, None]
        done = {k for k, success in zip(clear, found, strict=True) if success}
        waiting = [k for k in waiting if k not in done]
        if not waiting:
            return desired, assignments
    raise RuntimeError(
        f"none of {MAX_DRAWS} draws of {task} can be pushed as desired within {cable_limit_mm} mm of cable; "
        "widen the task's ranges or the cable limit"
    )


def in_test_split(scene: Scene) -> bool:
    """Whether a scene is a test scene: a fixed fifth of all there are, told by the numbers of their shapes."""
    return zlib.crc32(np.array(scene.parameters).tobytes()) % TEST_SHARE == 0


def _draw(task: Task, robot: Any, generator: np.random.Generator, split: str) -> Assignment:
    """The next assignment of a split."""
    for _ in range(MAX_DRAWS):
        drawn = task.draw(robot, generator)
        _check_drawn(task, drawn)
        if split == "all" or in_test_split(drawn.scene) == (split == "test"):
            return drawn
    raise RuntimeError(f"none of {MAX_DRAWS} draws of {task} is a {split} scene; widen the task's ranges")


def _check_drawn(task: Task, drawn: Any) -> None:
    check_type("what the task draws", drawn, Assignment, "an Assignment")
    check_type("scene of a draw", drawn.scene, Scene)
    if len(drawn.scene) != task.obstacles:
        raise refusal("scene of a draw", drawn.scene, f"a Scene of {task.obstacles} obstacles, as the task declares")
    check_number("desired_force of a draw", drawn.desired_force, **SET_POINT)
    check_array("pull of a draw", drawn.pull, (task.body.model.cables,))
    if drawn.course is not None:
        course = check_array("course of a draw", drawn.course, (COURSE_STEPS,))
        if not ((course > 0).all() and (course <= 1).all()):
            raise refusal("course of a draw", drawn.course, "above 0 and at most 1 at every step")
