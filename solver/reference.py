"""The reference solver: eq. 4/5 in the node coordinates of the paper, through CasADi and IPOPT.

It shares with :class:`solver.Solver` neither coordinates nor algorithm, only the statement of the problem, and is about
a thousand times slower. Tests compare the two.
"""

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from solver.equilibrium import Equilibrium
from solver.formulation import node_derivatives, node_problem
from solver.geometry import touchable_points, touching_points
from solver.robot import Robot
from solver.scene import Scene
from solver.solve import check_clear, check_command, check_width
from solver.status import Status

LARGEST_STEP, SMALLEST_STEP = 0.25, 0.03  # cable displacement of one solve, and of the last try of one [mm]
PRETENSION = 0.05  # a touching robot is not slackened below it [mm]
SLACK = 1e-3  # below it a shear costs too little for IPOPT, and the robot is taken as free [mm]
CABLE_RESOLUTION = 1e-6  # to which the cable at the tension limit is found [mm]
MOVE_OFFSET, MOVE_SLOPE = 0.5, 16.0  # a node that moves farther than offset + slope·|step| has left the branch [mm]

OPTIONS: dict[str, Any] = {
    "print_time": False,
    "ipopt": {
        "print_level": 0,
        "sb": "yes",
        "max_iter": 500,
        "tol": 1e-11,
        "dual_inf_tol": 1e-10,
        "constr_viol_tol": 1e-11,
        "compl_inf_tol": 1e-11,
        "acceptable_iter": 0,
        "bound_relax_factor": 0.0,
        "nlp_scaling_method": "none",
        "mu_init": 1e-9,
        "warm_start_init_point": "yes",
        "warm_start_bound_push": 1e-9,
        "warm_start_bound_frac": 1e-9,
        "warm_start_slack_bound_push": 1e-9,
        "warm_start_slack_bound_frac": 1e-9,
        "warm_start_mult_bound_push": 1e-9,
    },
}


class _Point(NamedTuple):
    """A solution of the node problem: unknowns, and multipliers of (equalities, gaps) in CasADi's sign."""

    cable: float
    unknowns: np.ndarray
    multipliers: np.ndarray
    iterations: int = 0


class _Pose(NamedTuple):
    """A shape: points of nodes 0…n, angles of their disks, turns and sines of the shear angles of the segments."""

    backbone: np.ndarray
    cable: np.ndarray
    angles: np.ndarray
    turns: np.ndarray
    sines: np.ndarray


