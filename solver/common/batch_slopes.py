"""Slopes of the equilibria of a batch in their commands, and those of its steps."""

from collections.abc import Sequence
from typing import Generic, Literal, NamedTuple, overload

import numpy as np

from solver.common.batch import EquilibriumT_co, RobotBatch
from solver.common.batch_moves import SlopeArrays
from solver.common.equilibrium import RobotT_co
from solver.common.scene import Scene
from solver.common.slopes import row_parts

PARTS = ("nodes", "turns", "multipliers", "tensions", "forces", "displacements")  # of a row of the kernel's


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


class StepSlopes(NamedTuple):
    """Slopes of the steps of a batch in their commands, where the robots ended.

    They have one row for each cable, and after a move by ``move`` one for the length, too: q rows. They exist where a
    step converged. Where the robot snapped, stalled, was blocked or gave up, all are zero and not found: the status
    tells which. They are those of a step that goes a little farther the same way: a contact that only just touches
    stays closed if it would be pressed then, and opens otherwise, and so do a cable that is only just taut and disks
    that only just meet. A cable at its least displacement, which can only be pulled, counts as pulled. Where contacts
    keep the cable of the paper's model from being slackened as commanded, the robot does not follow: its slopes are
    zero, and found.

    Attributes:
        nodes: Slopes of the node poses, ``(k, q, n+1, 3)``.
        turns: In space the rotations of the disks, ``(k, q, n+1, 3)`` [rad per mm]; in the plane empty,
            ``(k, q, 0, 3)``.
        multipliers: Slopes of the multipliers, ``(k, q, m, p, positions)`` [rad²/mm²].
        tensions: Slopes of the cable tensions, ``(k, q, c)`` [N/mm].
        forces: Slopes of the force of each obstacle on the robot, ``(k, q, m, d)`` [N/mm].
        displacements: Slopes of the displacement of each obstacle on a spring, ``(k, q, m, d)``.
        clearance: Slopes of the smallest gap, ``(k, q)``; zero where something touches.
        found: Whether they exist, ``(k,)`` bool; see :class:`CommandSlopes` for steps that converged and have none.
        statuses: How the steps ended, values of :class:`solver.Status`, ``(k,)``.
    """

    nodes: np.ndarray
    turns: np.ndarray
    multipliers: np.ndarray
    tensions: np.ndarray
    forces: np.ndarray
    displacements: np.ndarray
    clearance: np.ndarray
    found: np.ndarray
    statuses: np.ndarray


class SlopeBatch(RobotBatch[RobotT_co, EquilibriumT_co], Generic[RobotT_co, EquilibriumT_co]):
    """Base class of batches whose equilibria the kernel can differentiate."""

    @overload
    def step(
        self, cable_mm: np.ndarray, robots: Sequence[int] | None = None, scenes: Sequence[Scene] | None = None
    ) -> None: ...

    @overload
    def step(
        self,
        cable_mm: np.ndarray,
        robots: Sequence[int] | None = None,
        scenes: Sequence[Scene] | None = None,
        *,
        derivatives: Literal[True],
    ) -> StepSlopes: ...

    def step(
        self,
        cable_mm: np.ndarray,
        robots: Sequence[int] | None = None,
        scenes: Sequence[Scene] | None = None,
        *,
        derivatives: bool = False,
    ) -> StepSlopes | None:
        """Move the cables of all robots, or of some, as :meth:`solver.common.batch.RobotBatch.step`.

        Args:
            cable_mm: Commanded cable displacement of each of them, ``(k,)``, of several cables ``(k, c)`` [mm].
            robots: Indices of the robots; ``None`` for all.
            scenes: Where the obstacles of each of them move to within the step; ``None`` if none moves.
            derivatives: Whether to return the slopes of the steps in ``cable_mm``, in the order of the robots. They
                take much less time than :meth:`slopes` after the step, and do not change it.

        Raises:
            ValueError: As there; and if derivatives are asked of a :class:`solver.ReferenceBatch`.
        """
        if not derivatives:
            self._step(cable_mm, robots, scenes)
            return None
        indices = self._all if robots is None else self._check_indices(robots)
        slopes = self._slope_arrays(len(indices), self.cables)
        self._step(cable_mm, robots, scenes, slopes)
        return self._step_slopes(slopes, indices)

    @overload
    def move(self, robots: int | slice | list[int], scenes: Sequence[Scene] | None = None) -> None: ...

    @overload
    def move(
        self, robots: int | slice | list[int], scenes: Sequence[Scene] | None = None, *, derivatives: Literal[True]
    ) -> StepSlopes: ...

    def move(
        self, robots: int | slice | list[int], scenes: Sequence[Scene] | None = None, *, derivatives: bool = False
    ) -> StepSlopes | None:
        """Move robots to their :attr:`commands` as :meth:`solver.common.batch.RobotBatch.move`.

        Args:
            robots: Their indices.
            scenes: Where the obstacles of each of them move to meanwhile.
            derivatives: Whether to return the slopes in these commands, cables and length, as :meth:`step`.

        Raises:
            ValueError: As there; and if derivatives are asked of a :class:`solver.ReferenceBatch`.
        """
        indices = self._indices_of(robots)
        slopes = self._slope_arrays(len(indices), self.cables + 1) if derivatives else None
        self._move_to_commands(indices, scenes, slopes)
        return None if slopes is None else self._step_slopes(slopes, indices)

    def slopes(self, robots: Sequence[int] | None = None) -> CommandSlopes:
        """Return the slopes of the present equilibria of all robots, or of some, in their commands.

        Args:
            robots: Indices of the robots, k of them; ``None`` for all.

        Raises:
            ValueError: If an index is out of range or repeated, or a robot was not brought to rest in its scene.
        """
        indices = self._all if robots is None else self._check_indices(robots)
        found = np.zeros(len(indices), np.int64)
        with self._exclusive:
            self._check_rested(indices)
            slopes = np.zeros((len(indices), self.cables + 1, self._kernel_batch.slope_row))
            self._kernel_batch.slopes(indices, self.blocks, slopes, found)
            cables = self.layout.cables(self.blocks)[indices]
        if self.robot.model == "paper":
            found *= cables.any(axis=1)
        slopes[found == 0] = 0.0
        return CommandSlopes(**self._parts(slopes), found=found > 0)

    def _slope_arrays(self, count: int, rows: int) -> SlopeArrays:
        """Return arrays for the slopes of steps of some robots."""
        return SlopeArrays(np.empty((count, rows, self._kernel_batch.slope_row + 1)), np.empty(count, np.int64))

    def _step_slopes(self, slopes: SlopeArrays, robots: list[int]) -> StepSlopes:
        statuses = self.statuses.copy() if robots is self._all else self.statuses[robots]
        parts = self._parts(slopes.rows)
        return StepSlopes(**parts, clearance=slopes.rows[..., -1], found=slopes.found > 0, statuses=statuses)

    def _parts(self, slopes: np.ndarray) -> dict[str, np.ndarray]:
        """Return the parts of rows of slopes by their names."""
        shape = slopes.shape[:2]
        names = PARTS if self.space == 3 else [name for name in PARTS if name != "turns"]
        places = zip(names, row_parts(self.layout, self.robot.segments), strict=True)
        parts = {name: slopes[..., columns].reshape(*shape, *part) for name, (columns, part) in places}
        return {"turns": np.empty((*shape, 0, 3)), **parts}
