"""Signed commands of sections, and the displacements of cables that they stand for."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from solver.common.rod import AnyRod, full_cables
from solver.common.validation import check_alike, check_instance, check_numbers, check_whole

RIGHT_ANGLE = 1e-12  # cosines below it are roundoff


@dataclass(frozen=True, slots=True, eq=False)
class Actuation:
    """The map from a bending command of each section to the displacements of all cables.

    A command ``u`` of a section, in the plane one number and in space its components along x and y, is the cable travel
    ``a`` times the angle by which the section is to bend: a cable at the hole ``e`` (over a) is pulled by ``u·e``, and
    paid out where that is negative. Cables that run on to further sections follow, so that these keep their own bend.
    A pair of cables of the paper's model in space is one signed displacement, which is its own command.

    Attributes:
        matrix: Displacement of each cable per command, ``(cables, commands)``.
        recovery: Change of the commands per millimetre by which a pulled cable stops short, ``(commands, cables)``;
            ``None`` where each command is that of one cable alone.
        sections: Number of sections.
        directions: Commands that bend all sections alike, per millimetre of their sum, for each axis of bending,
            ``(commands, axes)``.
        low: −1 for commands that can be negative, 0 where no cable opposes, ``(commands,)``.
        high: 1 for those that can be positive, otherwise 0, ``(commands,)``.
    """

    matrix: np.ndarray
    recovery: np.ndarray | None
    sections: int
    directions: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, robot: AnyRod, space: int) -> Self:
        """Return the actuation of a robot of the plane, or of space.

        Args:
            robot: The robot.
            space: Dimensions of a point, 2 or 3.

        Raises:
            ValueError: If the robot is not one of this space.
            TypeError: If it is no robot.
        """
        check_instance("robot", robot, AnyRod, "take a solver.Robot or solver.spatial.SpatialRobot")
        own = len(robot.weight_per_length)
        check_whole("space", space, own, own, "the robot's own")
        cables, axes = len(robot.cables), space - 1
        given = full_cables(robot)
        sides = np.array([cable.hole_mm[:axes] for cable in given]) / robot.offset_mm
        if robot.model == "paper":
            return cls(np.eye(cables), None, 1, sides, np.full(cables, float(1 - axes)), np.ones(cables))
        last = np.array([cable.end for cable in given])
        ends = np.unique(last)
        sides[np.abs(sides) < RIGHT_ANGLE] = 0.0
        passed, own = last[:, None] >= ends, last[:, None] == ends
        pulls = own[:, :, None] * sides[:, None]
        # Bending summed up to a section follows from its own cables; a section's is the difference to the one before.
        summed = pulls / np.maximum(np.sum(sides**2, axis=1), RIGHT_ANGLE)[:, None, None]
        recovery = np.diff(summed, axis=1, prepend=0.0).reshape(cables, -1).T
        matrix = (passed[:, :, None] * sides[:, None]).reshape(cables, -1)
        low = np.sign(np.minimum(pulls.min(axis=0), 0.0)).ravel()
        high = np.sign(np.maximum(pulls.max(axis=0), 0.0)).ravel()
        directions = np.tile(np.eye(axes), (len(ends), 1)) / len(ends)
        return cls(matrix, None if matrix.size == 1 else recovery, len(ends), directions, low, high)

    def cables_mm(self, commands: np.ndarray) -> np.ndarray:
        """Return the displacements of the cables, ``(..., cables)``, for commands ``(..., commands)`` [mm]."""
        return _product(self.matrix, "commands", commands)

    def reached(self, commands: np.ndarray, cables_mm: np.ndarray) -> np.ndarray:
        """Return the commands that robots have reached whose pulled cables may have stopped short.

        Args:
            commands: What was commanded, ``(..., commands)`` [mm].
            cables_mm: Displacements reached, ``(..., cables)`` [mm].
        """
        wanted, cables_mm = self.cables_mm(commands), check_numbers("cables_mm", cables_mm, (..., len(self.matrix)))
        if self.recovery is None:
            return np.asarray(cables_mm / np.diagonal(self.matrix))
        check_alike(commands=wanted.shape[:-1], cables_mm=cables_mm.shape[:-1])
        short = np.where(wanted > 0, np.minimum(cables_mm - wanted, 0.0), 0.0)
        return np.asarray(commands + _product(self.recovery, "cables_mm", short))

    def steady(self, direction: np.ndarray) -> np.ndarray:
        """Return commands that bend all sections in a direction ``(..., axes)``, ``(..., commands)``."""
        return _product(self.directions, "direction", direction)

    def forces(self, tensions: np.ndarray) -> np.ndarray:
        """Return the tensions' work per command, ``(..., commands)``, for tensions ``(..., cables)`` [N]."""
        return _product(self.matrix.T, "tensions", tensions)


def _product(matrix: np.ndarray, name: str, vectors: np.ndarray) -> np.ndarray:
    """Return products with vectors, ``(..., rows)``, added term by term: the bits do not depend on their number."""
    vectors = check_numbers(name, vectors, (..., matrix.shape[1]))
    total = vectors[..., 0, None] * matrix[:, 0]
    for column in range(1, matrix.shape[1]):
        total = total + vectors[..., column, None] * matrix[:, column]
    return np.asarray(total)
