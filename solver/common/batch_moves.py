"""Moves of the robots of a batch, some of them while their obstacles move, with their derivatives or without."""

from collections.abc import Sequence
from typing import Generic, NamedTuple, Self

import numpy as np

from solver import _kernel
from solver.common.equilibrium import RobotT_co
from solver.common.rows import NUMBERS, NUMBERS_OF, Kernel, Motion, RowBatch, as_slice
from solver.common.validation import check_instance

UNMOVED = -1.0  # in place of a part of the way


class SlopeArrays(NamedTuple):
    """What the kernel writes derivatives of steps to.

    Attributes:
        rows: Rows of each robot that moves, ``(k, rows, numbers)``.
        found: 1 for each whose derivatives exist, else 0, ``(k,)``.
    """

    rows: np.ndarray
    found: np.ndarray


class MoveBatch(RowBatch[RobotT_co], Generic[RobotT_co]):
    """Base class of a batch whose robots the kernel moves."""

    _work: tuple[np.ndarray, np.ndarray, np.ndarray]

    @property
    def kernel_arrays(self) -> Kernel:
        """The kernel's batch and the arrays of the rows, for calls of the kernel that move these robots."""
        make = _kernel.BatchArrays if self.space == 2 else _kernel.SpatialBatchArrays
        return make(self._kernel_batch, dict(zip(NUMBERS, NUMBERS_OF(self), strict=True)))

    def check_rested(self, robots: np.ndarray) -> None:
        """Check that robots were brought to rest in their scenes and may move.

        Raises:
            ValueError: If one was not.
        """
        if self._unrested:
            self._check_rested(robots.tolist())

    def copy_rows(self, robots: Sequence[int], other: Self) -> None:
        """Put robots into the states that the robots of another batch have at the same indices.

        It does what ``set_rows(robots, other.get_rows(robots))`` does, but faster.

        Raises:
            ValueError: If an index is out of range or repeated, or the batches are of different robots or numbers of
                obstacles; nothing has changed then.
            TypeError: If ``other`` is not a batch.
        """
        check_instance("other", other, MoveBatch, "take a batch of an equal robot")
        if other.robot != self.robot or other.layout.obstacles != self.layout.obstacles:
            raise ValueError("other is of another robot or number of obstacles; take a batch of an equal robot")
        indices = list(map(other._check_index, self._check_indices(robots)))
        if other is self:
            return
        at, chosen = as_slice(indices), set(indices)
        with self._exclusive, other._exclusive:
            self._kernel_batch.copy(other._kernel_batch, indices)
            for index in indices:
                self._scenes[index], self._compiled[index] = other._scenes[index], other._compiled[index]
                self._robots[index] = other._robots[index]
            self._others = (self._others - chosen) | (other._others & chosen)
            self._unrested = (self._unrested - chosen) | (other._unrested & chosen)
            self._limits[at] = other._limits[at]
            for own, given in zip(NUMBERS_OF(self), NUMBERS_OF(other), strict=True):
                own[at] = given[at]

    def _move_among(self, robots: list[int], motions: list[Motion], slopes: SlopeArrays | None = None) -> None:
        """Move robots, some of them while their obstacles move; derivatives are in the order of the robots."""
        if not motions:
            return self._move(robots, slopes)
        moving = [motion.robot for motion in motions]
        parts = np.full(len(motions), UNMOVED)
        own = _like(slopes, len(moving))
        try:
            self._move_into(moving, motions, parts, own)
        finally:  # also of those that had moved when the call was interrupted
            for motion, part in zip(motions, parts.tolist(), strict=True):
                if part != UNMOVED:
                    self._place(motion, part)
        still = set(robots).difference(moving)
        others = [robot for robot in robots if robot in still]
        rest = _like(slopes, len(others))
        self._move(others, rest)
        if slopes is not None and own is not None and rest is not None:
            at = {robot: k for k, robot in enumerate(robots)}
            for some, found in ((moving, own), (others, rest)):
                for to, values in zip(slopes, found, strict=True):
                    to[[at[robot] for robot in some]] = values
        return None

    def _move_into(
        self, robots: list[int], motions: list[Motion], parts: np.ndarray, slopes: SlopeArrays | None = None
    ) -> None:
        kernel_motions = [(motion.obstacles, motion.bounds) for motion in motions]
        arguments = robots, kernel_motions, self.commands, self.blocks, parts, *self._work
        self._kernel_batch.move(*arguments, *(slopes or ()))

    def _move(self, robots: list[int], slopes: SlopeArrays | None = None) -> None:
        self._kernel_batch.step(robots, self.commands, self.blocks, *self._work, *(slopes or ()))


def _like(slopes: SlopeArrays | None, count: int) -> SlopeArrays | None:
    """Return arrays for another number of robots."""
    if slopes is None:
        return None
    return SlopeArrays(np.empty((count, *slopes.rows.shape[1:])), np.empty(count, np.int64))