class ReferenceSolver:
    """Follows the same equilibria as :class:`solver.Solver`, by the problem as the paper writes it.

    Only a branch is followed: where it ends in a snap or a jam, a step is ``FAILED``.

    Args:
        robot: The robot.
        scene: The obstacles.

    Raises:
        ValueError: If an obstacle overlaps the straight robot, is narrow enough to slip between its points, or names a
            node the robot does not have.
    """

    def __init__(self, robot: Robot, scene: Scene) -> None:
        self.robot = robot
        self.scene = scene
        self._shapes = [value for obstacle in scene for value in obstacle.parameters]
        self._touchable = touchable_points(robot, scene)
        check_width(robot, scene)
        self._build()
        self._rest = self._equilibrium(self._free(0.0), Status.CONVERGED, 0)
        check_clear(self._rest)

    def rest(self) -> Equilibrium:
        """The straight, unactuated robot."""
        return self._rest

    def step(self, equilibrium: Equilibrium, cable_mm: float) -> Equilibrium:
        """Move the cable to a displacement along the branch, as far as the tension allows.

        Args:
            equilibrium: Where the robot is, from this solver or a :class:`solver.Solver` of an equal robot and scene.
            cable_mm: Commanded cable displacement, 0 to ``robot.max_cable_mm`` [mm].

        Returns:
            The equilibrium reached: ``CONVERGED``, ``STALLED`` at the tension limit, or
            ``FAILED`` with the present one.

        Raises:
            ValueError: If the command is out of range or the equilibrium is another robot's or scene's.
        """
        check_command(self.robot, self.scene, equilibrium, cable_mm)
        present, iterations, largest = self._start(equilibrium), 0, LARGEST_STEP
        while present.cable != (goal := self._goal(present, cable_mm)):
            step = float(np.clip(goal - present.cable, -largest, largest))
            following = self._solve(present, goal if abs(step) < largest else present.cable + step)
            if following is None:
                if largest > SMALLEST_STEP:
                    largest /= 2
                    continue
                return Equilibrium(self.robot, self.scene, equilibrium.block.copy(), Status.FAILED, iterations)
            iterations += following.iterations
            if step > 0 and self._tension(following) > self.robot.max_tension:
                return self._equilibrium(self._limit(present, following), Status.STALLED, iterations)
            present = following
        return self._equilibrium(present, Status.CONVERGED, iterations)

    def _build(self) -> None:
        n = self.robot.segments
        problem = node_problem(self.robot, self.scene.kinds)
        constraints = ca.vertcat(problem.equalities, problem.gaps)
        # In units of the free robot's segment angle, so that the tolerances mean the same at every displacement.
        free_angle = problem.parameters[0] / (n * problem.parameters[2])
        nlp: dict[str, Any] = {
            "x": problem.unknowns,
            "p": problem.parameters,
            "f": problem.objective / free_angle**2,
            "g": constraints,
        }
        self._ipopt = ca.nlpsol("reference", "ipopt", nlp, OPTIONS)
        multipliers = ca.MX.sym("multipliers", constraints.shape[0])
        lagrangian = problem.objective + ca.dot(multipliers, constraints)
        slope = ca.gradient(lagrangian, problem.parameters)[0]
        self._cable_slope = ca.Function("cable_slope", [problem.unknowns, problem.parameters, multipliers], [slope])
        bounded = self._touchable[:, :, 1:].ravel()
        self._lower = np.concatenate([np.zeros(3 * n), np.where(bounded, 0.0, -np.inf)])
        self._upper = np.concatenate([np.zeros(3 * n), np.full(bounded.size, np.inf)])

    def _parameters(self, cable: float) -> list[float]:
        return [cable, self.robot.length_mm, self.robot.offset_mm, *self._shapes]

    def _scale(self, cable: float) -> float:
        return (cable / (self.robot.segments * self.robot.offset_mm)) ** 2

    def _goal(self, point: _Point, cable: float) -> float:
        touching = bool(self._forces(point).any())
        return max(cable, min(point.cable, PRETENSION)) if touching else cable

    def _shape(self, cable: float, sines: np.ndarray) -> np.ndarray:
        """Unknowns of the robot with given sines of its shear angles, by the geometry of its four-bar linkages."""
        n, a, length = self.robot.segments, self.robot.offset_mm, self.robot.segment_mm
        chords = length * np.sqrt(1 - sines**2) - np.sqrt((length - cable / n) ** 2 - (length * sines) ** 2)
        turns = 2 * np.arcsin(chords / (2 * a))
        angles = np.concatenate([[0.0], -np.cumsum(turns)])
        headings = angles[:-1] - turns / 2 + np.arcsin(sines)
        backbone = np.cumsum(length * np.column_stack([-np.sin(headings), np.cos(headings)]), axis=0)
        disks = a * np.column_stack([np.cos(angles), np.sin(angles)])
        return np.concatenate([backbone.ravel(), (backbone + disks[1:]).ravel()])

    def _free(self, cable: float) -> _Point:
        unknowns = self._shape(cable, np.zeros(self.robot.segments))
        return self._balanced(cable, unknowns, np.zeros(self._touchable[:, :, 1:].size))

    def _balanced(self, cable: float, unknowns: np.ndarray, forces: np.ndarray) -> _Point:
        """A shape with multipliers of its gaps, and those of the equalities by least squares."""
        derivatives = node_derivatives(self.robot, self.scene.kinds)
        slope, _, equality_slopes, _, gap_slopes = (v.full() for v in derivatives(unknowns, self._parameters(cable)))
        balance = gap_slopes.T @ forces - slope.ravel()
        tensions = np.linalg.lstsq(equality_slopes.T, balance, rcond=None)[0]
        return _Point(cable, unknowns, np.concatenate([tensions, -forces]))

    def _start(self, equilibrium: Equilibrium) -> _Point:
        unknowns = np.concatenate([equilibrium.nodes[1:, :2].ravel(), equilibrium.cable_nodes[1:].ravel()])
        return self._balanced(equilibrium.cable_mm, unknowns, equilibrium.multipliers[:, :, 1:].ravel())

    def _solve(self, start: _Point, cable: float) -> _Point | None:
        """The solution at another displacement, ``None`` where IPOPT does not converge to it or leaves the branch."""
        if cable < SLACK:
            return self._free(cable)
        scale = self._scale(cable)
        guess = self._balanced(cable, self._shape(cable, self._pose(start.unknowns).sines), self._forces(start))
        solution = self._ipopt(
            x0=guess.unknowns,
            lam_g0=guess.multipliers / scale,
            p=self._parameters(cable),
            lbg=self._lower,
            ubg=self._upper,
        )
        unknowns = solution["x"].full().ravel()
        moved = np.linalg.norm((unknowns - start.unknowns).reshape(-1, 2), axis=1).max()
        allowed = MOVE_OFFSET + MOVE_SLOPE * abs(cable - start.cable)
        stats = self._ipopt.stats()
        if not (stats["success"] and moved <= allowed):
            return None
        multipliers = solution["lam_g"].full().ravel() * scale
        return self._settled(_Point(cable, unknowns, multipliers, stats["iter_count"]), solution["g"])

    def _settled(self, point: _Point, constraints: ca.DM) -> _Point:
        """Without the traces of the barrier: an interior-point method leaves every multiplier positive."""
        gaps = constraints.full().ravel()
        multipliers = point.multipliers.copy()
        inactive = -multipliers / self._scale(point.cable) < np.abs(gaps)
        inactive[: 3 * self.robot.segments] = False
        multipliers[inactive] = 0.0
        return point._replace(multipliers=multipliers)

    def _limit(self, below: _Point, above: _Point) -> _Point:
        """The tension limit between two points of the branch, from below, by bisection."""
        low, high = below, above.cable
        while high - low.cable > CABLE_RESOLUTION:
            middle = self._solve(low, (low.cable + high) / 2)
            if middle is None:
                break
            if self._tension(middle) > self.robot.max_tension:
                high = middle.cable
            else:
                low = middle
        return low

    def _tension(self, point: _Point) -> float:
        slope = self._cable_slope(point.unknowns, self._parameters(point.cable), point.multipliers)
        return self.robot.stiffness * float(slope)

    def _forces(self, point: _Point) -> np.ndarray:
        return -point.multipliers[3 * self.robot.segments :]

    def _pose(self, unknowns: np.ndarray) -> _Pose:
        points = unknowns.reshape(2, self.robot.segments, 2)
        backbone = np.vstack([[0.0, 0.0], points[0]])
        cable = np.vstack([[self.robot.offset_mm, 0.0], points[1]])
        disks, segments = cable - backbone, np.diff(backbone, axis=0)
        angles = np.unwrap(np.arctan2(disks[:, 1], disks[:, 0]))
        turns = -np.diff(angles)
        unsheared = angles[:-1] - turns / 2
        sideways = -np.sum(segments * np.column_stack([np.cos(unsheared), np.sin(unsheared)]), axis=1)
        return _Pose(backbone, cable, angles, turns, sideways / self.robot.segment_mm)

    def _equilibrium(self, point: _Point, status: Status, iterations: int) -> Equilibrium:
        pose = self._pose(point.unknowns)
        nodes = np.column_stack([pose.backbone, pose.angles])
        multipliers = np.zeros(self._touchable.shape)
        multipliers[:, :, 1:] = self._forces(point).reshape(multipliers[:, :, 1:].shape)
        parts: list[Any] = [
            [point.cable, self._tension(point), np.sum(pose.turns**2)],
            pose.sines,
            nodes,
            pose.cable,
            multipliers,
            self._gaps(nodes),
        ]
        block = np.concatenate([np.ravel(part) for part in parts])
        return Equilibrium(self.robot, self.scene, block, status, iterations)

    def _gaps(self, nodes: np.ndarray) -> np.ndarray:
        points = touching_points(self.robot, nodes)
        gaps = np.reshape([obstacle.gap(points) for obstacle in self.scene], self._touchable.shape)
        return np.where(self._touchable, gaps, np.inf)
