"""What virtual work errs by on the nominal robot, of which the force is known."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agents.estimation.robot import RobotEstimator
from agents.replay.log import Log
from agents.replay.model import AnyEquilibrium
from agents.replay.observations import observations, settings_of
from agents.replay.robots import AnyRobot
from agents.replay.sensing import Instruments
from ccr_gym import EXACT, Scales
from solver import Scene

CORRECTION_ERROR = 0.5  # standard deviation of a correction, over the correction
LEAST_FORCE = 0.05  # below which nothing is corrected [EI/L²]
MOST = 3.0  # the largest factor, and one over the smallest


def corrections(
    log: Log, robot: AnyRobot, scene: Scene, commands_mm: np.ndarray, nominal: Sequence[AnyEquilibrium]
) -> np.ndarray:
    """Return factors on the forces that virtual work tells, ``(K,)``.

    Virtual work counts the motion of a free robot, and one that pushes hard, or against several obstacles, moves
    otherwise. So the same estimator reads the tensions that the nominal robot would have had at the encoders, and the
    factor is the force of that robot over what is read.

    Args:
        log: The log.
        robot: The nominal robot.
        scene: The obstacles.
        commands_mm: Commands that the encoders read, ``(K, commands)`` [mm].
        nominal: Equilibria at these.
    """
    settings, unit = settings_of(robot, Instruments(EXACT, 0.0, 0.0), None), Scales.of(robot).force_n
    ideal = replace(log, tensions_n=np.array([equilibrium.tensions for equilibrium in nominal]))
    estimator = RobotEstimator(settings, 1)
    rows = observations(ideal, settings, scene, commands_mm, nominal)
    read = np.array([float(estimator.update_one(observation).force) for observation in rows])
    known = np.array([np.linalg.norm(equilibrium.forces, axis=1).sum() for equilibrium in nominal]) / unit
    enough = np.minimum(read, known) > LEAST_FORCE
    return np.where(enough, np.clip(known / np.where(enough, read, 1.0), 1 / MOST, MOST), 1.0)
