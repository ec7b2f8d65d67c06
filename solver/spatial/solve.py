"""The solver in space: one robot in one scene, or many side by side."""

from typing import ClassVar

import numpy as np

from solver import _kernel
from solver.common.batch import BaseBatch
from solver.common.checks import check_clear, check_core, check_origin, check_scene
from solver.common.equilibrium import Optimality
from solver.common.kernel_input import kernel_obstacles
from solver.common.layout import SPACE, Layout, Model
from solver.common.scene import Scene
from solver.common.status import Status
from solver.common.trace import Trace, read_trace
from solver.common.validation import number, sequence, shown
from solver.spatial.equilibrium import SpatialEquilibrium, spatial_layout, touching_points
from solver.spatial.robot import SpatialRobot


class SpatialSolver:
    """Follows the equilibria of a robot among obstacles in space as its cables are pulled and released (eq. 13).

    The equilibrium reached depends on the way there, so the present one is an argument of every step and the solver
    keeps none.

    Args:
        robot: The robot.
        scene: The obstacles, of :mod:`solver.spatial`.

    Raises:
        ValueError: If an obstacle is one of the plane, overlaps the straight robot, is narrow enough to slip between
            its points, names a node the robot does not have, or is out of all proportion to it.
        TypeError: If the robot or the scene is something else.
    """

    def __init__(self, robot: SpatialRobot, scene: Scene) -> None:
        check_scene(robot, SpatialRobot, scene, SPACE)
        self.robot, self.scene = robot, scene
        check_core(robot, scene)
        self._kernel = _kernel.SpatialKernel(kernel_robot(robot), kernel_scene(robot, scene))
        straight = np.zeros(self._kernel.block_size)
        straight[spatial_layout(robot, len(scene)).length.at] = robot.length_mm
        self._rest = self._follow(straight, np.zeros(2))
        check_clear(robot, scene, self._rest.gaps)

    def rest(self) -> SpatialEquilibrium:
        """The straight, unactuated robot."""
        return self._rest

    def step(self, equilibrium: SpatialEquilibrium, cables_mm: tuple[float, float] | np.ndarray) -> SpatialEquilibrium:
        """Move both pairs of cables evenly to displacements, as far as tension and obstacles allow.

        A cable whose tension reaches the limit stops there, and the other goes on by itself.

        Args:
            equilibrium: Where the robot is, from this solver or one of an equal robot and scene.
            cables_mm: Displacement of each pair, within ±``robot.max_cable_mm`` [mm]; the sign tells which of its
                cables is pulled.

        Returns:
            The equilibrium reached; its ``status`` says how. While anything touches, the cables are not slackened
            together below a pretension of a/160, where the shape would be undetermined.

        Raises:
            ValueError: If a command is out of range or the equilibrium is another robot's or scene's.
            TypeError: If ``equilibrium`` is something else.
        """
        cables = check_cables(self.robot, self.scene, equilibrium, cables_mm)
        return self._follow(equilibrium.block, cables)

    def trace(self, equilibrium: SpatialEquilibrium, cables_mm: tuple[float, float] | np.ndarray) -> Trace:
        """Every shape accepted on the way of :meth:`step`, from the present one on.

        Raises:
            ValueError: As :meth:`step`.
        """
        cables = check_cables(self.robot, self.scene, equilibrium, cables_mm)
        shapes = self._kernel.trace(equilibrium.block, (*cables, self.robot.length_mm))
        return read_trace(shapes, self.robot, self.scene, 3)

    def optimality(self, equilibrium: SpatialEquilibrium) -> Optimality:
        """How well an equilibrium meets its conditions, computed anew by the kernel.

        Raises:
            ValueError: If the equilibrium is another robot's or scene's.
        """
        check_origin(self.robot, self.scene, equilibrium, SpatialEquilibrium)
        return Optimality(*self._kernel.optimality(equilibrium.block))

    def check_command(
        self, equilibrium: SpatialEquilibrium, cables_mm: tuple[float, float] | np.ndarray
    ) -> tuple[float, ...]:
        """Return a command as floats.

        Raises:
            ValueError: If it is out of range, or the equilibrium is another robot's or scene's.
            TypeError: If ``equilibrium`` is something else.
        """
        return tuple(check_cables(self.robot, self.scene, equilibrium, cables_mm).tolist())

    def _follow(self, block: np.ndarray, cables: np.ndarray) -> SpatialEquilibrium:
        reached = np.empty_like(block)
        first, second = cables.tolist()
        work = self._kernel.step(block, first, second, self.robot.length_mm, reached)
        return SpatialEquilibrium.solved(self.robot, self.scene, reached, *work)


