"""Moves of the robots of a batch, some of them while their obstacles move, with their derivatives or without."""

from typing import Generic, NamedTuple

import numpy as np

from solver.common.equilibrium import RobotT_co
from solver.common.rows import Motion, RowBatch

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
