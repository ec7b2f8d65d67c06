"""Eq. 5 in the node coordinates of the paper, for SciPy's SLSQP, which stands in for the paper's fmincon.

Both are sequential quadratic programs that take differences where no gradient is given. Written in NumPy alone: nothing
is shared with the solver but the sizes of the robot and the scene.
"""

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from solver import Circle, Equilibrium

UNIT_MM = 10.0  # of lengths inside the optimiser
UNIT_RAD = 0.1  # of angles, so that objective and constraints are of similar size
TOLERANCE, ITERATIONS = 1e-10, 400  # of SLSQP
DISKS = np.array([[0.0, -1.0], [1.0, 0.0]])  # turns a vector by 90°


class Problem(NamedTuple):
    """Eq. 5 of one robot: lengths of backbone segments, cable segments and disks, and circles, in :data:`UNIT_MM`."""

    segment: float
    cable: float
    offset: float
    centers: np.ndarray
    radii: np.ndarray


class Solution(NamedTuple):
    """What SLSQP found: points (backbone, cable) of nodes 1…n ``(2, n, 2)`` [mm], J [rad²], and what it took."""

    points: np.ndarray
    objective: float
    success: bool
    iterations: int
    seconds: float


def problem_of(equilibrium: Equilibrium, cable_mm: float) -> Problem:
    """Return eq. 5 for the robot and the circles of an equilibrium at another cable displacement."""
    robot = equilibrium.robot
    circles = [obstacle for obstacle in equilibrium.scene if isinstance(obstacle, Circle)]
    return Problem(
        robot.segment_mm / UNIT_MM,
        (robot.segment_mm - cable_mm / robot.segments) / UNIT_MM,
        robot.offset_mm / UNIT_MM,
        np.array([circle.center for circle in circles]).reshape(-1, 2) / UNIT_MM,
        np.array([circle.radius for circle in circles]) / UNIT_MM,
    )


def node_points(equilibrium: Equilibrium) -> np.ndarray:
    """Return the points (backbone, cable) of nodes 1…n, ``(2, n, 2)`` [mm]."""
    return np.stack([equilibrium.nodes[1:, :2], equilibrium.cable_nodes[1:]])


def objective(points: np.ndarray, problem: Problem) -> float:
    """Return the sum of squared disk angles J [rad²], as eq. 5 has it, of points in :data:`UNIT_MM`."""
    _, disks = _chains(points, problem)
    return float(np.sum(_turns(disks) ** 2))


def gradient(points: np.ndarray, problem: Problem) -> np.ndarray:
    """Return the gradient of :func:`objective`, as flat as ``points``."""
    _, disks = _chains(points, problem)
    per_angle = np.zeros(len(disks))
    twice = 2 * _turns(disks)
    per_angle[1:] += twice
    per_angle[:-1] -= twice
    in_disks = (per_angle / np.sum(disks**2, axis=1))[1:, None] * (disks[1:] @ DISKS.T)
    return np.stack([-in_disks, in_disks]).ravel()


def equalities(points: np.ndarray, problem: Problem) -> np.ndarray:
    """Return the lengths of backbone, cable and disks minus their values, ``(3n,)`` [:data:`UNIT_MM`]."""
    chains, disks = _chains(points, problem)
    backbone, cable = (np.linalg.norm(np.diff(chain, axis=0), axis=1) for chain in chains)
    across = np.linalg.norm(disks[1:], axis=1)
    return np.concatenate([backbone - problem.segment, cable - problem.cable, across - problem.offset])


def equality_slopes(points: np.ndarray, problem: Problem) -> np.ndarray:
    """Return the Jacobian of :func:`equalities`, ``(3n, 4n)``."""
    chains, disks = _chains(points, problem)
    count = len(disks) - 1
    every, slopes = np.arange(count), np.zeros((3, count, 2, count, 2))
    for line, chain in enumerate(chains):
        ahead = np.diff(chain, axis=0)
        ahead /= np.linalg.norm(ahead, axis=1)[:, None]
        slopes[line, every, line, every] = ahead
        slopes[line, every[1:], line, every[:-1]] = -ahead[1:]
    across = disks[1:] / np.linalg.norm(disks[1:], axis=1)[:, None]
    slopes[2, every, 0, every], slopes[2, every, 1, every] = -across, across
    return slopes.reshape(3 * count, 4 * count)


def inequalities(points: np.ndarray, problem: Problem) -> np.ndarray:
    """Return the paper's f = (x − x_c)² − r_c² of every circle and point, flat."""
    apart = points.reshape(-1, 2) - problem.centers[:, None]
    return np.asarray(np.sum(apart**2, axis=2) - problem.radii[:, None] ** 2).ravel()


def inequality_slopes(points: np.ndarray, problem: Problem) -> np.ndarray:
    """Return the Jacobian of :func:`inequalities`."""
    apart = 2 * (points.reshape(-1, 2) - problem.centers[:, None])
    circles, count, _ = apart.shape
    slopes, every = np.zeros((circles, count, count, 2)), np.arange(count)
    slopes[:, every, every] = apart
    return slopes.reshape(circles * count, 2 * count)


def solve(start: Equilibrium, cable_mm: float, *, with_gradient: bool, with_slopes: bool = False) -> Solution:
    """Solve eq. 5 at a cable displacement from an equilibrium as the guess.

    Args:
        start: Equilibrium of the paper's model, among circles.
        cable_mm: Cable displacement [mm].
        with_gradient: Whether SLSQP is given the gradient of the objective; else it takes differences.
        with_slopes: Whether it is given the Jacobians of the constraints as well.
    """
    problem = problem_of(start, cable_mm)
    constraints = [_constraint("eq", equalities, equality_slopes, problem, with_slopes)]
    if problem.radii.size:
        constraints.append(_constraint("ineq", inequalities, inequality_slopes, problem, with_slopes))
    begin = time.process_time()
    found = minimize(
        lambda z: objective(z, problem) / UNIT_RAD**2,
        node_points(start).ravel() / UNIT_MM,
        method="SLSQP",
        jac=(lambda z: gradient(z, problem) / UNIT_RAD**2) if with_gradient else None,
        constraints=constraints,
        options={"maxiter": ITERATIONS, "ftol": TOLERANCE},
    )
    seconds, points = time.process_time() - begin, UNIT_MM * found.x.reshape(2, -1, 2)
    return Solution(points, objective(found.x, problem), bool(found.success), int(found.nit), seconds)


def _constraint(
    kind: str, function: Callable[..., Any], slopes: Callable[..., Any], problem: Problem, with_slopes: bool
) -> dict[str, Any]:
    given = {"jac": slopes} if with_slopes else {}
    return {"type": kind, "fun": function, "args": (problem,), **given}


def _chains(points: np.ndarray, problem: Problem) -> tuple[list[np.ndarray], np.ndarray]:
    """Return the points of backbone and cable at nodes 0…n, and the disks between them."""
    backbone, cable = points.reshape(2, -1, 2)
    chains = [np.vstack([[0.0, 0.0], backbone]), np.vstack([[problem.offset, 0.0], cable])]
    return chains, chains[1] - chains[0]


def _turns(disks: np.ndarray) -> np.ndarray:
    """Return the angles between consecutive disks; the arccosine of eq. 5 has no slope at zero [rad]."""
    before, after = disks[:-1], disks[1:]
    sine = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return np.asarray(np.arctan2(sine, np.sum(before * after, axis=1)))
