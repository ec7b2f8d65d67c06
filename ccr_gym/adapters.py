"""Adapters from environments to robots: those of the plane, the same with insertion, and those in space."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

import numpy as np

from ccr_gym.actions import ActionSpec
from ccr_gym.checks import require
from ccr_gym.quantities import EnvIndex, Quantity, as_scalar, norm
from ccr_gym.scales import RADIUS_SPAN
from ccr_gym.sensing import Body
from ccr_gym.settings import AnySettings, InsertionSettings, Settings, SpatialSettings
from solver import BatchSolver, ReferenceBatch, Scene, Solver
from solver.common.batch import BaseBatch
from solver.common.geometry import subdivide
from solver.common.layout import Layout
from solver.common.robot import AnyRobot
from solver.spatial import Capsule, Cylinder, SpatialBatchSolver, SpatialSolver, sides

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

    @staticmethod
    def lines_mm(robot: AnyRobot) -> np.ndarray:
        """Return the positions of a robot's lines across its disks, ``(lines, 1, d − 1)`` [mm]."""
        lines = np.array(robot.lines_mm)
        return lines.reshape(len(lines), 1, -1)

    @abstractmethod
    def points(self, blocks: np.ndarray, lines_mm: np.ndarray) -> np.ndarray:
        """Return the points that can touch, ``(..., lines, positions, d)`` [mm].

        Args:
            blocks: Equilibria, ``(..., size)``.
            lines_mm: Positions of the lines, as of :meth:`lines_mm`, of each robot or of all [mm].
        """

    def force(self, blocks: np.ndarray, target: int | None) -> np.ndarray:
        """Return the contact force of an obstacle, of all together for ``None``, ``(..., d)`` [N]."""
        if target is None:
            return self.layout.force(blocks)
        return self.layout.forces(blocks)[..., target, :]

    @abstractmethod
    def pose_features(self) -> Features:
        """Return the observed features of the shape."""

    @abstractmethod
    def disturb_pose(self, entries: Mapping[str, np.ndarray], errors: np.ndarray) -> None:
        """Add errors of a camera or fibre to the observed features of the shape.

        Args:
            entries: Observed entries, ``(..., k)`` each, written in place.
            errors: Errors of places and turns of all disks, ``(..., n + 1, d + turns)`` [mm, rad].
        """

    def obstacle_features(self, scene: Scene) -> np.ndarray:
        """Return the observed numbers of the first obstacle, ``(obstacle_size,)``."""
        return np.zeros(0)

    def clip(self, actions: np.ndarray) -> np.ndarray:
        """Return actions ``(..., actions)`` within [−1, 1]."""
        return np.asarray(np.minimum(np.maximum(actions.astype(float), -1.0), 1.0))

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

    def actuated_mm(self, blocks: np.ndarray, commanded_mm: np.ndarray) -> np.ndarray:
        """Return the actuated coordinates that robots have reached, ``(..., actions)`` [mm].

        Args:
            blocks: Equilibria, ``(..., size)``.
            commanded_mm: Actuated coordinates that were commanded, ``(..., actions)`` [mm].
        """
        return self.bounded(self.actuation.reached(commanded_mm, self.layout.cables(blocks)))

    def signed(self, blocks: np.ndarray, tensions: np.ndarray) -> np.ndarray:
        """Return tensions ``(..., cables)`` with the signs of displacements that stand for pairs of opposite cables."""
        return tensions

    def info(self, blocks: np.ndarray, index: int | slice) -> dict[str, Quantity]:
        """Return displacements and tensions of the cables, of a single one as numbers."""
        cables, tensions = self.layout.cables(blocks), self.layout.tensions(blocks)
        if cables.shape[-1] == 1:
            return {"cable_mm": as_scalar(cables[..., 0], index), "tension": as_scalar(tensions[..., 0], index)}
        return {"cable_mm": cables.copy(), "tension": tensions.copy()}

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

    def __init__(self, settings: PlanarSettingsT, layout: Layout) -> None:
        super().__init__(settings, layout)
        self._pose_scale = 1 / np.array([*2 * [settings.reach_mm], np.pi])  # of x, y and disk angle

    @classmethod
    def make_batch(cls, settings: PlanarSettingsT, count: int, obstacles: int, threads: int) -> BaseBatch:
        """Return a batch of the native solver, or of the reference solver."""
        batch = ReferenceBatch if settings.backend == "casadi" else BatchSolver
        return batch(settings.robot, count, obstacles, threads)

    @classmethod
    def check_scene(cls, settings: PlanarSettingsT, scene: Scene) -> None:
        """Raise an error if the robot cannot be put among these obstacles; see the base class."""
        Solver(settings.robot, scene)

    def points(self, blocks: np.ndarray, lines_mm: np.ndarray) -> np.ndarray:
        """Return the points that can touch, ``(..., lines, positions, 2)`` [mm]; see the base class."""
        nodes, axes = self.layout.nodes(blocks), self.layout.frames(blocks)
        lines = nodes[..., None, :, :2] + lines_mm * axes[..., None, :, :]
        return subdivide(lines, self.settings.robot.between)

    def pose_features(self) -> Features:
        """Return position and disk angle of every node."""
        robot = self.settings.robot
        nodes = self.layout.nodes(np.arange(self.layout.size)).ravel()
        return {"nodes": Feature(nodes, np.tile(self._pose_scale, robot.segments + 1))}

    def disturb_pose(self, entries: Mapping[str, np.ndarray], errors: np.ndarray) -> None:
        """Add errors to positions and disk angles; see the base class."""
        nodes = entries["nodes"]
        nodes += (errors * self._pose_scale).reshape(nodes.shape)


