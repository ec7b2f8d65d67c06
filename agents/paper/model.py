"""The paper's robots, pulled and calibrated as in the paper, and the rod beside them."""

import math

import numpy as np

from agents.paper.published import CALIBRATION, LOADS, LOADS_G, MEASURED_G
from solver import Equilibrium, Robot, Scene, Solver, VirtualWork, fitted_slopes
from solver.spatial import SpatialEquilibrium, SpatialRobot, SpatialSolver

ROBOT = Robot.prototype(model="paper", max_tension=math.inf)
ROD = Robot.prototype(model="rod", max_tension=math.inf)
FIT_RANGE_MM = (0.0, 8.0)  # cable displacements that the straight lines of Fig. 7 are fitted over
STEP_MM = 0.05  # of a pull


def path(scene: Scene, cable_mm: float, robot: Robot = ROBOT) -> list[Equilibrium]:
    """Return the equilibria on the way as the cable is pulled from rest in small steps."""
    solver = Solver(robot, scene)
    equilibria = [solver.rest()]
    for cable in np.arange(STEP_MM, cable_mm + STEP_MM / 2, STEP_MM):
        equilibria.append(solver.step(equilibria[-1], float(cable)))
    return equilibria


def pull(scene: Scene, cable_mm: float, robot: Robot = ROBOT) -> Equilibrium:
    """Return the equilibrium after pulling the cable from rest in small steps."""
    return path(scene, cable_mm, robot)[-1]


def pull_in_space(cables_mm: tuple[float, float]) -> SpatialEquilibrium:
    """Return the equilibrium in space after pulling both cables (eq. 13)."""
    solver = SpatialSolver(SpatialRobot.prototype(model="paper"), Scene())
    return solver.step(solver.rest(), cables_mm)


def calibrate() -> tuple[VirtualWork, np.ndarray]:
    """Return the estimator with μ from the paper's calibration measurement, and the fitted slopes that it uses."""
    slopes = fitted_slopes(ROBOT, *FIT_RANGE_MM)
    return calibrated(*CALIBRATION, slopes), slopes


def calibrated(distance_mm: int, load_g: int, slopes: np.ndarray) -> VirtualWork:
    """Return the estimator with μ from one measurement of Table 1, for given slopes."""
    force = MEASURED_G[distance_mm][LOADS_G.index(load_g)]
    return VirtualWork.calibrated(force, load_g, slopes, ROBOT.offset_mm)


def force_per_load(estimator: VirtualWork, slopes: np.ndarray) -> float:
    """Return the contact force over the cable load by eq. 11, for slopes ``(x, y, φ)`` of the point that touches."""
    x, y, turn = slopes
    return float(-ROBOT.offset_mm * turn / (estimator.friction * y + x))


def table_1(estimator: VirtualWork, slopes: np.ndarray) -> np.ndarray:
    """Return the theoretical column of Table 1 by eq. 11, ``(7,)`` [g]."""
    return np.asarray(force_per_load(estimator, slopes) * LOADS)
