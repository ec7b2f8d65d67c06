"""Reference solver: eq. 4 and 5, or the rod's problem, in node coordinates, solved by IPOPT through CasADi.

It shares the statement of the problem with :class:`solver.Solver`, but neither coordinates nor algorithm, and is about
a thousand times slower. Tests compare the two.
"""

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np

from solver.common.checks import check_core, check_rest, check_scene
from solver.common.geometry import touchable_points
from solver.common.ipopt import (
    INSERTION,
    LARGEST_STEP,
    MOVE_OFFSET,
    MOVE_SLOPE,
    OPTIONS,
    PRETENSION,
    RESOLUTION,
    SLACK,
    SMALLEST_STEP,
    nlp_solver,
)
from solver.common.reference import write_contacts
from solver.common.scene import Scene
from solver.common.signals import held_signals
from solver.common.status import Status
from solver.planar.equilibrium import Equilibrium, touching_points
from solver.planar.forces import onset_tension
from solver.planar.formulation import node_derivatives, node_problem
from solver.planar.free import tip_slopes
from solver.planar.layout import layout
from solver.planar.robot import Robot
from solver.planar.rod_reference import RodReference
from solver.planar.solve import CommandCheck


class _Point(NamedTuple):
    """A solution of the node problem: unknowns, and multipliers of (equalities, inequalities) in CasADi's sign."""

    cable: float
    length: float
    unknowns: np.ndarray
    multipliers: np.ndarray
    iterations: int = 0


class _Pose(NamedTuple):
    """A shape: points of nodes 0…n, angles of their disks, turns of the segments and sines of their shear angles."""

    backbone: np.ndarray
    cable: np.ndarray
    angles: np.ndarray
    turns: np.ndarray
    sines: np.ndarray


