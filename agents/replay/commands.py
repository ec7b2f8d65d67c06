"""Commands of a robot's sections from the displacements of all its cables."""

import numpy as np

from agents.errors import UserError
from agents.replay.log import Log, cable_columns
from agents.replay.robots import AnyRobot
from solver import Actuation, Robot

IDLE = 1e-3  # weight of a cable that is let out, which may be slack, beside one that is pulled
APART = 0.1  # by which a cable may differ from what the other cables of its section say [a]


def actuation_of(robot: AnyRobot) -> Actuation:
    """Return the map from commands of a robot's sections to its cables."""
    return Actuation.of(robot, 2 if isinstance(robot, Robot) else 3)


def commands_mm(log: Log, robot: AnyRobot, name: str) -> np.ndarray:
    """Return the commands that bend the sections as the logged cables do, ``(K, commands)`` [mm].

    Cables that are pulled decide; one that is let out may be let out further, and hang slack.

    Args:
        log: The log.
        robot: The robot.
        name: Name of the log, for messages.

    Raises:
        UserError: If cables of a section contradict each other, naming line and column.
    """
    actuation, columns = actuation_of(robot), cable_columns(robot)[0]
    if actuation.recovery is None:
        return actuation.reached(log.cables_mm, log.cables_mm)
    commands = np.array([_fitted(actuation.matrix, cables) for cables in log.cables_mm])
    off = log.cables_mm - actuation.cables_mm(commands)
    most = APART * robot.offset_mm
    for row, column in np.argwhere(np.where(log.cables_mm > 0, np.abs(off), off) > most):
        wanted = log.cables_mm[row, column] - off[row, column]
        raise UserError(
            f"{name}, line {log.rows[row]}, column {columns[column]}: {log.cables_mm[row, column]:g} mm contradicts "
            f"the other cables of its section, by which it is {wanted:.3g} mm; the shape needs them within "
            f"{most:.3g} mm"
        )
    return commands


def _fitted(matrix: np.ndarray, cables: np.ndarray) -> np.ndarray:
    """Return commands by least squares, in which cables that are let out hardly count."""
    weights = np.where(cables > 0, 1.0, IDLE)
    return np.asarray(np.linalg.lstsq(weights[:, None] * matrix, weights * cables, rcond=None)[0])
