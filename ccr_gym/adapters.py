"""Adapters from environments to robot models: one cable in the plane, the same with insertion, and space.

For a single robot with one cable they compute with Python floats, which is several times faster than with arrays.
"""

from abc import ABC, abstractmethod
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

import numpy as np

from ccr_gym.actions import ActionSpec
from ccr_gym.quantities import EnvIndex, Quantity, as_scalar, operations
from ccr_gym.scales import RADIUS_SCALE_MM
from ccr_gym.settings import AnySettings, InsertionSettings, Settings, SpatialSettings
from solver import BatchSolver, ReferenceBatch, Robot, Scene, Solver, virtual_work
from solver.common.batch import BaseBatch
from solver.common.layout import Layout
from solver.spatial import (
    Capsule,
    Cylinder,
    SpatialBatchSolver,
    SpatialRobot,
    SpatialSolver,
    sides,
    with_friction,
)
from solver.spatial import virtual_work as spatial_virtual_work

SettingsT = TypeVar("SettingsT", bound=AnySettings)
PlanarSettingsT = TypeVar("PlanarSettingsT", bound=Settings | InsertionSettings)


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
    """The interface between environments and a robot model: actions, observed features and force estimate.

    Attributes:
        settings_class: Settings of the environments.
        space: Dimension d of the space.
        cables: Number of actuated cable displacements.
        command_columns: Columns of the actuated coordinates in a command of the batch.
        obstacle_size: How many numbers of an obstacle are observed.
        settings: Settings of the environment.
        layout: Memory layout of an equilibrium block.
        actions: The actuated coordinates.
        actuated_columns: Their columns in an equilibrium block.
        clearance_column: Column of the smallest gap in an equilibrium block.

    Args:
        settings: Settings of the environment.
        layout: Memory layout of an equilibrium block.
    """

    settings_class: ClassVar[type[AnySettings]]
    space: ClassVar[int]
    cables: ClassVar[int]
    command_columns: ClassVar[int | slice]
    obstacle_size: ClassVar[int] = 0

    def __init__(self, settings: SettingsT, layout: Layout) -> None:
        self.settings, self.layout = settings, layout
        self.actions = self.action_spec(settings)
        columns = np.arange(layout.size)
        self.actuated_columns = _index(self._actuated(columns))
        self.clearance_column = _index(layout.clearance(columns))

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

    @classmethod
    @abstractmethod
    def action_spec(cls, settings: SettingsT) -> ActionSpec:
        """Return the actuated coordinates."""

    @abstractmethod
    def _actuated(self, blocks: np.ndarray) -> np.ndarray:
        """Return the actuated coordinates of blocks, ``(..., actions)``."""

    def clip(self, actions: np.ndarray) -> Quantity:
        """Return actions ``(..., actions)`` within [−1, 1]."""
        return np.minimum(np.maximum(actions.astype(float), -1.0), 1.0)

    def mean_square(self, actions: Quantity) -> Quantity:
        """Return the mean square over the actions."""
        return (actions[..., 0] * actions[..., 0] + actions[..., 1] * actions[..., 1]) / 2

    def command(self, blocks: np.ndarray, actions: Quantity, index: EnvIndex) -> Quantity:
        """Return the actuated coordinates that clipped actions ask for, within their bounds [mm]."""
        _, low, high, increment = self.actions
        return np.minimum(np.maximum(blocks[index, self.actuated_columns] + actions * increment, low), high)

    @abstractmethod
    def estimate(self, blocks: np.ndarray, force_true: np.ndarray, index: int | slice) -> np.ndarray:
        """Return the virtual-work estimate of the contact force, ``(..., d)`` [N].

        Args:
            blocks: Equilibria of the robots, ``(..., size)``.
            force_true: Their energy-based contact force, ``(..., d)`` [N].
            index: The robots.
        """

    @abstractmethod
    def info(self, blocks: np.ndarray, index: int | slice) -> dict[str, Quantity]:
        """Return the actuated coordinates and cable tensions for ``info``."""

    @abstractmethod
    def pose_features(self) -> Features:
        """Return the observed features of the shape."""

    def obstacle_features(self, scene: Scene) -> np.ndarray:
        """Return the observed numbers of the first obstacle, ``(obstacle_size,)``."""
        return np.zeros(0)


