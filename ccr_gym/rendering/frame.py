"""The state that one picture shows."""

from dataclasses import dataclass

import numpy as np

from solver import Equilibrium
from solver.spatial import SpatialEquilibrium


@dataclass(frozen=True, slots=True)
class Frame:
    """The state that one picture shows.

    Attributes:
        equilibrium: The robot among its obstacles.
        force_true: Energy-based contact force on the robot, base frame, ``(d,)`` [N].
        force_est: Estimated contact force on the robot, base frame, ``(d,)`` [N].
        desired_force: Magnitude of the set-point [N].
        force_scale: Force at which gauge and arrows reach full length, positive [N].
    """

    equilibrium: Equilibrium | SpatialEquilibrium
    force_true: np.ndarray
    force_est: np.ndarray
    desired_force: float
    force_scale: float
