"""Adapters from environments to robots: those of the plane, the same with insertion, and those in space."""

from abc import ABC, abstractmethod
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

import numpy as np

from ccr_gym.actions import ActionSpec
from ccr_gym.checks import require
from ccr_gym.quantities import EnvIndex, Quantity
from ccr_gym.scales import RADIUS_SPAN
from ccr_gym.sensing import Body
from ccr_gym.settings import AnySettings, InsertionSettings, Settings, SpatialSettings
from solver import BatchSolver, ReferenceBatch, Scene, Solver
from solver.common import transition
from solver.common.batch import BaseBatch
from solver.common.layout import Layout
from solver.common.robot import AnyRobot
from solver.spatial import Capsule, Cylinder, SpatialBatchSolver, SpatialSolver

SettingsT = TypeVar("SettingsT", bound=AnySettings)
PlanarSettingsT = TypeVar("PlanarSettingsT", bound=Settings)


class Feature(NamedTuple):
    """Numbers of an equilibrium block that are observed.

    Attributes:
        columns: Their columns in the block, ``(k,)``.
        scale: What they are multiplied with, one number or ``(k,)``.
    """

    columns: np.ndarray
    scale: np.ndarray | float


Features = dict[str, Feature]


class RobotAdapter(ABC, Generic[SettingsT]):
    """The interface between environments and a robot: actions, observed features and points.

    Attributes:
        settings_class: Settings of the environments.
        space: Dimension d of the space.
        turns: Numbers that turn a disk, 1 in the plane and 3 in space.
        obstacle_size: How many numbers of an obstacle are observed.
        settings: Settings of the environment.
        actuation: Map from cable actions to cables.
        scales: Natural units of the robot.
        layout: Memory layout of an equilibrium block.
        actions: The actuated coordinates.

    Args:
        settings: Settings of the environment.
        layout: Memory layout of an equilibrium block.
    """

    settings_class: ClassVar[type[AnySettings]]
    space: ClassVar[int]
    turns: ClassVar[int]
    obstacle_size: ClassVar[int] = 0

    def __init__(self, settings: SettingsT, layout: Layout) -> None:
        self.settings, self.layout = settings, layout
        self.actuation, self.scales = settings.actuation, settings.scales
        self.actions = self._action_spec()
        self._reach_mm = settings.reach_mm  # which is computed anew at each access

    @property
    def body(self) -> Body:
        """Sizes of what is sensed of a robot."""
        robot = self.settings.robot
        return Body(self.space, len(robot.cables), robot.segments + 1, self.turns)

    @classmethod
    @abstractmethod
    def make_batch(cls, settings: SettingsT, count: int, obstacles: int, threads: int) -> BaseBatch:
        """Return a batch of robots among this number of obstacles each."""

    @classmethod
    @abstractmethod
    def check_scene(cls, settings: SettingsT, scene: Scene) -> None:
        """Raise an error if the robot cannot be put among these obstacles.

        Raises:
            TypeError: If the scene is not a Scene.
            ValueError: As the solver.
        """

    @property
    def kernel_actuation(self) -> transition.Actuation:
        """The actuation as the kernel takes it."""
        actuation, actions = self.actuation, self.actions
        ends = {"low": actions.low_mm, "high": actions.high_mm, "increment": actions.increment_mm}
        recovery = None if actuation.recovery is None else np.ascontiguousarray(actuation.recovery)
        return transition.Actuation(matrix=np.ascontiguousarray(actuation.matrix), recovery=recovery, **ends)

    @staticmethod
    def lines_mm(robot: AnyRobot) -> np.ndarray:
        """Return where a robot's lines of points that can touch cross its disks, ``(lines, d − 1)`` [mm]."""
        return np.array(robot.lines_mm).reshape(len(robot.lines_mm), -1)

    @property
    @abstractmethod
    def pose_scale(self) -> np.ndarray:
        """What errors of places and turns of a disk are observed in, ``(d,)`` in the plane x, y and angle."""

    def force(self, blocks: np.ndarray, target: int | None) -> np.ndarray:
        """Return the contact force of an obstacle, of all together for ``None``, ``(..., d)`` [N]."""
        if target is None:
            return self.layout.force(blocks)
        return self.layout.forces(blocks)[..., target, :]

    @abstractmethod
    def pose_features(self) -> Features:
        """Return the observed features of the shape."""

    def obstacle_features(self, scene: Scene) -> np.ndarray:
        """Return the observed numbers of the first obstacle, ``(obstacle_size,)``."""
        return np.zeros(0)

    def bounded(self, actuated_mm: np.ndarray) -> np.ndarray:
        """Return actuated coordinates ``(..., actions)`` within their bounds [mm]."""
        return np.asarray(np.minimum(np.maximum(actuated_mm, self.actions.low_mm), self.actions.high_mm))

    def write_command(self, commands: np.ndarray, actuated_mm: np.ndarray, index: EnvIndex) -> None:
        """Write what actuated coordinates command to rows of a batch's commands.

        Args:
            commands: Commands of the batch, ``(N, cables + 1)`` [mm].
            actuated_mm: Actuated coordinates, ``(..., actions)`` [mm].
            index: The rows.
        """
        commands[index, :-1] = self.actuation.cables_mm(actuated_mm[..., : self.actions.commands])

    @property
    def actuator_numbers(self) -> int:
        """How many numbers are read of the actuators: displacements and tensions, and the length of insertion."""
        return 2 * len(self.settings.robot.cables) + self.actions.size - self.actions.commands

    def info(self, actuators: np.ndarray) -> dict[str, Quantity]:
        """Return displacements and tensions of the cables, of a single one as numbers.

        Args:
            actuators: What is read of the actuators of one robot or of many, ``(k, ...)``.
        """
        cables = len(self.settings.robot.cables)
        if cables == 1:
            return {"cable_mm": actuators[0], "tension": actuators[1]}
        return {"cable_mm": actuators[:cables].T.copy(), "tension": actuators[cables : 2 * cables].T.copy()}

    def _action_spec(self) -> ActionSpec:
        """Return the actuated coordinates.

        Raises:
            ValueError: If there is a section that its cables cannot bend to where obstacles are.
        """
        least, where = (0.0, "+x") if self.space == 2 else (self.actuation.low, "x and y")
        bent = bool((self.actuation.high > least).all())
        require(bent, f"the cables of the robot cannot bend every section towards {where}; give it cables that do")
        limit, increment = self.settings.cable_limit_mm, self.settings.max_increment_mm
        low, high = limit * self.actuation.low, limit * self.actuation.high
        return ActionSpec(low.size, low, high, np.full(low.size, increment))


