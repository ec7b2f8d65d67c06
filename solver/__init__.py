"""Exact optimisation kinematics of a cable-driven continuum robot among obstacles."""

from solver.custom import Custom, Family
from solver.equilibrium import Equilibrium, Optimality, Residuals
from solver.obstacles import Capsule, Circle, Ellipse, HalfPlane, Obstacle, Polygon
from solver.reference import ReferenceSolver
from solver.robot import Robot
from solver.scene import Scene
from solver.solve import Solver
from solver.status import Status

__all__ = [
    "Capsule",
    "Circle",
    "Custom",
    "Ellipse",
    "Equilibrium",
    "Family",
    "HalfPlane",
    "Obstacle",
    "Optimality",
    "Polygon",
    "ReferenceSolver",
    "Residuals",
    "Robot",
    "Scene",
    "Solver",
    "Status",
]