class SpatialBatchSolver(BaseBatch):
    """Many robots in space, each moved as :class:`SpatialSolver` would; see :class:`solver.common.batch.BaseBatch`."""

    model: ClassVar[Model] = SPACE
    robot_kind: ClassVar[type] = SpatialRobot

    def _straight_points(self) -> np.ndarray:
        nodes = np.zeros((self.robot.segments + 1, 3))
        nodes[:, 2] = np.linspace(0.0, self.robot.length_mm, len(nodes))
        return touching_points(self.robot, nodes, np.tile(np.eye(3), (len(nodes), 1, 1)))

    def _make_layout(self, obstacles: int) -> Layout:
        return spatial_layout(self.robot, obstacles)

    def _make_kernel(self, obstacles: int, threads: int) -> _kernel.SpatialBatch:
        return _kernel.SpatialBatch(kernel_robot(self.robot), self.count, obstacles, threads)

    def _kernel_obstacles(self, scene: Scene) -> list[_kernel.SpatialObstacle]:
        return kernel_scene(self.robot, scene)

    def _make_equilibrium(self, scene: Scene, block: np.ndarray, status: Status, *work: int) -> SpatialEquilibrium:
        return SpatialEquilibrium(self.robot, scene, block, status, *work)


def kernel_robot(robot: SpatialRobot) -> _kernel.Robot:
    """A robot as the kernel takes it."""
    return _kernel.Robot(
        model=SPACE.kind,
        segments=robot.segments,
        offset=robot.offset_mm,
        angle=robot.angle,
        rigidity=robot.rigidity,
        max_tension=robot.max_tension,
        max_length=robot.length_mm,
        disk_radius=robot.offset_mm,
        disk_thickness=0.0,
        lines=robot.lines_mm.tolist(),
        edges=list(robot.edges_mm),
        between=robot.between,
    )


def kernel_scene(robot: SpatialRobot, scene: Scene) -> list[_kernel.SpatialObstacle]:
    """Obstacles as the kernel takes them.

    Raises:
        ValueError: If an obstacle names a node that the robot does not have.
    """
    return [_kernel.SpatialObstacle(**obstacle) for obstacle in kernel_obstacles(robot, scene)]


def check_cables(
    robot: SpatialRobot, scene: Scene, equilibrium: SpatialEquilibrium, cables_mm: tuple[float, float] | np.ndarray
) -> np.ndarray:
    """Refuse a command out of range and an equilibrium of another robot or scene; returns the command, ``(2,)``.

    Raises:
        ValueError: Naming the value and the bound.
        TypeError: If the equilibrium is something else.
    """
    limit = robot.cable_limit_mm
    bound = f"a pair, both within ±{limit:.6g} (robot.max_cable_mm)"
    cables = [
        number("an entry of cables_mm", cable, -limit, limit, bound)
        for cable in sequence("cables_mm", cables_mm, bound)
    ]
    if len(cables) != 2:
        raise ValueError(f"cables_mm is {shown(cables_mm)}; it must be {bound}")
    check_origin(robot, scene, equilibrium, SpatialEquilibrium)
    return np.array(cables)
