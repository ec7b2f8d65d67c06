"""What the reference solvers share: a rod's branch, followed by IPOPT, and blocks of its states."""

from typing import NamedTuple

import casadi as ca
import numpy as np

from solver.common.equilibrium import BaseEquilibrium
from solver.common.ipopt import (
    ANGLE_UNIT,
    INSERTION,
    LARGEST_STEP,
    LOADING,
    MOVE_OFFSET,
    MOVE_SLOPE,
    OPTIONS,
    RESOLUTION,
    SMALLEST_STEP,
    UNIT,
    nlp_solver,
)
from solver.common.layout import Layout
from solver.common.node_problem import NodeProblem
from solver.common.rod import AnyRod
from solver.common.scene import Scene
from solver.common.signals import held_signals
from solver.common.status import Status

LEAST_SHARE = 1e-9  # of the loads, which stands for none


class RodPoint(NamedTuple):
    """A solution of the node problem of a rod.

    Attributes:
        command: Displacement of each cable, length of the backbone [mm], and share of the loads.
        unknowns: Unknowns of the problem [mm].
        multipliers: Multipliers of (equalities, inequalities) in CasADi's sign.
        iterations: Iterations of IPOPT.
    """

    command: np.ndarray
    unknowns: np.ndarray
    multipliers: np.ndarray
    iterations: int = 0


class RodBranch:
    """Follows the equilibria of a rod by IPOPT, each solve started at the solution before it.

    Args:
        robot: The robot.
        scene: The obstacles.
        problem: Its node-coordinate problem.
        touchable: Which points can touch which obstacle, ``(m, p, k)`` bool.
    """

    def __init__(self, robot: AnyRod, scene: Scene, problem: NodeProblem, touchable: np.ndarray) -> None:
        self._robot, self._scene = robot, scene
        self._cables, self._space = len(robot.cables), len(robot.weight_per_length)
        bounded = touchable[:, :, 1:].ravel()
        self._equalities = problem.equalities.shape[0]
        self.own = problem.inequalities.shape[0] - bounded.size  # inequalities of the robot itself
        bounded = np.concatenate([np.ones(self.own, bool), bounded])
        zeros = np.zeros(self._equalities)
        self._lower = np.concatenate([zeros, np.where(bounded, 0.0, -np.inf)])
        self._upper = np.concatenate([zeros, np.full(bounded.size, np.inf)])
        self._unit = UNIT * robot.offset_mm
        constraints = ca.vertcat(problem.equalities, problem.inequalities)
        inputs = [problem.unknowns, problem.parameters]
        self._constraints = ca.Function("constraints", inputs, [constraints])
        values = ca.Function("values", inputs, [problem.objective / ANGLE_UNIT**2, constraints / self._unit])
        unknowns = ca.MX.sym("unknowns", problem.unknowns.shape)
        objective, constraints = values(self._unit * unknowns, problem.parameters)
        nlp = {"x": unknowns, "p": problem.parameters, "f": objective, "g": constraints}
        self._nlp_solver = nlp_solver(nlp, OPTIONS)

    def rest(self, unstressed: np.ndarray) -> tuple[RodPoint, Status, int]:
        """Return the robot under its loads, which are raised from none at the shape where nothing strains it.

        A cable that would hold a precurved robot back is paid out until it just does not. One whose tension reaches the
        limit under a part of the loads is not: the status is ``GAVE_UP`` then.
        """
        command = np.array([*np.zeros(self._cables), self._robot.length_mm, 0.0])
        with held_signals():
            values = self._constraints(unstressed, self._parameters(command)).full().ravel()
        slacks = values[self._equalities :]
        command[: self._cables] = np.minimum(slacks[: self._cables], 0.0)
        start = RodPoint(command, unstressed, np.zeros(self._lower.size))
        loaded = any(self._robot.weight_per_length) or bool(self._robot.loads)
        full = np.array([*command[:-1], 1.0])
        if not loaded:
            return start._replace(command=full), Status.CONVERGED, 0
        reached, status, iterations = self.follow(start, full)
        return reached, status if reached.command[-1] == 1 else Status.GAVE_UP, iterations

    def start(self, equilibrium: BaseEquilibrium[AnyRod], cables_mm: np.ndarray) -> RodPoint:
        """Return an equilibrium as a solution of the node problem."""
        unknowns, _, tensions, multipliers = equilibrium.node_solution()
        command = np.array([*cables_mm, equilibrium.length_mm, 1.0])
        return RodPoint(command, unknowns, -np.concatenate([tensions, multipliers]))

    def follow(self, start: RodPoint, command: np.ndarray) -> tuple[RodPoint, Status, int]:
        """Return the point at a command, how the way there ended, and iterations; no cable exceeds its tension limit.

        Once one cable reaches the limit, all stop.
        """
        present, iterations, largest = start, 0, LARGEST_STEP
        while (distance := self._distance(command - present.command)) > 0:
            part = min(1.0, largest / distance)
            following = self._solve_part(present, command, part)
            if following is None:
                if largest > SMALLEST_STEP:
                    largest /= 2
                    continue
                return start, Status.GAVE_UP, iterations
            iterations += following.iterations
            if self._exceeds(following, present):
                return self._limit(present, following), Status.STALLED, iterations
            present = following
        return present, Status.CONVERGED, iterations

    def tensions(self, point: RodPoint) -> np.ndarray:
        """Return the tension of each cable, ``(c,)`` [N]."""
        return np.asarray(self.energy_scale(point) * self.multipliers(point)[: self._cables])

    def energy_scale(self, point: RodPoint) -> float:
        """Return B = EI / 2 l0 at the length of a point [N·mm]."""
        return float(self._robot.rigidity * self._robot.segments / (2 * point.command[-2]))

    def multipliers(self, point: RodPoint) -> np.ndarray:
        """Return the multipliers of the inequalities [rad²/mm]."""
        return np.asarray(-point.multipliers[self._equalities :])

    def _parameters(self, command: np.ndarray) -> list[float]:
        # Loads count by their work over the energy scale: a share of them is as if the robot were so much stiffer.
        rigidity = self._robot.rigidity / max(command[-1], LEAST_SHARE)
        fixed = [self._robot.offset_mm] if self._space == 2 else []  # which in the plane is a parameter
        return [*command[:-1], *fixed, rigidity, *self._scene.parameters]

    @held_signals()
    def _solve_part(self, present: RodPoint, command: np.ndarray, part: float) -> RodPoint | None:
        """Return the solution part of the way to a command, ``None`` where IPOPT finds none or leaves the branch."""
        target = command if part == 1 else present.command + part * (command - present.command)
        solution = self._nlp_solver(
            x0=present.unknowns / self._unit,
            lam_g0=present.multipliers * self._unit / ANGLE_UNIT**2,
            p=self._parameters(target),
            lbg=self._lower,
            ubg=self._upper,
        )
        unknowns, stats = self._unit * solution["x"].full().ravel(), self._nlp_solver.stats()
        moved = np.linalg.norm((unknowns - present.unknowns).reshape(-1, self._space), axis=1).max()
        allowed = self._robot.longest_mm * (MOVE_OFFSET + MOVE_SLOPE * self._distance(target - present.command))
        if not (stats["success"] and moved <= allowed):
            return None
        multipliers, values = solution["lam_g"].full().ravel(), solution["g"].full().ravel()
        inactive = -multipliers < np.abs(values)  # left positive by the barrier
        inactive[: self._equalities] = False
        multipliers[inactive] = 0.0
        return RodPoint(target, unknowns, multipliers * ANGLE_UNIT**2 / self._unit, int(stats["iter_count"]))

    def _distance(self, change: np.ndarray) -> float:
        """Return the size of a change of command, in displacements of a cable [a]."""
        pulled = np.abs(change[:-2]).max(initial=0.0) / self._robot.offset_mm
        inserted = INSERTION * abs(change[-2]) / self._robot.longest_mm
        return float(max(pulled, inserted, LOADING * abs(change[-1])))

    def _exceeds(self, point: RodPoint, before: RodPoint) -> bool:
        """Return whether a cable is beyond its tension limit, or where it was beyond, has more tension than before."""
        return bool((self.tensions(point) > np.maximum(self._robot.max_tension, self.tensions(before))).any())

    def _limit(self, below: RodPoint, above: RodPoint) -> RodPoint:
        """Return the tension limit between two points of the branch, from below, by bisection."""
        present, low, high = below, 0.0, 1.0
        span = self._distance(above.command - below.command)
        while (high - low) * span > RESOLUTION:
            middle = (low + high) / 2
            point = self._solve_part(below._replace(unknowns=present.unknowns), above.command, middle)
            if point is None:
                break
            if self._exceeds(point, below):
                high = middle
            else:
                present, low = point, middle
        return present


