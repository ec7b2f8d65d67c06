"""Exact optimisation-based kinematics of a cable-driven continuum robot among obstacles."""

from solver.cache.memo import TransitionMemo
from solver.common.actuation import Actuation
from solver.common.batch_slopes import CommandSlopes, StepSlopes
from solver.common.equilibrium import Optimality, Residuals
from solver.common.obstacle import Extent, Obstacle
from solver.common.presets import PRESETS, Preset
from solver.common.quasi_static import natural_frequency, quasi_static_rate
from solver.common.rod import Cable, Load
from solver.common.rows import Rows
from solver.common.scene import Scene
from solver.common.signals import held_signals
from solver.common.status import Status
from solver.common.trace import Trace
from solver.common.transmission import Transmission
from solver.planar.batch import BatchSolver, ReferenceBatch
from solver.planar.contact_force import contact_estimate, shape_estimate
from solver.planar.custom import Custom
from solver.planar.equilibrium import Equilibrium
from solver.planar.estimators import Motion, RigidityFit, force_factor, free_motion, point_forces, shape_motion
from solver.planar.family import Family
from solver.planar.forces import VirtualWork, force_true, onset_tension, virtual_work
from solver.planar.free import clearance, fitted_slopes, free_nodes, free_tension, tip_slopes
from solver.planar.obstacles import Capsule, Circle, Ellipse, HalfPlane, Polygon
from solver.planar.reference import ReferenceSolver
from solver.planar.robot import Robot
from solver.planar.sensitivity import Sensitivity, sensitivity
from solver.planar.solve import Solver

__all__ = [
    "PRESETS",
    "Actuation",
    "BatchSolver",
    "Cable",
    "Capsule",
    "Circle",
    "CommandSlopes",
    "Custom",
    "Ellipse",
    "Equilibrium",
    "Extent",
    "Family",
    "HalfPlane",
    "Load",
    "Motion",
    "Obstacle",
    "Optimality",
    "Polygon",
    "Preset",
    "ReferenceBatch",
    "ReferenceSolver",
    "Residuals",
    "RigidityFit",
    "Robot",
    "Rows",
    "Scene",
    "Sensitivity",
    "Solver",
    "Status",
    "StepSlopes",
    "Trace",
    "TransitionMemo",
    "Transmission",
    "VirtualWork",
    "clearance",
    "contact_estimate",
    "fitted_slopes",
    "force_factor",
    "force_true",
    "free_motion",
    "free_nodes",
    "free_tension",
    "held_signals",
    "natural_frequency",
    "onset_tension",
    "point_forces",
    "quasi_static_rate",
    "sensitivity",
    "shape_estimate",
    "shape_motion",
    "tip_slopes",
    "virtual_work",
]
PART_OF = "ccr-gym"  # tells this package from others of its name