class InsertionAdapter(PlanarAdapter[InsertionSettings]):
    """A planar robot whose last action inserts the base."""

    settings_class = InsertionSettings

    def write_command(self, commands: np.ndarray, actuated_mm: np.ndarray, index: EnvIndex) -> None:
        """Write cables and length; see the base class."""
        super().write_command(commands, actuated_mm, index)
        commands[index, -1] = actuated_mm[..., -1]

    def actuated_mm(self, blocks: np.ndarray, commanded_mm: np.ndarray) -> np.ndarray:
        """Return what was reached of cables and length, ``(..., actions)`` [mm]; see the base class."""
        cables = self.actuation.reached(commanded_mm[..., :-1], self.layout.cables(blocks))
        return self.bounded(np.concatenate([cables, self.layout.length(blocks)], axis=-1))

    def info(self, blocks: np.ndarray, index: int | slice) -> dict[str, Quantity]:
        """Return displacements and tensions of the cables, and the length of the robot."""
        return super().info(blocks, index) | {"length_mm": as_scalar(self.layout.length(blocks)[..., 0], index)}

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

    def points(self, blocks: np.ndarray, lines_mm: np.ndarray) -> np.ndarray:
        """Return the points that can touch, ``(..., lines, positions, 3)`` [mm]; see the base class."""
        nodes, frames = self.layout.nodes(blocks)[..., None, :, :], self.layout.frames(blocks)[..., None, :, :, :]
        lines = nodes + lines_mm[..., :1] * frames[..., 0] + lines_mm[..., 1:] * frames[..., 1]
        return subdivide(lines, self.settings.robot.between)

    def signed(self, blocks: np.ndarray, tensions: np.ndarray) -> np.ndarray:
        """Return tensions of the paper's model with the signs of its displacements; see the base class."""
        if self.settings.robot.model == "rod":
            return tensions
        return np.asarray(sides(self.layout.cables(blocks)) * tensions)

    def pose_features(self) -> Features:
        """Return the position of every node, and the first and last axis of its disk."""
        columns = np.arange(self.layout.size)
        axes = np.swapaxes(self.layout.frames(columns)[:, :, [0, 2]], 1, 2).ravel()
        nodes = self.layout.nodes(columns).ravel()
        return {"frames": Feature(axes, 1.0), "nodes": Feature(nodes, 1 / self.settings.reach_mm)}

    def disturb_pose(self, entries: Mapping[str, np.ndarray], errors: np.ndarray) -> None:
        """Add errors to positions, and turn the axes of the disks by rotation vectors; see the base class."""
        nodes, frames = entries["nodes"], entries["frames"]
        nodes += (errors[..., :3] / self.settings.reach_mm).reshape(nodes.shape)
        axes = frames.reshape(*errors.shape[:-1], 2, 3)
        turned = axes + np.cross(errors[..., None, 3:], axes)  # to first order, then of unit length again
        frames[...] = (turned / norm(turned)[..., None]).reshape(frames.shape)

    def obstacle_features(self, scene: Scene) -> np.ndarray:
        """Return centre, axis direction and radius of the first obstacle, in units of L, zeros where it has none."""
        features, length = np.zeros(self.obstacle_size), self.settings.reach_mm
        for obstacle in scene.obstacles[:1]:
            features[:3] = np.divide(obstacle.extent.center, length)
            if isinstance(obstacle, Capsule | Cylinder):
                axis = np.subtract(obstacle.end, obstacle.start)
                features[3:6] = axis / np.linalg.norm(axis)
            features[6] = getattr(obstacle, "radius", 0.0) / (RADIUS_SPAN * length)
        return features


AnyAdapter = RobotAdapter[Any]  # of whatever settings its task has
