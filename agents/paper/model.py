"""The paper's robots, pulled and calibrated as in the paper."""

import math

import numpy as np

from agents.paper.published import CALIBRATION, LOADS_G, MEASURED_G
from solver import Equilibrium, Robot, Scene, Solver, VirtualWork, fitted_slopes
from solver.spatial import SpatialEquilibrium, SpatialRobot, SpatialSolver

ROBOT = Robot.prototype(max_tension=math.inf)
FIT_RANGE_MM = (0.0, 8.0)  # cable displacements that the straight lines of Fig. 7 are fitted over


def pull(scene: Scene, cable_mm: float, step_mm: float = 0.05) -> Equilibrium:
    """Return the equilibrium after pulling the cable from rest in small steps."""
    solver = Solver(ROBOT, scene)
    equilibrium = solver.rest()
    for cable in np.arange(step_mm, cable_mm + step_mm / 2, step_mm):
        equilibrium = solver.step(equilibrium, float(cable))
    return equilibrium


def pull_in_space(cables_mm: tuple[float, float]) -> SpatialEquilibrium:
    """Return the equilibrium in space after pulling both cables (eq. 13)."""
    solver = SpatialSolver(SpatialRobot.prototype(), Scene())
    return solver.step(solver.rest(), cables_mm)


def calibrate() -> tuple[VirtualWork, np.ndarray]:
    """Return the estimator with μ from the paper's calibration measurement, and the fitted slopes that it uses."""
    distance, load = CALIBRATION
    force = MEASURED_G[distance][LOADS_G.index(load)]
    slopes = fitted_slopes(ROBOT, *FIT_RANGE_MM)
    return VirtualWork.calibrated(force, load, slopes, ROBOT.offset_mm), slopes


def force_per_load(estimator: VirtualWork, slopes: np.ndarray) -> float:
    """Return the contact force over the cable load by eq. 11, for slopes ``(x, y, φ)`` of the point that touches."""
    x, y, turn = slopes
    return float(-ROBOT.offset_mm * turn / (estimator.friction * y + x))


def table_1(estimator: VirtualWork, slopes: np.ndarray) -> np.ndarray:
    """Return the theoretical column of Table 1 by eq. 11, ``(7,)`` [g]."""
    return np.asarray(force_per_load(estimator, slopes) * np.array(LOADS_G))
