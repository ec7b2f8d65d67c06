"""The robot in space (eq. 13): two pairs of cables, and obstacles all around."""

from solver.spatial.batch import SpatialBatchSolver
from solver.spatial.equilibrium import SpatialEquilibrium
from solver.spatial.forces import SpatialVirtualWork, force_true, virtual_work, with_friction
from solver.spatial.obstacles import Box, Capsule, Cylinder, HalfSpace, SpatialObstacle, Sphere
from solver.spatial.reference import SpatialReferenceSolver
from solver.spatial.robot import SpatialRobot, sides
from solver.spatial.sensitivity import SpatialSensitivity, spatial_sensitivity
from solver.spatial.solve import SpatialSolver

__all__ = [
    "Box",
    "Capsule",
    "Cylinder",
    "HalfSpace",
    "SpatialBatchSolver",
    "SpatialEquilibrium",
    "SpatialObstacle",
    "SpatialReferenceSolver",
    "SpatialRobot",
    "SpatialSensitivity",
    "SpatialSolver",
    "SpatialVirtualWork",
    "Sphere",
    "force_true",
    "sides",
    "spatial_sensitivity",
    "virtual_work",
    "with_friction",
]
