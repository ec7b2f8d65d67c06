"""The rod's part of the reference solver in the plane."""

import numpy as np

from solver.common.reference import RodBranch, RodPoint, write_contacts, write_rod
from solver.common.rod import bending_ratios
from solver.common.scene import Scene
from solver.common.signals import held_signals
from solver.common.status import Status
from solver.planar.equilibrium import Equilibrium, touching_points, unstressed_nodes
from solver.planar.forces import onset_tension
from solver.planar.formulation import node_problem
from solver.planar.free import tip_slopes
from solver.planar.layout import layout
from solver.planar.robot import Robot


class RodReference:
    """Solves the rod's problem in node coordinates step by step.

    Args:
        robot: The robot, a rod.
        scene: The obstacles.
        touchable: Which points can touch which obstacle, ``(m, p, k)`` bool.
    """

    @held_signals()
    def __init__(self, robot: Robot, scene: Scene, touchable: np.ndarray) -> None:
        self._robot, self._scene, self._touchable = robot, scene, touchable
        self._branch = RodBranch(robot, scene, node_problem(robot, scene.laws, scene.mounted), touchable)

    def rest(self) -> Equilibrium:
        """Return the unactuated robot under its loads."""
        return self._equilibrium(*self._branch.rest(self._unstressed()))

    def step(self, equilibrium: Equilibrium, command: tuple[float, ...]) -> Equilibrium:
        """Return the equilibrium at a command of cables and length, or where the way there ended."""
        start = self._branch.start(equilibrium, equilibrium.cables_mm)
        point, status, iterations = self._branch.follow(start, np.array([*command, 1.0]))
        if status is Status.GAVE_UP:
            return Equilibrium(self._robot, self._scene, equilibrium.block.copy(), status, iterations)
        return self._equilibrium(point, status, iterations, equilibrium)

    def _unstressed(self) -> np.ndarray:
        """Return the unknowns of the robot that nothing strains."""
        nodes, mounts = unstressed_nodes(self._robot)[1:], np.zeros(2 * sum(self._scene.mounted))
        disks = self._robot.offset_mm * np.column_stack([np.cos(nodes[:, 2]), np.sin(nodes[:, 2])])
        return np.concatenate([nodes[:, :2].ravel(), (nodes[:, :2] + disks).ravel(), mounts])

    def _equilibrium(
        self, point: RodPoint, status: Status, iterations: int, before: Equilibrium | None = None
    ) -> Equilibrium:
        robot, fields = self._robot, layout(self._robot, len(self._scene))
        block = np.zeros(fields.size)
        disks = write_rod(block, fields, self._branch, point, self._scene.mounted).reshape(2, -1)
        fields.disk_multipliers(block)[:] = disks[0] - disks[1]
        backbone, edges = (
            np.vstack([base, line])
            for base, line in zip(
                ([0.0, 0.0], [robot.offset_mm, 0.0]),
                point.unknowns[: 4 * robot.segments].reshape(2, robot.segments, 2),
                strict=True,
            )
        )
        frames = (edges - backbone) / robot.offset_mm
        angles = np.unwrap(np.arctan2(frames[:, 1], frames[:, 0]))
        turns = -np.diff(angles)
        fields.coordinates(block)[:], fields.frames(block)[:] = turns, frames
        fields.nodes(block)[:] = np.column_stack([backbone, angles])
        fields.objective(block)[0] = bending_ratios(robot) @ (turns - robot.precurvature) ** 2
        points = touching_points(robot, fields.nodes(block))
        write_contacts(block, fields, self._scene, self._touchable, points, self._branch.energy_scale(point))
        now = Equilibrium(robot, self._scene, block.copy(), status, iterations)
        fields.onset(block)[:] = self._onset(before, now)
        if robot.bends_evenly:
            fields.tip_slopes(block)[:] = tip_slopes(robot.at(now.length_mm), now.cable_mm)
        return Equilibrium(robot, self._scene, block, status, iterations)

    def _onset(self, before: Equilibrium | None, now: Equilibrium) -> np.ndarray | float:
        """Return the tensions where the present contact began; those of the step before where no closed form says."""
        if before is None or not now.contact.any():
            return 0.0
        if self._robot.bends_evenly:
            return onset_tension(before, now)
        kept = layout(self._robot, len(self._scene)).onset(before.block)
        return np.asarray(kept if before.contact.any() else before.tensions)