class PlanarAdapter(RobotAdapter[PlanarSettingsT]):
    """A planar robot with one cable; subclasses say what its actions move."""

    space, cables = 2, 1

    def __init__(self, settings: PlanarSettingsT, layout: Layout) -> None:
        super().__init__(settings, layout)
        columns = np.arange(layout.size)
        self._cable, self._tension = layout.cables(columns).item(), layout.tensions(columns).item()

    @classmethod
    def make_batch(cls, settings: PlanarSettingsT, count: int, obstacles: int, threads: int) -> BaseBatch:
        """Return a batch of the native solver, or of the reference solver."""
        batch = ReferenceBatch if settings.backend == "casadi" else BatchSolver
        return batch(settings.robot, count, obstacles, threads)

    @classmethod
    def check_scene(cls, settings: PlanarSettingsT, scene: Scene) -> None:
        """Raise an error if the robot cannot be put among these obstacles; see the base class."""
        Solver(settings.robot, scene)

    def estimate(self, blocks: np.ndarray, force_true: np.ndarray, index: int | slice) -> np.ndarray:
        """Return the paper's estimate, eq. 10 and 11, ``(..., 2)`` [N]."""
        force_est = np.zeros(force_true.shape)
        one = isinstance(index, int)
        x, y = force_true.tolist() if one else force_true.T
        if x == y == 0 if one else not force_true.any():
            return force_est
        friction = self.settings.estimator_friction
        x, y = x - friction * y, y + friction * x  # n + μ t, with t the normal turned by +90°
        slopes = self.layout.tip_slopes(blocks)
        load = blocks[..., self._tension] - self.layout.onset(blocks)[..., 0]
        if one:
            load, slopes = load.item(), slopes.tolist()
        else:
            slopes = slopes.T
        ratio = virtual_work(x, y, load, slopes, self.settings.robot.offset_mm, operations(index))
        force_est[..., 0], force_est[..., 1] = ratio * x, ratio * y
        return force_est

    def info(self, blocks: np.ndarray, index: int | slice) -> dict[str, Quantity]:
        """Return displacement and tension of the cable."""
        if isinstance(index, int):
            return {"cable_mm": blocks.item(self._cable), "tension": blocks.item(self._tension)}
        return {"cable_mm": blocks[..., self._cable].copy(), "tension": blocks[..., self._tension].copy()}

    def pose_features(self) -> Features:
        """Return position and disk angle of every node."""
        robot: Robot = self.settings.robot
        longest = robot.lengths_mm[1]
        nodes = self.layout.nodes(np.arange(self.layout.size)).ravel()
        return {"nodes": Feature(nodes, np.tile(1 / np.array([longest, longest, np.pi]), robot.segments + 1))}


class CableAdapter(PlanarAdapter[Settings]):
    """A planar robot whose single action pulls the cable; one robot's action is a float, those of many ``(N,)``."""

    settings_class, command_columns = Settings, 0

    @classmethod
    def action_spec(cls, settings: Settings) -> ActionSpec:
        """Return bounds and increment of the cable displacement."""
        return ActionSpec(1, np.zeros(1), np.array([settings.cable_limit_mm]), np.array([settings.max_increment_mm]))

    def _actuated(self, blocks: np.ndarray) -> np.ndarray:
        return self.layout.cables(blocks)

    def clip(self, actions: np.ndarray) -> Quantity:
        """Return the action within [−1, 1]."""
        if actions.ndim == 1:
            return min(max(actions.item(0), -1.0), 1.0)
        return np.minimum(np.maximum(actions[:, 0].astype(float), -1.0), 1.0)

    def mean_square(self, actions: Quantity) -> Quantity:
        """Return the square of the action."""
        return actions * actions

    def command(self, blocks: np.ndarray, actions: Quantity, index: EnvIndex) -> Quantity:
        """Return the displacement that clipped actions ask for, from 0 to the limit [mm]."""
        minimum, maximum, _ = operations(index)
        command = blocks[index, self._cable] + actions * self.settings.max_increment_mm
        return minimum(maximum(command, 0.0), self.settings.cable_limit_mm)


