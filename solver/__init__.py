"""Exact optimisation kinematics of a cable-driven continuum robot among obstacles."""

from solver.equilibrium import Equilibrium, Residuals
from solver.obstacles import Circle, HalfPlane, Obstacle
from solver.reference import ReferenceSolver
from solver.robot import Robot
from solver.scene import Scene
from solver.solve import Solver
from solver.status import Status

__all__ = [
    "Circle",
    "Equilibrium",
    "HalfPlane",
    "Obstacle",
    "ReferenceSolver",
    "Residuals",
    "Robot",
    "Scene",
    "Solver",
    "Status",
]
