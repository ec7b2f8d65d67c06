"""The robot in space (eq. 13): two cables, and obstacles all around."""

from solver.spatial.equilibrium import SpatialEquilibrium
from solver.spatial.obstacles import Box, Capsule, Cylinder, HalfSpace, Sphere
from solver.spatial.reference import SpatialReferenceSolver
from solver.spatial.robot import SpatialRobot
from solver.spatial.solve import SpatialBatchSolver, SpatialSolver

__all__ = [
    "Box",
    "Capsule",
    "Cylinder",
    "HalfSpace",
    "SpatialBatchSolver",
    "SpatialEquilibrium",
    "SpatialReferenceSolver",
    "SpatialRobot",
    "SpatialSolver",
    "Sphere",
]