class InsertionAdapter(PlanarAdapter[InsertionSettings]):
    """A planar robot whose actions pull the cable and insert the base."""

    settings_class, command_columns = InsertionSettings, slice(0, 2)

    @classmethod
    def action_spec(cls, settings: InsertionSettings) -> ActionSpec:
        """Return bounds and increments of cable displacement and length."""
        shortest, longest = settings.robot.lengths_mm
        low, high = np.array([0.0, shortest]), np.array([settings.cable_limit_mm, longest])
        return ActionSpec(1, low, high, np.array([settings.max_increment_mm, settings.max_insertion_mm]))

    def _actuated(self, blocks: np.ndarray) -> np.ndarray:
        return np.concatenate([self.layout.cables(blocks), self.layout.length(blocks)], axis=-1)

    def info(self, blocks: np.ndarray, index: int | slice) -> dict[str, Quantity]:
        """Return displacement and tension of the cable, and the length of the robot."""
        return super().info(blocks, index) | {"length_mm": as_scalar(self.layout.length(blocks)[..., 0], index)}

    def pose_features(self) -> Features:
        """Return position and disk angle of every node, and the length of the robot."""
        length = self.layout.length(np.arange(self.layout.size))
        return super().pose_features() | {"length": Feature(length, 1 / self.settings.robot.lengths_mm[1])}


class SpatialAdapter(RobotAdapter[SpatialSettings]):
    """A robot in space whose actions move two signed displacements, each of a pair of opposite cables."""

    settings_class, command_columns = SpatialSettings, slice(0, 2)
    space, cables, obstacle_size = 3, 2, 7

    def __init__(self, settings: SpatialSettings, layout: Layout) -> None:
        super().__init__(settings, layout)
        self._slope_scale = np.array([1.0, 1.0, 1.0, *2 * [settings.robot.offset_mm]])

    @classmethod
    def make_batch(cls, settings: SpatialSettings, count: int, obstacles: int, threads: int) -> BaseBatch:
        """Return a batch of the native solver."""
        return SpatialBatchSolver(settings.robot, count, obstacles, threads)

    @classmethod
    def check_scene(cls, settings: SpatialSettings, scene: Scene) -> None:
        """Raise an error if the robot cannot be put among these obstacles; see the base class."""
        SpatialSolver(settings.robot, scene)

    @classmethod
    def action_spec(cls, settings: SpatialSettings) -> ActionSpec:
        """Return bounds and increments of both signed displacements."""
        limit = np.full(2, settings.cable_limit_mm)
        return ActionSpec(2, -limit, limit, np.full(2, settings.max_increment_mm))

    def _actuated(self, blocks: np.ndarray) -> np.ndarray:
        return self.layout.cables(blocks)

    def estimate(self, blocks: np.ndarray, force_true: np.ndarray, index: int | slice) -> np.ndarray:
        """Return the estimate of :class:`solver.spatial.SpatialVirtualWork`, ``(..., 3)`` [N]."""
        if not force_true.any():
            return np.zeros(force_true.shape)
        layout = self.layout
        slopes = layout.tip_slopes(blocks) * self._slope_scale
        loads = sides(layout.cables(blocks)) * layout.tensions(blocks) - layout.onset(blocks)
        forces = with_friction(force_true, slopes[..., :3], self.settings.estimator_friction)
        return np.asarray(spatial_virtual_work(forces, loads, slopes)[..., None] * forces)

    def info(self, blocks: np.ndarray, index: int | slice) -> dict[str, Quantity]:
        """Return displacements and tensions of both pairs of cables, ``(..., 2)`` each."""
        return {"cable_mm": self.layout.cables(blocks).copy(), "tension": self.layout.tensions(blocks).copy()}

    def pose_features(self) -> Features:
        """Return the position of every node, and the first and last axis of its disk."""
        robot: SpatialRobot = self.settings.robot
        columns = np.arange(self.layout.size)
        axes = np.swapaxes(self.layout.frames(columns)[:, :, [0, 2]], 1, 2).ravel()
        return {"frames": Feature(axes, 1.0), "nodes": Feature(self.layout.nodes(columns).ravel(), 1 / robot.length_mm)}

    def obstacle_features(self, scene: Scene) -> np.ndarray:
        """Return centre [mm], axis direction and scaled radius of the first obstacle, zeros where it has none."""
        features = np.zeros(self.obstacle_size)
        for obstacle in scene.obstacles[:1]:
            features[:3] = obstacle.extent.center
            if isinstance(obstacle, Capsule | Cylinder):
                axis = np.subtract(obstacle.end, obstacle.start)
                features[3:6] = axis / np.linalg.norm(axis)
            features[6] = getattr(obstacle, "radius", 0.0) / RADIUS_SCALE_MM
        return features


AnyAdapter = RobotAdapter[Any]  # of whatever settings its task has


def _index(columns: np.ndarray) -> int | slice:
    """Return consecutive columns as the index that numpy is fastest with."""
    first, size = int(columns[0]), columns.size
    assert (columns == np.arange(first, first + size)).all()
    return first if size == 1 else slice(first, first + size)
