"""Reference solver in space: eq. 13, or the rod's problem, in node coordinates, solved by IPOPT through CasADi."""

import math
from collections.abc import Sequence

import casadi as ca
import numpy as np

from solver.common.checks import check_core, check_rest, check_scene
from solver.common.geometry import touchable_points
from solver.common.ipopt import LARGEST_STEP, MOVE_OFFSET, MOVE_SLOPE, OPTIONS, SLACK, SMALLEST_STEP, nlp_solver
from solver.common.reference import write_contacts
from solver.common.scene import Scene
from solver.common.signals import held_signals
from solver.common.status import Status
from solver.spatial.equilibrium import SpatialEquilibrium, spatial_layout, touching_points
from solver.spatial.formulation import node_problem
from solver.spatial.robot import SpatialRobot, sides
from solver.spatial.rod_reference import SpatialRodReference
from solver.spatial.solve import SpatialCommandCheck


class SpatialReferenceSolver(SpatialCommandCheck):
    """Follows the equilibria of :class:`solver.spatial.SpatialSolver`, by solving the problem as the paper states it.

    It only follows a branch: where the branch ends, a step is ``GAVE_UP``. Tensions of the paper's model are reported,
    but not limited.

    Args:
        robot: The robot.
        scene: The obstacles.

    Raises:
        ValueError: As :class:`solver.spatial.SpatialSolver`.
    """

    def __init__(self, robot: SpatialRobot, scene: Scene) -> None:
        check_scene(robot, SpatialRobot, scene, 3)
        self.robot, self.scene = robot, scene
        check_core(robot, scene)
        self._touchable = touchable_points(robot, scene)
        self._rod = SpatialRodReference(robot, scene, self._touchable) if robot.model == "rod" else None
        self._rest = self._rod.rest() if self._rod else self._paper_rest()
        check_rest(self._rest)

    @held_signals()
    def _paper_rest(self) -> SpatialEquilibrium:
        problem = node_problem(self.robot, self.scene.laws, self.scene.mounted)
        self._equalities = problem.equalities.shape[0]
        constraints = ca.vertcat(problem.equalities, problem.inequalities)
        nlp = {
            "x": problem.unknowns,
            "p": ca.vertcat(problem.parameters, unit := ca.MX.sym("unit")),
            "f": problem.objective / unit**2,
            "g": constraints,
        }
        self._ipopt = nlp_solver(nlp, OPTIONS)
        multipliers = ca.MX.sym("multipliers", constraints.shape[0])
        slopes = ca.gradient(problem.objective + ca.dot(multipliers, constraints), problem.parameters)[:2]
        self._cable_slopes = ca.Function("slopes", [problem.unknowns, problem.parameters, multipliers], [slopes])
        return self._free(np.zeros(2))

    def rest(self) -> SpatialEquilibrium:
        """Return the unactuated robot under its loads, straight where it has neither loads nor precurvature."""
        return self._rest

    def step(self, equilibrium: SpatialEquilibrium, cables_mm: Sequence[float] | np.ndarray) -> SpatialEquilibrium:
        """Move the cables evenly to displacements, along the branch; of a rod none moves beyond a tension limit.

        Args:
            equilibrium: State to start from, of this solver or one of an equal robot and scene.
            cables_mm: Displacement of each cable, in the paper's model of each pair, within ±``robot.max_cable_mm``
                [mm].

        Returns:
            The equilibrium reached: ``CONVERGED``, of a rod ``STALLED`` at the limit, or ``GAVE_UP`` with the one
            given.

        Raises:
            ValueError: If a command is out of range or the equilibrium is another robot's or scene's.
        """
        command = self.check_command(equilibrium, cables_mm)
        return self._rod.step(equilibrium, command) if self._rod else self._paper_step(equilibrium, np.array(command))

    def _paper_step(self, equilibrium: SpatialEquilibrium, target: np.ndarray) -> SpatialEquilibrium:
        offset = self.robot.offset_mm
        now, largest, smallest = equilibrium, LARGEST_STEP * offset, SMALLEST_STEP * offset
        while (distance := np.abs(target - now.cables_mm).max()) > 0:
            part = min(1.0, largest / distance)
            following = self._solve(now, target if part == 1 else now.cables_mm + part * (target - now.cables_mm))
            if following is not None:
                now = following
            elif largest > smallest:
                largest /= 2
            else:
                return SpatialEquilibrium(self.robot, self.scene, equilibrium.block.copy(), Status.GAVE_UP, 0)
        return now

    @held_signals()
    def _solve(self, start: SpatialEquilibrium, cables: np.ndarray) -> SpatialEquilibrium | None:
        """Return the solution for another command, ``None`` where IPOPT does not converge or leaves the branch."""
        free = self._free(cables)
        slack = SLACK * self.robot.offset_mm
        if np.abs(cables).max() < slack or (not start.contact.any() and free.gaps.min(initial=1.0) > 0):
            return free
        unknowns, _, _, multipliers = start.node_solution()
        unit = np.abs(cables).max() / (self.robot.segments * self.robot.offset_mm)
        parameters = np.array([*cables, self.robot.length_mm, self.robot.rigidity, *self.scene.parameters])
        bounded = self._touchable[:, :, 1:].ravel()
        zeros = np.zeros(self._equalities)
        solution = self._ipopt(
            x0=unknowns,
            lam_g0=np.r_[zeros, -multipliers / unit**2],
            p=np.r_[parameters, unit],
            lbg=np.r_[zeros, np.where(bounded, 0.0, -np.inf)],
            ubg=np.r_[zeros, np.full(bounded.size, np.inf)],
        )
        reached, stats = solution["x"].full().ravel(), self._ipopt.stats()
        if not (stats["success"] and self._stayed(start, unknowns, cables, reached)):
            return None
        multipliers = solution["lam_g"].full().ravel()
        pushing = -multipliers[self._equalities :]
        pushing[pushing < np.abs(solution["g"].full().ravel()[self._equalities :])] = 0.0  # left by the barrier
        slopes = unit**2 * self._cable_slopes(reached, parameters, multipliers).full().ravel()
        tensions = sides(cables) * slopes * self.robot.energy_scale
        nodes, frames = self._shape(cables, reached)
        mounts = reached[9 * self.robot.segments :]
        return self._equilibrium(cables, tensions, nodes, frames, unit**2 * pushing, mounts, int(stats["iter_count"]))

    def _stayed(self, start: SpatialEquilibrium, unknowns: np.ndarray, cables: np.ndarray, reached: np.ndarray) -> bool:
        """Return whether no node moved so far that the solution left the branch."""
        moved = np.linalg.norm((reached - unknowns).reshape(-1, 3), axis=1).max()
        pulled = np.abs(cables - start.cables_mm).max() / self.robot.offset_mm
        return bool(moved <= self.robot.longest_mm * (MOVE_OFFSET + MOVE_SLOPE * pulled))

    def _shape(self, cables: np.ndarray, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return nodes ``(n+1, 3)`` and frames ``(n+1, 3, 3)`` of a solution."""
        n = self.robot.segments
        nodes, first, second = (np.vstack([np.zeros(3), part]) for part in unknowns[: 9 * n].reshape(3, n, 3))
        disks = np.stack([first[1:] - nodes[1:], second[1:] - nodes[1:]], axis=1)  # (n, 2, 3)
        holes = (sides(cables)[:, None] * self.robot.holes)[:, :2]
        frames = np.tile(np.eye(3), (n + 1, 1, 1))
        frames[1:, :, :2] = np.swapaxes(np.linalg.solve(holes, disks), 1, 2)
        frames[1:, :, 2] = np.cross(frames[1:, :, 0], frames[1:, :, 1])
        return nodes, frames

    def _free(self, cables: np.ndarray) -> SpatialEquilibrium:
        """Return the free robot: every segment turns alike, towards b with ``h·b = pull`` for both holes h."""
        n, length, holes = self.robot.segments, self.robot.segment_mm, self.robot.holes
        towards = np.append(np.linalg.solve(holes[:, :2], cables / n), 0.0)  # 2 sin θ/2 along the bend
        size = float(np.linalg.norm(towards))
        angle = 2 * math.asin(size / 2)
        direction = towards / size if size > 0 else np.array([1.0, 0.0, 0.0])
        up = np.array([0.0, 0.0, 1.0])
        axis = np.cross(up, direction)
        turn = np.cross(axis, np.eye(3)).T  # of a vector, about the axis of the bend
        angles = (angle * np.arange(n + 1))[:, None, None]
        frames = np.eye(3) + np.sin(angles) * turn + (1 - np.cos(angles)) * (turn @ turn)
        middles = angle * (np.arange(n) + 0.5)
        nodes = np.zeros((n + 1, 3))
        nodes[1:] = length * np.cumsum(np.sin(middles)[:, None] * direction + np.cos(middles)[:, None] * up, axis=0)
        half_sines = cables / (2 * n * self.robot.offset_mm)
        slopes = 4 * np.arcsin(half_sines) / np.sqrt(1 - half_sines**2) / self.robot.offset_mm
        tensions = sides(cables) * self.robot.energy_scale * slopes
        return self._equilibrium(cables, tensions, nodes, frames, None, None, 0)

    def _equilibrium(
        self,
        cables: np.ndarray,
        tensions: np.ndarray,
        nodes: np.ndarray,
        frames: np.ndarray,
        multipliers: np.ndarray | None,
        mounts: np.ndarray | None,
        iterations: int,
    ) -> SpatialEquilibrium:
        """Return an equilibrium with all that follows from its shape; onset tensions and tip slopes stay zero."""
        fields = spatial_layout(self.robot, len(self.scene))
        block = np.zeros(fields.size)
        fields.cables(block)[:] = cables
        fields.length(block)[:] = self.robot.length_mm
        fields.tensions(block)[:] = tensions
        fields.coordinates(block)[:] = _controls(nodes, frames)
        fields.nodes(block)[:], fields.frames(block)[:] = nodes, frames
        if multipliers is not None and mounts is not None:
            fields.multipliers(block)[:, :, 1:] = multipliers.reshape(self._touchable[:, :, 1:].shape)
            fields.displacements(block)[list(self.scene.mounted)] = mounts.reshape(-1, 3)
        points = touching_points(self.robot, nodes, frames)
        write_contacts(block, fields, self.scene, self._touchable, points, self.robot.energy_scale)
        angles = [_angles(frames @ hole / self.robot.offset_mm) for hole in self.robot.holes]
        fields.objective(block)[:] = np.sum(np.square(angles))
        return SpatialEquilibrium(self.robot, self.scene, block, Status.CONVERGED, iterations)


def _angles(directions: np.ndarray) -> np.ndarray:
    """Return the angles between consecutive unit vectors, ``(n,)``."""
    return np.asarray(2 * np.arcsin(np.linalg.norm(np.diff(directions, axis=0), axis=1) / 2))


def _controls(nodes: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Return the shears and twists of the segments of a shape, ``(n, 3)``."""
    turns = np.swapaxes(frames[:-1], 1, 2) @ frames[1:]
    cosines = np.sqrt(1 + np.trace(turns, axis1=1, axis2=2)) / 2  # of half the angle
    twisted = turns - np.swapaxes(turns, 1, 2)
    axes = np.stack([twisted[:, 2, 1], twisted[:, 0, 2], twisted[:, 1, 0]], axis=1) / (2 * cosines[:, None])
    chords = np.einsum("nji,nj->ni", frames[:-1], np.diff(nodes, axis=0))
    halves = np.sqrt((1 + cosines) / 2)[:, None]
    across = -2 * np.cross(axes / (4 * halves), chords)
    back = chords + halves * across - np.cross(axes / (4 * halves), across)
    return np.column_stack([(back / np.linalg.norm(chords, axis=1)[:, None])[:, :2], axes[:, 2]])