def write_contacts(
    block: np.ndarray, fields: Layout, scene: Scene, touchable: np.ndarray, points: np.ndarray, energy_scale: float
) -> None:
    """Write what follows from points, multipliers and displacements of a block: gaps, forces and flags.

    Args:
        block: The block.
        fields: Its layout.
        scene: The obstacles.
        touchable: Which points can touch which obstacle, ``(m, p, k)`` bool.
        points: The points that can touch, ``(p, k, d)`` [mm].
        energy_scale: B = EI / 2 l0 [N·mm].
    """
    multipliers = fields.multipliers(block)
    for j, (obstacle, moved) in enumerate(zip(scene, fields.displacements(block), strict=True)):
        fields.gaps(block)[j] = np.where(touchable[j], obstacle.gap(points - moved), np.inf)
        pushed = multipliers[j, ..., None] * obstacle.normal_at(points - moved)
        fields.forces(block)[j] = energy_scale * pushed.sum(axis=(0, 1))
    fields.force(block)[:] = fields.forces(block).sum(axis=0)
    fields.clearance(block)[:] = fields.gaps(block).min(initial=np.inf)
    fields.flags(block)[:] = (multipliers > 0).any(axis=0).ravel()


def write_rod(
    block: np.ndarray, fields: Layout, branch: RodBranch, point: RodPoint, mounted: tuple[bool, ...]
) -> np.ndarray:
    """Write command, tensions, multipliers and displacements of a rod; return the multipliers of its disks."""
    fields.cables(block)[:] = point.command[:-2]
    fields.length(block)[:] = point.command[-2]
    fields.tensions(block)[:] = branch.tensions(point)
    own, contacts = np.split(branch.multipliers(point), [branch.own])
    multipliers, displacements = fields.multipliers(block), fields.displacements(block)
    multipliers[:, :, 1:] = contacts.reshape(multipliers[:, :, 1:].shape)
    mounts = point.unknowns[point.unknowns.size - displacements.shape[1] * sum(mounted) :]
    displacements[list(mounted)] = mounts.reshape(-1, displacements.shape[1])
    return np.asarray(own[len(point.command) - 2 :])
