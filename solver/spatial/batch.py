"""Many robots in space, moved by one call."""

import numpy as np

from solver import _kernel
from solver.common.batch_slopes import SlopeBatch
from solver.common.layout import Layout
from solver.common.scene import Scene
from solver.common.status import Status
from solver.spatial.equilibrium import SpatialEquilibrium, spatial_layout, touching_points, unstressed_nodes
from solver.spatial.robot import SpatialRobot
from solver.spatial.solve import kernel_robot, kernel_scene


class SpatialBatchSolver(SlopeBatch[SpatialRobot, SpatialEquilibrium]):
    """Moves many robots in space by one call, with the results of :class:`solver.spatial.SpatialSolver`.

    See :class:`~solver.common.batch.RobotBatch` and :meth:`~solver.common.batch_slopes.SlopeBatch.slopes`.
    """

    space = 3
    robot_kind = SpatialRobot

    def _unstressed_points(self, robot: SpatialRobot) -> np.ndarray:
        return touching_points(robot, *unstressed_nodes(robot))

    def _make_layout(self, robot: SpatialRobot, obstacles: int) -> Layout:
        return spatial_layout(robot, obstacles)

    def _make_kernel(self, obstacles: int, threads: int) -> _kernel.SpatialBatch:
        return _kernel.SpatialBatch(kernel_robot(self.robot), self.count, obstacles, threads)

    def _kernel_robot(self, robot: SpatialRobot) -> _kernel.Robot:
        return kernel_robot(robot)

    def _kernel_obstacles(self, robot: SpatialRobot, scene: Scene) -> list[_kernel.SpatialObstacle]:
        return kernel_scene(robot, scene)

    def _make_equilibrium(
        self, robot: SpatialRobot, scene: Scene, block: np.ndarray, status: Status, *work: int
    ) -> SpatialEquilibrium:
        return SpatialEquilibrium(robot, scene, block, status, *work)
