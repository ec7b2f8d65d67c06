"""Slopes of the equilibria of a batch in their commands."""

from collections.abc import Sequence
from typing import Generic, NamedTuple

import numpy as np

from solver.common.batch import EquilibriumT_co, RobotBatch
from solver.common.equilibrium import RobotT_co
from solver.common.slopes import row_parts


class CommandSlopes(NamedTuple):
    """Slopes of equilibria in their commands, the displacement of each cable and then the length [mm].

    They are those of :func:`solver.sensitivity`, or in space :func:`solver.spatial.spatial_sensitivity`: at the
    contacts that press, wherever the robots are, whether they reached their commands or not.

    Attributes:
        nodes: Slopes of the node poses, ``(k, c+1, n+1, 3)``.
        turns: In space the rotations of the disks, ``(k, c+1, n+1, 3)`` [rad per mm]; in the plane empty,
            ``(k, c+1, 0, 3)``.
        multipliers: Slopes of the multipliers, ``(k, c+1, m, p, positions)`` [rad²/mm²].
        tensions: Slopes of the cable tensions, ``(k, c+1, c)`` [N/mm].
        forces: Slopes of the force of each obstacle on the robot, ``(k, c+1, m, d)`` [N/mm].
        displacements: Slopes of the displacement of each obstacle on a spring, ``(k, c+1, m, d)``.
        found: Whether they exist, ``(k,)`` bool: not for a robot of the paper's model whose cables are all slack, as
            its shear is undetermined, nor where taut cables lock a rod. Zero where they do not.
    """

    nodes: np.ndarray
    turns: np.ndarray
    multipliers: np.ndarray
    tensions: np.ndarray
    forces: np.ndarray
    displacements: np.ndarray
    found: np.ndarray


class SlopeBatch(RobotBatch[RobotT_co, EquilibriumT_co], Generic[RobotT_co, EquilibriumT_co]):
    """Base class of batches whose equilibria the kernel can differentiate."""

    def slopes(self, robots: Sequence[int] | None = None) -> CommandSlopes:
        """Return the slopes of the present equilibria of all robots, or of some, in their commands.

        Args:
            robots: Indices of the robots, k of them; ``None`` for all.

        Raises:
            ValueError: If an index is out of range or repeated, or a robot was not brought to rest in its scene.
        """
        indices = self._all if robots is None else self._check_indices(robots)
        shape = len(indices), self.cables + 1
        found = np.zeros(len(indices), np.int64)
        with self._exclusive:
            self._check_rested(indices)
            slopes = np.zeros((*shape, self._kernel_batch.slope_row))
            self._kernel_batch.slopes(indices, self.blocks, slopes, found)
            cables = self.layout.cables(self.blocks)[indices]
        if self.robot.model == "paper":
            found *= cables.any(axis=1)
        slopes[found == 0] = 0.0
        nodes, *others = (
            slopes[..., columns].reshape(*shape, *part) for columns, part in row_parts(self.layout, self.robot.segments)
        )
        if self.space == 2:
            others = [np.empty((*shape, 0, 3)), *others]
        turns, multipliers, tensions, forces, displacements = others
        return CommandSlopes(nodes, turns, multipliers, tensions, forces, displacements, found > 0)
