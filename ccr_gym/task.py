"""The interface of tasks: what an episode asks, as a distribution over obstacles and set-points."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import Field
from typing import Any, ClassVar, Generic, NamedTuple

import numpy as np

from ccr_gym.adapters import AnyAdapter, PlanarAdapter
from ccr_gym.checks import check_fields, check_number, check_range, check_type
from ccr_gym.scales import FORCE_SPAN
from ccr_gym.settings import RobotT
from solver import Scene
from solver.common.scene import MAX_OBSTACLES
from solver.common.validation import check_whole

Range = tuple[float, float]
MAX_STEPS = 2**31 - 1
PROFILE_STEPS = 128  # of a moving set-point
LEAST_FORCE, FORCE_REASON = 1e-6 * FORCE_SPAN, "what the observation can show, in EI/L²"


def check_force_range(name: str, value: object) -> Range:
    """Return the range of the magnitude of a set-point [EI/L²]; see :func:`ccr_gym.checks.check_range`."""
    return check_range(name, value, low=LEAST_FORCE, high=FORCE_SPAN, reason=FORCE_REASON)


def check_force(name: str, value: object, unit_n: float) -> float:
    """Return the magnitude of a set-point as a float [N].

    Args:
        name: Name of the set-point.
        value: Its magnitude [N].
        unit_n: EI/L² of the robot [N].

    Raises:
        ValueError: If it is not a number that the observation can show.
    """
    low, high = force_bounds(unit_n)
    return check_number(name, value, low=low, high=high, reason="what the observation can show, in N")


def force_bounds(unit_n: float) -> Range:
    """Return the least and largest magnitude of a set-point that the observation can show, from EI/L² [N]."""
    return LEAST_FORCE * unit_n, FORCE_SPAN * unit_n


class Assignment(NamedTuple):
    """Obstacles and set-point of one episode.

    Attributes:
        scene: The obstacles.
        desired_force: Set-point: the magnitude of the force on the robot, or the force itself ``(d,)`` [N].
        direction: Direction of bending of the steady pull that must reach the set-point, 1 or its components along x
            and y, ``(d − 1,)``.
        profile: Factors of the set-point at every step, ``(PROFILE_STEPS,)``, the last one kept from then on; ``None``
            for a constant set-point.
        motion: Displacements of the obstacles from where they are at the start, at every step,
            ``(PROFILE_STEPS, d)`` [mm], the last one kept from then on; ``None`` where they stay.
    """

    scene: Scene
    desired_force: float | np.ndarray
    direction: tuple[float, ...] = (1.0,)
    profile: np.ndarray | None = None
    motion: np.ndarray | None = None


class Task(ABC, Generic[RobotT]):
    """A distribution over assignments.

    Subclasses are frozen dataclasses whose fields are declared with :func:`ccr_gym.checks.checked`.

    Attributes:
        adapter: Adapter of its robots.
        obstacles: Number of obstacles of every scene.
        target: Index of the obstacle whose contact force is regulated; ``None`` for the sum over all.
        moving: Whether the set-point moves, and is previewed.
        obstacles_move: Whether the obstacles move within an episode.
        steps: Steps of an episode.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[object]]]  # of its subclasses

    adapter: ClassVar[type[AnyAdapter]] = PlanarAdapter
    obstacles: ClassVar[int] = 1
    target: ClassVar[int | None] = None
    moving: ClassVar[bool] = False
    obstacles_move: ClassVar[bool] = False
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

    def narrowest_scenes(self, robot: RobotT) -> Sequence[Scene]:
        """Return scenes of the narrowest possible obstacles, which must not fit between the points of the robot."""
        return ()


AnyTask = Task[Any]  # samples for robots of its own adapter, whatever they are


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
