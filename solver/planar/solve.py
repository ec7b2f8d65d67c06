"""Solver in the plane: follows the equilibria of one robot in one scene step by step."""

from collections.abc import Sequence

import numpy as np

from solver import _kernel
from solver.common.checks import check_core, check_origin, check_rest, check_scene, check_start
from solver.common.copying import RebuiltFromScene
from solver.common.equilibrium import Optimality
from solver.common.kernel_input import kernel_obstacles, kernel_rod
from solver.common.layout import PLANE
from solver.common.rod import bending_ratios, check_cables
from solver.common.scene import Scene
from solver.common.trace import Trace, read_trace
from solver.planar.equilibrium import Equilibrium
from solver.planar.robot import Robot


class CommandCheck(RebuiltFromScene):
    """Checks the commands of a solver in the plane, whatever it solves by."""

    robot: Robot
    scene: Scene

    def check_command(
        self,
        equilibrium: Equilibrium,
        cable_mm: float | Sequence[float],
        length_mm: float | None = None,
        *,
        scene: Scene | None = None,
    ) -> tuple[float, ...]:
        """Return a command as floats, cables and length, with the present length where none is given.

        Raises:
            ValueError: If it is out of range, or the equilibrium is another robot's or scene's, or one that the
                obstacles cannot move from to a given scene.
            TypeError: If ``equilibrium`` is not one of the plane.
        """
        if type(cable_mm) is float and 0 < cable_mm <= self.robot.cable_limit_mm and len(self.robot.cables) == 1:
            cables: tuple[float, ...] = (cable_mm,)
        else:
            cables = check_cables(self.robot, "cable_mm", cable_mm)
        if scene is None:
            check_origin(self.robot, self.scene, equilibrium, Equilibrium)
        else:
            check_start(self.robot, 2, equilibrium, Equilibrium, scene)
        return *cables, equilibrium.length_mm if length_mm is None else self.robot.check_length(length_mm)