class PlanarAdapter(RobotAdapter[PlanarSettingsT]):
    """A planar robot, with one action for the cables of each section."""

    settings_class, space, turns = Settings, 2, 1

    @property
    def pose_scale(self) -> np.ndarray:
        """What x, y and the angle of a disk are multiplied with."""
        return 1 / np.array([*2 * [self.settings.reach_mm], np.pi])

    @classmethod
    def make_batch(cls, settings: PlanarSettingsT, count: int, obstacles: int, threads: int) -> BaseBatch:
        """Return a batch of the native solver, or of the reference solver."""
        batch = ReferenceBatch if settings.backend == "casadi" else BatchSolver
        return batch(settings.robot, count, obstacles, threads)

    @classmethod
    def check_scene(cls, settings: PlanarSettingsT, scene: Scene) -> None:
        """Raise an error if the robot cannot be put among these obstacles; see the base class."""
        Solver(settings.robot, scene)

    def pose_features(self) -> Features:
        """Return position and disk angle of every node."""
        robot = self.settings.robot
        nodes = self.layout.nodes(np.arange(self.layout.size)).ravel()
        return {"nodes": Feature(nodes, np.tile(self.pose_scale, robot.segments + 1))}


class InsertionAdapter(PlanarAdapter[InsertionSettings]):
    """A planar robot whose last action inserts the base."""

    settings_class = InsertionSettings

    def write_command(self, commands: np.ndarray, actuated_mm: np.ndarray, index: EnvIndex) -> None:
        """Write cables and length; see the base class."""
        super().write_command(commands, actuated_mm, index)
        commands[index, -1] = actuated_mm[..., -1]

    def info(self, actuators: np.ndarray) -> dict[str, Quantity]:
        """Return displacements and tensions of the cables, and the length of the robot; see the base class."""
        return super().info(actuators) | {"length_mm": actuators[-1]}

    def _action_spec(self) -> ActionSpec:
        cables, (shortest, longest) = super()._action_spec(), self.settings.robot.lengths_mm
        ends = np.append(cables.low_mm, shortest), np.append(cables.high_mm, longest)
        return ActionSpec(cables.commands, *ends, np.append(cables.increment_mm, self.settings.max_insertion_mm))


class SpatialAdapter(RobotAdapter[SpatialSettings]):
    """A robot in space, with two actions for the cables of each section."""

    settings_class, space, turns, obstacle_size = SpatialSettings, 3, 3, 7

    @classmethod
    def make_batch(cls, settings: SpatialSettings, count: int, obstacles: int, threads: int) -> BaseBatch:
        """Return a batch of the native solver."""
        return SpatialBatchSolver(settings.robot, count, obstacles, threads)

    @classmethod
    def check_scene(cls, settings: SpatialSettings, scene: Scene) -> None:
        """Raise an error if the robot cannot be put among these obstacles; see the base class."""
        SpatialSolver(settings.robot, scene)

    @property
    def pose_scale(self) -> np.ndarray:
        """What x, y and z of a disk are multiplied with; its axes are observed as they are."""
        return np.full(3, 1 / self.settings.reach_mm)

    def pose_features(self) -> Features:
        """Return the position of every node, and the first and last axis of its disk."""
        columns = np.arange(self.layout.size)
        axes = np.swapaxes(self.layout.frames(columns)[:, :, [0, 2]], 1, 2).ravel()
        nodes = self.layout.nodes(columns).ravel()
        return {"frames": Feature(axes, 1.0), "nodes": Feature(nodes, 1 / self.settings.reach_mm)}

    def obstacle_features(self, scene: Scene) -> np.ndarray:
        """Return centre, axis direction and radius of the first obstacle, in units of L, zeros where it has none."""
        if not len(scene):
            return np.zeros(self.obstacle_size)
        obstacle, length, direction = scene.obstacles[0], self._reach_mm, np.zeros(3)
        if isinstance(obstacle, Capsule | Cylinder):
            axis = np.subtract(obstacle.end, obstacle.start)
            direction = axis / np.linalg.norm(axis)
        size = getattr(obstacle, "radius", 0.0) / (RADIUS_SPAN * length)
        return np.array([*(x / length for x in obstacle.extent.center), *direction.tolist(), size])


AnyAdapter = RobotAdapter[Any]  # of whatever settings its task has
