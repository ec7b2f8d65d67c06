"""What an episode asks: the obstacles and the force to push them with."""

import math
import zlib
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ccr_gym.bodies import IN_PLANE, IN_SPACE, INSERTED, Body
from solver import Circle, HalfPlane, Robot, Scene
from solver.batch import BaseBatch
from solver.spatial import Cylinder, SpatialRobot, Sphere

MAX_DRAWS = 1000
HALF_CYLINDER_MM = 30.0
COURSE_STEPS = 128  # of a set-point that moves
TEST_SHARE = 5  # one scene in so many is a test scene
PROBE_MM = 0.5  # cable displacement between the equilibria of a trial pull


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

    @property
    def force_vector(self) -> bool:
        """As above."""
        return False

    @abstractmethod
    def draw(self, robot: Any, generator: np.random.Generator) -> Assignment:
        """A scene and a desired force."""


@dataclass(frozen=True, slots=True)
class LoadCell(Task):
    """The paper's experiment (Fig. 8–10): a flat load cell beside the robot that only its 15th node meets (eq. 12).

    Attributes:
        distance_mm: Range of the load cell's distance d from the unactuated backbone [mm].
        height_mm: Its height above the base [mm].
        force_n: Range of the desired force [N].
    """

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
class PushObstacle(Task):
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

    def draw(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """A scene and a desired force."""
        x, y, radius, force = uniform(generator, self.x_mm, self.y_mm, self.radius_mm, self.force_n)
        return Assignment(Scene([Circle(center=(x, y), radius=radius)]), force)


@dataclass(frozen=True, slots=True)
class TrackForce(PushObstacle):
    """The same with a set-point that steps and swings, and is seen some steps ahead.

    Attributes:
        jumps: Number of jumps of the set-point in an episode.
        swing: Range of its swing's amplitude, over its level.
        period: Range of the swing's period [steps].
    """

    moving: ClassVar[bool] = True
    steps: ClassVar[int] = COURSE_STEPS

    jumps: int = 3
    swing: tuple[float, float] = (0.1, 0.4)
    period: tuple[float, float] = (24.0, 64.0)

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

    brace_mm: tuple[tuple[float, float], ...] = ((27.0, 38.0), (75.0, 95.0), (10.0, 14.0))
    goal_mm: tuple[tuple[float, float], ...] = ((52.0, 72.0), (125.0, 150.0), (12.0, 16.0))
    force_n: tuple[float, float] = (0.02, 0.12)

    def draw(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """A scene and a desired force."""
        x, y, radius, goal_x, goal_y, goal_radius, force = uniform(
            generator, *self.brace_mm, *self.goal_mm, self.force_n
        )
        goal = Circle(center=(goal_x, goal_y), radius=goal_radius)
        return Assignment(Scene([Circle(center=(x, y), radius=radius), goal]), force)


@dataclass(frozen=True, slots=True)
class SoftObstacle(PushObstacle):
    """A circular obstacle on a spring of unknown stiffness, which gives way when it is pushed.

    Attributes:
        stiffness: Range of the spring's stiffness, drawn evenly in its logarithm [N/mm].
    """

    stiffness: tuple[float, float] = (0.003, 0.1)

    def draw(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """A scene and a desired force."""
        drawn = PushObstacle.draw(self, robot, generator)
        (exponent,) = uniform(generator, (math.log(self.stiffness[0]), math.log(self.stiffness[1])))
        return drawn._replace(scene=Scene(replace(o, stiffness=math.exp(exponent)) for o in drawn.scene))


@dataclass(frozen=True, slots=True)
class InsertAndPush(PushObstacle):
    """A circular obstacle, pushed with the cable and with the insertion of the base."""

    body: ClassVar[Body] = INSERTED

    y_mm: tuple[float, float] = (75.0, 130.0)


@dataclass(frozen=True, slots=True)
class SpatialPush(Task):
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
    split: str = "all",
) -> tuple[np.ndarray, list[Assignment]]:
    """Give some robots scenes and desired forces, each drawn by its own generator.

    Draws again until the force can be reached by pulling steadily, without a stall, jam or snap on the way.

    Args:
        task: Where scenes and forces are drawn from.
        solver: The robots; those named are assigned to their scenes.
        robots: Which.
        generators: One for each of them.
        cable_limit_mm: Largest cable displacement that may be needed [mm].
        split: ``"all"``, ``"train"`` or ``"test"`` scenes.

    Returns:
        Desired force of each, ``(k, 1)``, or ``(k, d)`` where a vector is asked for [N], and what was drawn.

    Raises:
        RuntimeError: If no draw of many is feasible: the task and the robot do not fit.
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
        found, reached = solver.reaches(names, forces, PROBE_MM, cable_limit_mm, pulls, task.target)
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
    while True:
        drawn = task.draw(robot, generator)
        if split == "all" or in_test_split(drawn.scene) == (split == "test"):
            return drawn
