"""What an environment has to know of its robot's model: the plane with one cable, or space with two signed ones.

The arithmetic of one robot in the plane is that of plain numbers, which is several times faster than that of arrays.
"""

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np

from ccr_gym.settings import InsertionSettings, Settings, SpatialSettings
from solver import Robot, Scene
from solver.common.batch import BaseBatch
from solver.common.layout import CABLE, LENGTH, PLANE, SPACE, TENSION, Layout, Model
from solver.common.operations import ARRAYS, NUMBERS, Operations
from solver.planar.batch import BatchSolver, ReferenceBatch
from solver.planar.forces import virtual_work
from solver.planar.layout import layout
from solver.spatial import Capsule, Cylinder, SpatialBatchSolver, SpatialRobot
from solver.spatial import forces as spatial_forces
from solver.spatial.equilibrium import spatial_layout
from solver.spatial.robot import sides

Which = int | slice | list[int]
Seen = dict[str, tuple[np.ndarray, np.ndarray | float]]
PLACE_SCALE_MM = 20.0  # of an obstacle's radius in the observation


class Body(ABC):
    """The model of a robot as an environment sees it.

    Attributes:
        model: How many numbers describe a robot.
        settings: What an environment is told.
        actions: Numbers of an action.
        place: Where what they move stands in a command, and in a block: a number for one cable.
        obstacle_size: How many numbers of an obstacle are seen.
    """

    model: ClassVar[Model]
    settings: ClassVar[type[Settings]]
    actions: ClassVar[int]
    place: ClassVar[int | slice]
    obstacle_size: ClassVar[int] = 0

    @abstractmethod
    def batch(self, settings: Any, count: int, obstacles: int, threads: int) -> BaseBatch:
        """The solver."""

    def layout(self, robot: Any, obstacles: int) -> Layout:
        """Where the numbers of an equilibrium stand."""
        return layout(robot, obstacles)

    def operations(self, which: Which) -> Operations:
        """The arithmetic of what is one number for a robot: plain for one of them, arrays for many."""
        return NUMBERS if isinstance(which, int) else ARRAYS

    def effort(self, actions: np.ndarray) -> Any:
        """Actions ``(..., actions)`` within their bounds."""
        return np.minimum(np.maximum(actions.astype(float), -1.0), 1.0)

    @abstractmethod
    def bounds(self, settings: Any) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest of what actions move, ``(actions,)`` each [mm]."""

    def increments(self, settings: Any) -> np.ndarray:
        """What full actions move, ``(actions,)`` [mm]."""
        return np.full(self.actions, settings.max_increment_mm)

    def command(self, blocks: np.ndarray, effort: Any, which: Which, settings: Any) -> Any:
        """What an effort asks for, within bounds [mm]."""
        low, high = self.bounds(settings)
        command = blocks[which, self.place] + effort * self.increments(settings)
        return np.minimum(np.maximum(command, low), high)

    def square(self, effort: Any) -> Any:
        """Mean square of an effort over the actions."""
        return (effort[..., 0] * effort[..., 0] + effort[..., 1] * effort[..., 1]) / 2

    @abstractmethod
    def estimate(
        self, blocks: np.ndarray, layout: Layout, force_true: np.ndarray, which: int | slice, settings: Any
    ) -> np.ndarray:
        """Virtual-work estimate of the contact force, ``(..., d)`` [N]."""

    @abstractmethod
    def told(self, blocks: np.ndarray, which: int | slice) -> dict[str, Any]:
        """Displacement and tension of the cables, for ``info``."""

    @abstractmethod
    def poses(self, robot: Any, layout: Layout) -> Seen:
        """What is seen of the shape: numbers of the block, and their scale."""

    def obstacle(self, scene: Scene) -> np.ndarray:
        """What is seen of the first obstacle, ``(obstacle_size,)``."""
        return np.zeros(0)


class Plane(Body):
    """One cable in the plane."""

    model, settings, actions = PLANE, Settings, 1
    place: ClassVar[int | slice] = CABLE

    def batch(self, settings: Any, count: int, obstacles: int, threads: int) -> BaseBatch:
        """The solver."""
        solver = ReferenceBatch if settings.backend == "casadi" else BatchSolver
        return solver(settings.robot, count, obstacles, threads)

    def effort(self, actions: np.ndarray) -> Any:
        """A number for one robot, ``(N,)`` for many."""
        if actions.ndim == 1:
            return min(max(actions.item(0), -1.0), 1.0)
        return np.minimum(np.maximum(actions[:, 0].astype(float), -1.0), 1.0)

    def bounds(self, settings: Any) -> tuple[np.ndarray, np.ndarray]:
        """Of the cable."""
        return np.zeros(1), np.array([settings.cable_limit_mm])

    def command(self, blocks: np.ndarray, effort: Any, which: Which, settings: Any) -> Any:
        """A displacement from 0 to the limit."""
        minimum, maximum, _ = self.operations(which)
        command = blocks[which, CABLE] + effort * settings.max_increment_mm
        return minimum(maximum(command, 0.0), settings.cable_limit_mm)

    def square(self, effort: Any) -> Any:
        """The square of the one."""
        return effort * effort

    def estimate(
        self, blocks: np.ndarray, layout: Layout, force_true: np.ndarray, which: int | slice, settings: Settings
    ) -> np.ndarray:
        """Eq. 10 and 11 of the paper, ``(..., 2)`` [N]."""
        force_est = np.zeros(force_true.shape)
        one = isinstance(which, int)
        x, y = force_true.tolist() if one else force_true.T
        if x == y == 0 if one else not force_true.any():
            return force_est
        x, y = x - settings.estimator_friction * y, y + settings.estimator_friction * x
        slopes = layout.tip_slopes(blocks)
        load = blocks[..., TENSION] - layout.onset(blocks)[..., 0]
        if one:
            load, slopes = load.item(), slopes.tolist()
        else:
            slopes = slopes.T
        ratio = virtual_work(x, y, load, slopes, settings.robot.offset_mm, self.operations(which))
        force_est[..., 0], force_est[..., 1] = ratio * x, ratio * y
        return force_est

    def told(self, blocks: np.ndarray, which: int | slice) -> dict[str, Any]:
        """Plain numbers for one robot, ``(N,)`` for many."""
        if isinstance(which, int):
            return {"cable_mm": blocks.item(CABLE), "tension": blocks.item(TENSION)}
        return {"cable_mm": blocks[..., CABLE].copy(), "tension": blocks[..., TENSION].copy()}

    def poses(self, robot: Robot, layout: Layout) -> Seen:
        """Place and angle of every node."""
        pose_scale = 1 / np.array([robot.lengths_mm[1], robot.lengths_mm[1], np.pi])
        nodes = layout.nodes(np.arange(layout.size)).ravel()
        return {"nodes": (nodes, np.tile(pose_scale, robot.segments + 1))}


class Insertion(Plane):
    """One cable in the plane, and a base that inserts the robot."""

    settings, actions = InsertionSettings, 2
    place: ClassVar[int | slice] = slice(CABLE, LENGTH + 1)

    def bounds(self, settings: Any) -> tuple[np.ndarray, np.ndarray]:
        """Of the cable, and of the length."""
        shortest, longest = settings.robot.lengths_mm
        return np.array([0.0, shortest]), np.array([settings.cable_limit_mm, longest])

    def increments(self, settings: Any) -> np.ndarray:
        """Of the cable, and of the insertion."""
        return np.array([settings.max_increment_mm, settings.max_insertion_mm])

    effort, command, square = Body.effort, Body.command, Body.square  # of two numbers

    def told(self, blocks: np.ndarray, which: int | slice) -> dict[str, Any]:
        """The length of the robot beside them."""
        return super().told(blocks, which) | {"length_mm": plain(blocks[..., LENGTH], which)}

    def poses(self, robot: Robot, layout: Layout) -> Seen:
        """The length of the robot beside them."""
        return super().poses(robot, layout) | {"length": (np.array([LENGTH]), 1 / robot.lengths_mm[1])}


class Space(Body):
    """Two pairs of cables in space."""

    model, settings, actions = SPACE, SpatialSettings, 2
    place: ClassVar[int | slice] = slice(0, 2)
    obstacle_size = 7

    def batch(self, settings: Any, count: int, obstacles: int, threads: int) -> BaseBatch:
        """The solver."""
        return SpatialBatchSolver(settings.robot, count, obstacles, threads)

    def layout(self, robot: SpatialRobot, obstacles: int) -> Layout:
        """That of a robot in space."""
        return spatial_layout(robot, obstacles)

    def bounds(self, settings: Any) -> tuple[np.ndarray, np.ndarray]:
        """Of both displacements, either way."""
        limit = np.full(2, settings.cable_limit_mm)
        return -limit, limit

    def estimate(
        self, blocks: np.ndarray, layout: Layout, force_true: np.ndarray, which: int | slice, settings: SpatialSettings
    ) -> np.ndarray:
        """As :mod:`solver.spatial.forces` has it, ``(..., 3)`` [N]."""
        if not force_true.any():
            return np.zeros(force_true.shape)
        slopes = layout.tip_slopes(blocks) * np.array([1.0, 1.0, 1.0, *2 * [settings.robot.offset_mm]])
        loads = sides(layout.cables(blocks)) * layout.tensions(blocks) - layout.onset(blocks)
        forces = spatial_forces.with_friction(force_true, slopes[..., :3], settings.estimator_friction)
        return np.asarray(spatial_forces.virtual_work(forces, loads, slopes)[..., None] * forces)

    def told(self, blocks: np.ndarray, which: int | slice) -> dict[str, Any]:
        """``(..., 2)`` each."""
        return {"cable_mm": blocks[..., 0:2].copy(), "tension": blocks[..., 3:5].copy()}

    def poses(self, robot: SpatialRobot, layout: Layout) -> Seen:
        """Place of every node, and the first and last axis of its disk."""
        numbers = np.arange(layout.size)
        axes = layout.frames(numbers)[:, :, [0, 2]]
        return {
            "frames": (np.swapaxes(axes, 1, 2).ravel(), 1.0),
            "nodes": (layout.nodes(numbers).ravel(), 1 / robot.length_mm),
        }

    def obstacle(self, scene: Scene) -> np.ndarray:
        """Centre [mm], direction of the axis or zero, and radius over 20 mm; zero without one."""
        seen = np.zeros(self.obstacle_size)
        for obstacle in scene.obstacles[:1]:
            seen[:3] = obstacle.extent.center
            if isinstance(obstacle, Capsule | Cylinder):
                axis = np.subtract(obstacle.end, obstacle.start)
                seen[3:6] = axis / np.linalg.norm(axis)
            seen[6] = getattr(obstacle, "radius", 0.0) / PLACE_SCALE_MM
        return seen


def plain(value: Any, which: Which) -> Any:
    """A number of one robot as Python's own, those of many as an array of their own."""
    return value.item() if isinstance(which, int) else value.copy()


IN_PLANE, INSERTED, IN_SPACE = Plane(), Insertion(), Space()
