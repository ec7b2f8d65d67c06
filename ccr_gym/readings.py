"""What is read of robots after a step."""

from typing import NamedTuple

import numpy as np

from ccr_gym.quantities import Quantity


class ForceReading(NamedTuple):
    """Contact forces of one robot, or of many, and their set-points.

    Attributes:
        force_true: Energy-based contact force on the robot, of the obstacle that matters, ``(..., d)`` [N].
        force_est: Its estimate, ``(..., d)`` [N].
        regulated: The one of them that is desired, ``(..., d)`` [N].
        desired: Magnitude of the set-point [N].
    """

    force_true: np.ndarray
    force_est: np.ndarray
    regulated: np.ndarray
    desired: Quantity


class PrivilegedState(NamedTuple):
    """The hidden state of one robot, or of many, for oracles and teachers; agents do not observe it.

    Attributes:
        force: Contact force on the robot that is regulated, ``(..., d)`` [N].
        rigidity_ratio: Rigidity over its nominal value.
        goal: Set-point after the next step, a magnitude or ``(..., d)`` [N].
        actuated_mm: Actuated coordinates of the robot, ``(..., actions)`` [mm].
        motor_mm: Positions of the motors, ``(..., actions)`` [mm].
        half_backlash_mm: How far both can be apart, ``(..., actions)`` [mm].
        tendon_loss: Share of the tension that friction takes.
        latency: Delay of shape and force sensor [steps].
    """

    force: np.ndarray
    rigidity_ratio: Quantity
    goal: Quantity
    actuated_mm: np.ndarray
    motor_mm: np.ndarray
    half_backlash_mm: np.ndarray
    tendon_loss: Quantity
    latency: Quantity