class ReferenceSolver(CommandCheck):
    """Follows the same equilibria as :class:`solver.Solver`, by solving the problem as the paper states it.

    It only follows a branch: where the branch ends, a step is ``GAVE_UP``.

    Args:
        robot: The robot.
        scene: The obstacles.

    Raises:
        ValueError: As :class:`solver.Solver`.
        TypeError: As :class:`solver.Solver`.
    """

    _plugin, _options = "ipopt", OPTIONS

    def __init__(self, robot: Robot, scene: Scene) -> None:
        check_scene(robot, Robot, scene, 2)
        self.robot = robot
        self.scene = scene
        self._touchable = touchable_points(robot, scene)
        check_core(robot, scene)
        self._rod = RodReference(robot, scene, self._touchable) if robot.model == "rod" else None
        self._rest = self._rod.rest() if self._rod else self._paper_rest()
        check_rest(self._rest)

    def rest(self) -> Equilibrium:
        """Return the unactuated robot under its loads, straight where it has neither loads nor precurvature."""
        return self._rest

    def step(
        self, equilibrium: Equilibrium, cable_mm: float | Sequence[float], length_mm: float | None = None
    ) -> Equilibrium:
        """Move cables and base along the branch, as far as the tension allows; of several cables none moves beyond.

        Args:
            equilibrium: State to start from, of this solver or a :class:`solver.Solver` of an equal robot and scene.
            cable_mm: Commanded cable displacement, of several cables one each, from ``robot.least_cable_mm`` to
                ``robot.max_cable_mm`` [mm].
            length_mm: Commanded length of the backbone [mm]; ``None`` keeps it.

        Returns:
            The equilibrium reached: ``CONVERGED``, ``STALLED`` at the tension limit, or ``GAVE_UP`` with the one given.

        Raises:
            ValueError: If a command is out of range or the equilibrium is another robot's or scene's.
        """
        command = self.check_command(equilibrium, cable_mm, length_mm)
        return self._rod.step(equilibrium, command) if self._rod else self._paper_step(equilibrium, *command)

    def _paper_rest(self) -> Equilibrium:
        self._build()
        return self._equilibrium(self._free(0.0, self.robot.length_mm), Status.CONVERGED, 0)

    def _paper_step(self, equilibrium: Equilibrium, cable_mm: float, length: float) -> Equilibrium:
        present, iterations, largest = self._start(equilibrium), 0, LARGEST_STEP
        while (distance := self._distance(present, cable := self._goal(present, cable_mm), length)) > 0:
            part = min(1.0, largest / distance)
            following = self._solve_part(present, cable, length, part)
            if following is None:
                if largest > SMALLEST_STEP:
                    largest /= 2
                    continue
                return Equilibrium(self.robot, self.scene, equilibrium.block.copy(), Status.GAVE_UP, iterations)
            iterations += following.iterations
            if self._tension(following) > max(self.robot.max_tension, self._tension(present)):
                return self._equilibrium(self._limit(present, following), Status.STALLED, iterations, equilibrium)
            present = following
        return self._equilibrium(present, Status.CONVERGED, iterations, equilibrium)

    def _solve_part(self, present: _Point, cable: float, length: float, part: float) -> _Point | None:
        """Return the solution part of the way to a command, ``None`` where IPOPT finds none."""
        if part == 1:
            return self._solve(present, cable, length)
        towards = (present.cable + part * (cable - present.cable), present.length + part * (length - present.length))
        return self._solve(present, *towards)

    @held_signals()
    def _build(self) -> None:
        """Create the IPOPT solver, the slope of the Lagrangian in the cable displacement, and the bounds."""
        n = self.robot.segments
        problem = node_problem(self.robot, self.scene.laws, self.scene.mounted)
        constraints = ca.vertcat(problem.equalities, problem.inequalities)
        # Angles are in units of the free robot's segment angle, so that the tolerances mean the same at every
        # displacement.
        unit = problem.parameters[0] / (n * problem.parameters[2])
        nlp = {"x": problem.unknowns, "p": problem.parameters, "f": problem.objective / unit**2, "g": constraints}
        self._nlp_solver = nlp_solver(nlp, self._options, self._plugin)
        multipliers = ca.MX.sym("multipliers", constraints.shape[0])
        lagrangian = problem.objective + ca.dot(multipliers, constraints)
        slope = ca.gradient(lagrangian, problem.parameters)[0]
        self._cable_slope = ca.Function("cable_slope", [problem.unknowns, problem.parameters, multipliers], [slope])
        bounded = self._touchable[:, :, 1:].ravel()
        self._lower = np.concatenate([np.zeros(3 * n), np.where(bounded, 0.0, -np.inf)])
        self._upper = np.concatenate([np.zeros(3 * n), np.full(bounded.size, np.inf)])

    def _parameters(self, cable: float, length: float) -> list[float]:
        return [cable, length, self.robot.offset_mm, self.robot.rigidity, *self.scene.parameters]

    def _scale(self, cable: float) -> float:
        return (cable / (self.robot.segments * self.robot.offset_mm)) ** 2

    def _goal(self, point: _Point, cable: float) -> float:
        """Return a command, at least the pretension while anything touches."""
        touching = bool(self._pushing(point).any())
        pretension = PRETENSION * self.robot.offset_mm
        return max(cable, min(point.cable, pretension)) if touching else cable

    def _shape(self, cable: float, length: float, sines: np.ndarray) -> np.ndarray:
        """Return the unknowns of a robot with given sines of its shear angles."""
        n, a, segment = self.robot.segments, self.robot.offset_mm, length / self.robot.segments
        rises = segment * np.sqrt(1 - sines**2) - np.sqrt((segment - cable / n) ** 2 - (segment * sines) ** 2)
        turns = 2 * np.arcsin(rises / (2 * a))
        angles = np.concatenate([[0.0], -np.cumsum(turns)])
        headings = angles[:-1] - turns / 2 + np.arcsin(sines)
        backbone = np.cumsum(segment * np.column_stack([-np.sin(headings), np.cos(headings)]), axis=0)
        disks = a * np.column_stack([np.cos(angles), np.sin(angles)])
        return np.concatenate([backbone.ravel(), (backbone + disks[1:]).ravel()])

    def _free(self, cable: float, length: float) -> _Point:
        """Return the free robot, which nothing touches."""
        mounts = np.zeros(2 * sum(self.scene.mounted))
        unknowns = np.r_[self._shape(cable, length, np.zeros(self.robot.segments)), mounts]
        return self._balanced(cable, length, unknowns, np.zeros(self._touchable[:, :, 1:].size))

    @held_signals()
    def _balanced(self, cable: float, length: float, unknowns: np.ndarray, multipliers: np.ndarray) -> _Point:
        """Return a shape with the multipliers of its inequalities, and those of the equalities by least squares."""
        derivatives = node_derivatives(self.robot, self.scene.laws, self.scene.mounted)
        values = derivatives(unknowns, self._parameters(cable, length))
        slope, _, equality_slopes, _, gap_slopes = (value.full() for value in values)
        balance = gap_slopes.T @ multipliers - slope.ravel()
        tensions = np.linalg.lstsq(equality_slopes.T, balance, rcond=None)[0]
        return _Point(cable, length, unknowns, np.concatenate([tensions, -multipliers]))

    def _start(self, equilibrium: Equilibrium) -> _Point:
        """Return an equilibrium as a solution of the node problem."""
        unknowns, _, tensions, multipliers = equilibrium.node_solution()
        return _Point(equilibrium.cable_mm, equilibrium.length_mm, unknowns, -np.concatenate([tensions, multipliers]))

    @held_signals()
    def _solve(self, start: _Point, cable: float, length: float) -> _Point | None:
        """Return the solution for another command, ``None`` where IPOPT does not converge or leaves the branch."""
        if cable < SLACK * self.robot.offset_mm:
            return self._free(cable, length)
        scale = self._scale(cable)
        shape = self._shape(cable, length, self._pose(start.unknowns, start.length).sines)
        guess = self._balanced(cable, length, np.r_[shape, self._mounts(start)], self._pushing(start))
        solution = self._nlp_solver(
            x0=guess.unknowns,
            lam_g0=guess.multipliers / scale,
            p=self._parameters(cable, length),
            lbg=self._lower,
            ubg=self._upper,
        )
        unknowns = solution["x"].full().ravel()
        moved = np.linalg.norm((unknowns - start.unknowns).reshape(-1, 2), axis=1).max()
        allowed = self.robot.lengths_mm[1] * (MOVE_OFFSET + MOVE_SLOPE * self._distance(start, cable, length))
        stats = self._nlp_solver.stats()
        if not (stats["success"] and moved <= allowed):
            return None
        multipliers = solution["lam_g"].full().ravel() * scale
        return self._without_barrier(_Point(cable, length, unknowns, multipliers, stats["iter_count"]), solution["g"])

    def _without_barrier(self, point: _Point, constraints: ca.DM) -> _Point:
        """Return a solution with inactive multipliers set to zero: an interior-point method leaves all positive."""
        gaps = constraints.full().ravel()
        multipliers = point.multipliers.copy()
        inactive = -multipliers / self._scale(point.cable) < np.abs(gaps)
        inactive[: 3 * self.robot.segments] = False
        multipliers[inactive] = 0.0
        return point._replace(multipliers=multipliers)

    def _limit(self, below: _Point, above: _Point) -> _Point:
        """Return the tension limit between two points of the branch, from below, by bisection."""
        present, high = below, 1.0
        low, span = 0.0, self._distance(below, above.cable, above.length)
        while (high - low) * span > RESOLUTION:
            middle = (low + high) / 2
            point = self._solve_part(below._replace(unknowns=present.unknowns), above.cable, above.length, middle)
            if point is None:
                break
            if self._tension(point) > self.robot.max_tension:
                high = middle
            else:
                present, low = point, middle
        return present

    @held_signals()
    def _tension(self, point: _Point) -> float:
        """Return the cable tension, by the envelope theorem [N]."""
        slope = self._cable_slope(point.unknowns, self._parameters(point.cable, point.length), point.multipliers)
        return self.robot.rigidity * self.robot.segments / (2 * point.length) * float(slope)

    def _pushing(self, point: _Point) -> np.ndarray:
        """Return the multipliers of the inequalities."""
        return -point.multipliers[3 * self.robot.segments :]

    def _mounts(self, point: _Point) -> np.ndarray:
        """Return the displacements of the obstacles on springs."""
        return point.unknowns[4 * self.robot.segments :]

    def _pose(self, unknowns: np.ndarray, length: float) -> _Pose:
        points = unknowns[: 4 * self.robot.segments].reshape(2, self.robot.segments, 2)
        backbone = np.vstack([[0.0, 0.0], points[0]])
        cable = np.vstack([[self.robot.offset_mm, 0.0], points[1]])
        disks, segments = cable - backbone, np.diff(backbone, axis=0)
        angles = np.unwrap(np.arctan2(disks[:, 1], disks[:, 0]))
        turns = -np.diff(angles)
        unsheared = angles[:-1] - turns / 2
        sideways = -np.sum(segments * np.column_stack([np.cos(unsheared), np.sin(unsheared)]), axis=1)
        sines = sideways * self.robot.segments / length
        return _Pose(backbone, cable, angles, turns, sines)

    def _equilibrium(
        self, point: _Point, status: Status, iterations: int, before: Equilibrium | None = None
    ) -> Equilibrium:
        pose = self._pose(point.unknowns, point.length)
        fields = layout(self.robot, len(self.scene))
        block = np.zeros(fields.size)
        fields.cables(block)[:], fields.length(block)[:] = point.cable, point.length
        fields.tensions(block)[:], fields.objective(block)[:] = self._tension(point), np.sum(pose.turns**2)
        fields.coordinates(block)[:] = pose.sines
        fields.nodes(block)[:] = np.column_stack([pose.backbone, pose.angles])
        fields.frames(block)[:] = (pose.cable - pose.backbone) / self.robot.offset_mm
        multipliers = fields.multipliers(block)
        multipliers[:, :, 1:] = self._pushing(point).reshape(multipliers[:, :, 1:].shape)
        fields.displacements(block)[list(self.scene.mounted)] = self._mounts(point).reshape(-1, 2)
        points, robot = touching_points(self.robot, fields.nodes(block)), self.robot.at(point.length)
        write_contacts(block, fields, self.scene, self._touchable, points, robot.energy_scale)
        fields.tip_slopes(block)[:] = tip_slopes(robot, point.cable)
        now = Equilibrium(self.robot, self.scene, block.copy(), status, iterations)
        fields.onset(block)[0] = 0.0 if before is None else onset_tension(before, now)
        return Equilibrium(self.robot, self.scene, block, status, iterations)

    def _distance(self, point: _Point, cable: float, length: float) -> float:
        """Return the distance of a command, in displacements of the cable [a]."""
        inserted = INSERTION * abs(length - point.length) / self.robot.lengths_mm[1]
        return max(abs(cable - point.cable) / self.robot.offset_mm, inserted)
