"""The rod's part of the reference solver in space."""

import numpy as np

from solver.common.reference import RodBranch, RodPoint, write_contacts, write_rod
from solver.common.scene import Scene
from solver.common.signals import held_signals
from solver.common.status import Status
from solver.spatial.equilibrium import SpatialEquilibrium, spatial_layout, touching_points, unstressed_nodes
from solver.spatial.formulation import node_problem
from solver.spatial.robot import SpatialRobot, stiffness_ratios


class SpatialRodReference:
    """Solves the rod's problem in node coordinates step by step.

    Args:
        robot: The robot, a rod.
        scene: The obstacles.
        touchable: Which points can touch which obstacle, ``(m, p, k)`` bool.
    """

    @held_signals()
    def __init__(self, robot: SpatialRobot, scene: Scene, touchable: np.ndarray) -> None:
        self._robot, self._scene, self._touchable = robot, scene, touchable
        self._branch = RodBranch(robot, scene, node_problem(robot, scene.laws, scene.mounted), touchable)

    def rest(self) -> SpatialEquilibrium:
        """Return the unactuated robot under its loads."""
        return self._equilibrium(*self._branch.rest(self._unstressed()))

    def step(self, equilibrium: SpatialEquilibrium, cables_mm: tuple[float, ...]) -> SpatialEquilibrium:
        """Return the equilibrium at displacements of the cables, or where the way there ended."""
        start = self._branch.start(equilibrium, equilibrium.cables_mm)
        target = np.array([*cables_mm, self._robot.length_mm, 1.0])
        point, status, iterations = self._branch.follow(start, target)
        if status is Status.GAVE_UP:
            return SpatialEquilibrium(self._robot, self._scene, equilibrium.block.copy(), status, iterations)
        return self._equilibrium(point, status, iterations, equilibrium)

    def _unstressed(self) -> np.ndarray:
        """Return the unknowns of the robot that nothing strains."""
        robot, (nodes, frames) = self._robot, unstressed_nodes(self._robot)
        turns = np.broadcast_to(robot.precurvature, (robot.segments, 3))
        edges = nodes[1:] + robot.offset_mm * np.moveaxis(frames[1:, :, :2], 2, 0)
        mounts = np.zeros(3 * sum(self._scene.mounted))
        return np.concatenate([nodes[1:].ravel(), edges.ravel(), robot.offset_mm * turns.ravel(), mounts])

    def _equilibrium(
        self, point: RodPoint, status: Status, iterations: int, before: SpatialEquilibrium | None = None
    ) -> SpatialEquilibrium:
        """Return an equilibrium with all that follows from its shape; the onset is that of the step before contact."""
        robot, n, fields = self._robot, self._robot.segments, spatial_layout(self._robot, len(self._scene))
        block = np.zeros(fields.size)
        fields.disk_multipliers(block)[:] = write_rod(block, fields, self._branch, point, self._scene.mounted)
        lines = point.unknowns[: 12 * n].reshape(4, n, 3)
        nodes, frames = fields.nodes(block), fields.frames(block)
        nodes[1:], frames[0] = lines[0], np.eye(3)
        frames[1:, :, :2] = np.moveaxis(lines[1:3] - lines[0], 0, 2) / robot.offset_mm
        frames[1:, :, 2] = np.cross(frames[1:, :, 0], frames[1:, :, 1])
        controls = fields.coordinates(block)
        controls[:] = lines[3] / robot.offset_mm
        fields.objective(block)[0] = np.sum(stiffness_ratios(robot) * (controls - np.array(robot.precurvature)) ** 2)
        points = touching_points(robot, nodes, frames)
        write_contacts(block, fields, self._scene, self._touchable, points, robot.energy_scale)
        if before is not None and fields.multipliers(block).any():
            fields.onset(block)[:] = before.onset_tensions if before.contact.any() else before.tensions
        return SpatialEquilibrium(robot, self._scene, block, status, iterations)
