"""Exact optimisation kinematics of a cable-driven continuum robot among obstacles."""

from solver.equilibrium import Equilibrium, Residuals
from solver.obstacles import Capsule, Circle, Ellipse, HalfPlane, Obstacle, Polygon
from solver.reference import ReferenceSolver
from solver.robot import Robot
from solver.scene import Scene
from solver.solve import Solver
from solver.status import Status

__all__ = [
    "Capsule",
    "Circle",
    "Ellipse",
    "Equilibrium",
    "HalfPlane",
    "Obstacle",
    "Polygon",
    "ReferenceSolver",
    "Residuals",
    "Robot",
    "Scene",
    "Solver",
    "Status",
]
