"""Solver in space: follows the equilibria of one robot in one scene step by step."""

from collections.abc import Sequence

import numpy as np

from solver import _kernel
from solver.common.checks import check_core, check_origin, check_rest, check_scene, check_start
from solver.common.copying import RebuiltFromScene
from solver.common.equilibrium import Optimality
from solver.common.kernel_input import kernel_obstacles, kernel_rod
from solver.common.layout import SPACE
from solver.common.rod import check_cables
from solver.common.scene import Scene
from solver.common.trace import Trace, read_trace
from solver.spatial.equilibrium import SpatialEquilibrium
from solver.spatial.robot import SpatialRobot, stiffness_ratios


class SpatialCommandCheck(RebuiltFromScene):
    """Checks the commands of a solver in space, whatever it solves by."""

    robot: SpatialRobot
    scene: Scene

    def check_command(
        self,
        equilibrium: SpatialEquilibrium,
        cables_mm: Sequence[float] | np.ndarray,
        *,
        scene: Scene | None = None,
    ) -> tuple[float, ...]:
        """Return commanded displacements as floats.

        Raises:
            ValueError: If it is out of range, or the equilibrium is another robot's or scene's, or one that the
                obstacles cannot move from to a given scene.
            TypeError: If ``equilibrium`` is not one in space.
        """
        cables = check_cables(self.robot, "cables_mm", cables_mm)
        if scene is None:
            check_origin(self.robot, self.scene, equilibrium, SpatialEquilibrium)
        else:
            check_start(self.robot, 3, equilibrium, SpatialEquilibrium, scene)
        return cables


class SpatialSolver(SpatialCommandCheck):
    """Follows the equilibria of a robot among obstacles in space as its cables are pulled and released (eq. 13).

    The equilibrium reached depends on the way there, so the present one is an argument of every step and the solver
    keeps none. Ctrl-C, like any signal whose handler raises, ends a step within a fraction of a second.

    Args:
        robot: The robot.
        scene: The obstacles, of :mod:`solver.spatial`.

    Raises:
        ValueError: If an obstacle is one of the plane, overlaps the unstressed robot, which is straight but for its
            precurvature, is small enough to slip between its points, names a node the robot does not have, or is out of
            proportion to the robot; or if the motors cannot carry the robot's loads at rest.
        TypeError: If the robot or the scene is of the wrong class.
    """

    def __init__(self, robot: SpatialRobot, scene: Scene) -> None:
        check_scene(robot, SpatialRobot, scene, 3)
        self.robot, self.scene = robot, scene
        check_core(robot, scene)
        self._kernel = _kernel.SpatialKernel(kernel_robot(robot), kernel_scene(robot, scene))
        block = np.empty(self._kernel.block_size)
        work = self._kernel.rest(robot.length_mm, block)
        self._rest = SpatialEquilibrium.solved(robot, scene, block, *work)
        check_rest(self._rest)

    def rest(self) -> SpatialEquilibrium:
        """Return the unactuated robot under its loads, straight where it has neither loads nor precurvature.

        A cable that would hold a precurved robot back is paid out until it just does not, and one that the loads pull
        with more than ``max_tension`` until its motor holds it: ``STALLED``.
        """
        return self._rest

    def step(
        self,
        equilibrium: SpatialEquilibrium,
        cables_mm: Sequence[float] | np.ndarray,
        *,
        scene: Scene | None = None,
    ) -> SpatialEquilibrium:
        """Move both pairs of cables to displacements, at proportional rates, as far as tension and obstacles allow.

        A cable whose tension reaches the limit stops there, while the other moves on.

        Args:
            equilibrium: State to start from, of this solver or one of an equal robot and scene.
            cables_mm: Displacement of each cable, within ±``robot.max_cable_mm`` [mm]; a negative one pays it out. In
                the paper's model that of each pair, whose sign selects the cable that is pulled.
            scene: Where the obstacles move to within the step, as in the plane.

        Returns:
            The equilibrium reached; its ``status`` says how. While anything touches, the cables are not slackened
            together below a pretension of a/160, where the shape would be undetermined.

        Raises:
            ValueError: If a command is out of range or the equilibrium is another robot's or scene's.
            TypeError: If ``equilibrium`` is not one in space.
        """
        command = (*self.check_command(equilibrium, cables_mm, scene=scene), self.robot.length_mm)
        reached = np.empty_like(equilibrium.block)
        if scene is None:
            work = self._kernel.step(equilibrium.block, command, reached)
            return SpatialEquilibrium.solved(self.robot, self.scene, reached, *work)
        start, bounds = equilibrium.scene, equilibrium.scene.check_motion(scene)
        scenes = kernel_scene(self.robot, start), kernel_scene(self.robot, scene)
        *moved, part = self._kernel.move(equilibrium.block, command, *scenes, bounds, reached)
        return SpatialEquilibrium.solved(self.robot, start.moved_towards(scene, part), reached, *moved)

    def trace(self, equilibrium: SpatialEquilibrium, cables_mm: Sequence[float] | np.ndarray) -> Trace:
        """Return every shape accepted on the way of :meth:`step`, beginning with the present one.

        Raises:
            ValueError: As :meth:`step`.
        """
        command = (*self.check_command(equilibrium, cables_mm), self.robot.length_mm)
        shapes = self._kernel.trace(equilibrium.block, command)
        return read_trace(shapes, self.robot, self.scene, 3)

    def optimality(self, equilibrium: SpatialEquilibrium) -> Optimality:
        """Return the optimality residuals of an equilibrium, recomputed by the kernel.

        Raises:
            ValueError: If the equilibrium is another robot's or scene's.
        """
        check_origin(self.robot, self.scene, equilibrium, SpatialEquilibrium)
        return Optimality(*self._kernel.optimality(equilibrium.block))


def kernel_robot(robot: SpatialRobot) -> _kernel.Robot:
    """A robot as the kernel takes it."""
    return _kernel.Robot(
        model=SPACE[robot.model].kind,
        segments=robot.segments,
        offset=robot.offset_mm,
        angle=robot.angle,
        rigidity=robot.rigidity,
        max_tension=robot.max_tension,
        max_length=robot.length_mm,
        disk_radius=robot.edge_mm,
        disk_thickness=robot.disk_thickness_mm,
        lines=robot.lines_mm.tolist(),
        edges=list(robot.edges_mm),
        between=robot.between,
        rod=_kernel_rod(robot) if robot.model == "rod" else _kernel.Rod(),
    )


def _kernel_rod(robot: SpatialRobot) -> _kernel.Rod:
    at_rest = np.broadcast_to(robot.precurvature, (robot.segments, 3))
    return kernel_rod(robot, stiffness_ratios(robot), at_rest, robot.bounded_twist)


def kernel_scene(robot: SpatialRobot, scene: Scene) -> list[_kernel.SpatialObstacle]:
    """Obstacles as the kernel takes them.

    Raises:
        ValueError: If an obstacle names a node that the robot does not have.
    """
    return [_kernel.SpatialObstacle(**obstacle) for obstacle in kernel_obstacles(robot, scene)]
