"""Many robots in the plane, moved by one call."""

from functools import lru_cache

import numpy as np

from solver import _kernel
from solver.common.batch_moves import SlopeArrays
from solver.common.batch_slopes import SlopeBatch
from solver.common.layout import Layout
from solver.common.rows import Motion
from solver.common.scene import Scene
from solver.common.status import Status
from solver.planar.equilibrium import Equilibrium, touching_points, unstressed_nodes
from solver.planar.layout import layout
from solver.planar.reference import ReferenceSolver
from solver.planar.robot import Robot
from solver.planar.solve import kernel_robot, kernel_scene


class BatchSolver(SlopeBatch[Robot, Equilibrium]):
    """Moves many robots in the plane by one call, with the results of :class:`solver.Solver`.

    See :class:`~solver.common.batch.RobotBatch` and :meth:`~solver.common.batch_slopes.SlopeBatch.slopes`.
    """

    space = 2
    robot_kind = Robot

    def _unstressed_points(self, robot: Robot) -> np.ndarray:
        return touching_points(robot, unstressed_nodes(robot))

    def _make_layout(self, robot: Robot, obstacles: int) -> Layout:
        return layout(robot, obstacles)

    def _make_kernel(self, obstacles: int, threads: int) -> _kernel.Batch:
        return _kernel.Batch(kernel_robot(self.robot), self.count, obstacles, threads)

    def _kernel_robot(self, robot: Robot) -> _kernel.Robot:
        return kernel_robot(robot)

    def _kernel_obstacles(self, robot: Robot, scene: Scene) -> list[_kernel.Obstacle]:
        return kernel_scene(robot, scene)

    def _make_equilibrium(
        self, robot: Robot, scene: Scene, block: np.ndarray, status: Status, *work: int
    ) -> Equilibrium:
        return Equilibrium(robot, scene, block, status, *work)


class ReferenceBatch(BatchSolver):
    """Moves robots by :class:`solver.ReferenceSolver`, slowly and one after the other.

    The trial pulls of :meth:`ramp_reaches_force` still use the kernel.
    """

    def _rest(self, robots: list[int]) -> None:
        for robot in robots:
            self._keep(robot, self._reference(robot).rest())

    def _slope_arrays(self, count: int, rows: int) -> SlopeArrays:
        raise ValueError("a ReferenceBatch has no derivatives of its steps; use a BatchSolver")

    def _move(self, robots: list[int], slopes: SlopeArrays | None = None) -> None:
        for robot in robots:
            wanted = self.commands[robot, :-1].tolist()
            self._keep(robot, self._reference(robot).step(self._equilibrium(robot), wanted))

    def _move_into(
        self, robots: list[int], motions: list[Motion], parts: np.ndarray, slopes: SlopeArrays | None = None
    ) -> None:
        raise ValueError("obstacles of a ReferenceBatch do not move; use a BatchSolver")

    def _reference(self, robot: int) -> ReferenceSolver:
        return _reference(self.robot_of(robot), self.scene(robot))

    def _keep(self, robot: int, reached: Equilibrium) -> None:
        self.blocks[robot] = reached.block
        self.statuses[robot], self.iterations[robot] = reached.status, reached.iterations


@lru_cache(maxsize=64)
def _reference(robot: Robot, scene: Scene) -> ReferenceSolver:
    return ReferenceSolver(robot, scene)
