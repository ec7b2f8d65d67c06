"""Drives: how a few inputs become the displacements of many cables."""

from typing import NamedTuple

import numpy as np

from solver import Robot
from solver.common.rod import full_cables


class Drive(NamedTuple):
    """Maps inputs to displacements of the cables.

    Attributes:
        inputs: Their number.
        matrix: Displacements per input, ``(cables, inputs)``; ``None`` where each input is that of a cable.
        slack: Length by which unused cables are paid out beyond what the inputs say, as a fraction.
    """

    inputs: int
    matrix: np.ndarray | None = None
    slack: float = 0.0

    def pulls(self, reached, increment):
        """Return displacements after a move on the inputs that fit those reached best."""
        if self.matrix is None:
            return reached + increment
        taut = np.where(reached < 0, reached / (1 + self.slack), reached)
        pulls = self.matrix @ (np.linalg.lstsq(self.matrix, taut, rcond=None)[0] + increment)
        return np.where(pulls < 0, pulls * (1 + self.slack), pulls)


def drives_of(generator, robot):
    """Return the drives of a robot: signed commands and, where there are several cables, each cable for itself.

    A signed command is a direction of bending of each section, on whose side cables are pulled while those opposite
    are paid out: l = a u·e, summed over the sections that a cable runs through.
    """
    raw = Drive(len(robot.cables))
    if robot.model == "paper" or len(robot.cables) == 1:
        return [raw]
    cables = full_cables(robot)
    ends = sorted({cable.end for cable in cables})
    axes = 1 if isinstance(robot, Robot) else 2
    sides = np.array([cable.hole_mm[:axes] for cable in cables]) / robot.offset_mm
    passes = np.array([[cable.end >= end for end in ends] for cable in cables], float)
    matrix = (passes[:, :, None] * sides[:, None]).reshape(len(cables), -1)
    return [Drive(matrix.shape[1], matrix, float(generator.choice([0.0, 0.0, 0.1, 1.0]))), raw]