class Solver(CommandCheck):
    """Follows the equilibria of a robot among obstacles as its cable is pulled and released (eq. 5).

    The equilibrium reached depends on the way there, so the present one is an argument of every step and the solver
    keeps none. Ctrl-C, like any signal whose handler raises, ends a step within a fraction of a second.

    Args:
        robot: The robot.
        scene: The obstacles.

    Raises:
        ValueError: If an obstacle is one of space, overlaps the unstressed robot, which is straight but for its
            precurvature, is small enough to slip between its points, names a node the robot does not have, or is out of
            proportion to the robot; or if the motors cannot carry the robot's loads at rest.
        TypeError: If the robot or the scene is of the wrong class.
        RuntimeError: If a :class:`~solver.planar.custom.Custom` shape cannot be compiled.
    """

    def __init__(self, robot: Robot, scene: Scene) -> None:
        check_scene(robot, Robot, scene, 2)
        self.robot = robot
        self.scene = scene
        check_core(robot, scene)
        self._kernel = _kernel.Kernel(kernel_robot(robot), kernel_scene(robot, scene))
        block = np.empty(self._kernel.block_size)
        work = self._kernel.rest(robot.length_mm, block)
        self._rest = Equilibrium.solved(robot, scene, block, *work)
        check_rest(self._rest)

    def rest(self) -> Equilibrium:
        """Return the unactuated robot under its loads, straight where it has neither loads nor precurvature.

        A cable that would hold a precurved robot back is paid out until it just does not, and one that the loads pull
        with more than ``max_tension`` until its motor holds it: ``STALLED``.
        """
        return self._rest

    def step(
        self,
        equilibrium: Equilibrium,
        cable_mm: float | Sequence[float],
        length_mm: float | None = None,
        *,
        scene: Scene | None = None,
    ) -> Equilibrium:
        """Move the cables to displacements, and the base to an insertion, as far as tension and obstacles allow.

        Args:
            equilibrium: State to start from, of this solver or one of an equal robot and scene.
            cable_mm: Commanded cable displacement, of several cables one each, from ``robot.least_cable_mm`` to
                ``robot.max_cable_mm`` [mm]. A negative one pays the cable out.
            length_mm: Commanded length of the backbone, within ``robot.length_range_mm`` [mm]; ``None`` keeps it. Both
                are changed at proportional rates.
            scene: Where the obstacles move to within the step, at a proportional rate: the equilibrium's scene, each
                obstacle shifted or of other sizes. The equilibrium need not be of this solver's scene then. Where the
                obstacles press so hard that the motor cannot hold the cable, it pays the cable out at the tension
                limit; where that does not help, or the cable of the paper's model, which is never slack, would have to
                push, they stop.

        Returns:
            The equilibrium reached; its ``status`` says how. While anything touches, the cable of the paper's model is
            not slackened below a pretension of 0.00625 of ``robot.offset_mm``, where the shape would be undetermined;
            a slack one that meets an obstacle is pulled to it first. Its ``scene`` is where the obstacles are: the
            scene they move to, unless they had to stop, ``BLOCKED``.

        Raises:
            ValueError: If a command is out of range or the equilibrium is another robot's or scene's.
            TypeError: If ``equilibrium`` is not one of the plane.
        """
        command = self.check_command(equilibrium, cable_mm, length_mm, scene=scene)
        reached = np.empty_like(equilibrium.block)
        if scene is None:
            work = self._kernel.step(equilibrium.block, command, reached)
            return Equilibrium.solved(self.robot, self.scene, reached, *work)
        start, bounds = equilibrium.scene, equilibrium.scene.check_motion(scene)
        scenes = kernel_scene(self.robot, start), kernel_scene(self.robot, scene)
        *moved, part = self._kernel.move(equilibrium.block, command, *scenes, bounds, reached)
        return Equilibrium.solved(self.robot, start.moved_towards(scene, part), reached, *moved)

    def trace(
        self, equilibrium: Equilibrium, cable_mm: float | Sequence[float], length_mm: float | None = None
    ) -> Trace:
        """Return every shape accepted on the way of :meth:`step`, beginning with the present one.

        It shows what happens within a step: its sub-steps, and the descent through a snap.

        Raises:
            ValueError: As :meth:`step`.
        """
        command = self.check_command(equilibrium, cable_mm, length_mm)
        return read_trace(self._kernel.trace(equilibrium.block, command), self.robot, self.scene, 2)

    def optimality(self, equilibrium: Equilibrium) -> Optimality:
        """Return the optimality residuals of an equilibrium, recomputed by the kernel.

        Raises:
            ValueError: If the equilibrium is another robot's or scene's.
        """
        check_origin(self.robot, self.scene, equilibrium, Equilibrium)
        return Optimality(*self._kernel.optimality(equilibrium.block))


def kernel_robot(robot: Robot) -> _kernel.Robot:
    """A robot as the kernel takes it."""
    return _kernel.Robot(
        model=PLANE[robot.model].kind,
        segments=robot.segments,
        offset=robot.offset_mm,
        angle=0.0,
        rigidity=robot.rigidity,
        max_tension=robot.max_tension,
        max_length=robot.lengths_mm[1],
        disk_radius=robot.edge_mm,
        disk_thickness=robot.disk_thickness_mm,
        lines=[(line, 0.0) for line in robot.lines_mm],
        edges=list(robot.edges_mm),
        between=robot.between,
        rod=_kernel_rod(robot) if robot.model == "rod" else _kernel.Rod(),
    )


def _kernel_rod(robot: Robot) -> _kernel.Rod:
    return kernel_rod(robot, bending_ratios(robot), np.broadcast_to(robot.precurvature, robot.segments))


def kernel_scene(robot: Robot, scene: Scene) -> list[_kernel.Obstacle]:
    """Obstacles as the kernel takes them.

    Raises:
        ValueError: If an obstacle names a node that the robot does not have.
        RuntimeError: If a custom shape cannot be compiled.
    """
    return [_kernel.Obstacle(**obstacle) for obstacle in kernel_obstacles(robot, scene)]
