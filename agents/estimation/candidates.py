"""Candidates of the hidden numbers of a robot, and where its cables would be with each backlash."""

from dataclasses import dataclass

import numpy as np

from agents.environment import EnvIndex
from ccr_gym import Sensing

PLAYS, LOSSES = 9, 13  # candidates of the backlash and of the share of friction
ALL = slice(None)


@dataclass(frozen=True, slots=True)
class Candidates:
    """Values of hidden numbers that are tried, from the ranges that episodes draw from.

    Attributes:
        latencies: Delays of what is seen, ``(L,)`` [steps].
        plays: Halves of the backlash, ``(B,)`` [a].
        losses: Shares of the tension that friction takes, ``(E,)``.
    """

    latencies: np.ndarray
    plays: np.ndarray
    losses: np.ndarray

    @classmethod
    def of(cls, sensing: Sensing) -> "Candidates":
        """Return candidates that cover the ranges of a sensing."""
        low, high = map(int, sensing.latency)
        return cls(np.arange(low, high + 1), _spread(sensing.backlash, PLAYS) / 2, _spread(sensing.tendon_loss, LOSSES))


def _spread(ends: tuple[float, ...], count: int) -> np.ndarray:
    """Return evenly spaced candidates, a single one where the range is a number."""
    low, high = ends
    return np.linspace(low, high, count if low < high else 1)


class Loops:
    """Where cables are behind motors with each candidate of the backlash, and which way they last moved.

    Args:
        count: Number N of robots.
        commands: Number c of commands of a robot.
        candidates: The candidates.

    Attributes:
        places: Displacements of the latest steps, the present one first, ``(N, L, c, B)`` [a].
        moved_in: Whether the pulled cables last moved in, ``(N, c, B)`` bool.
    """

    def __init__(self, count: int, commands: int, candidates: Candidates) -> None:
        self._plays, steps = candidates.plays, int(candidates.latencies[-1]) + 1
        self.places = np.zeros((count, steps, commands, len(candidates.plays)))
        self.moved_in = np.ones((count, commands, len(candidates.plays)), bool)
        self._fresh = np.ones(count, bool)

    def reset(self, index: EnvIndex) -> None:
        """Start new episodes of some robots."""
        self._fresh[index] = True

    def update(self, motors: np.ndarray, index: EnvIndex) -> None:
        """Take in the next positions of motors, ``(k, c)`` [a]."""
        motors, fresh = motors[:, :, None], self._fresh[index]
        places = np.where(fresh[:, None, None, None], motors[:, None], self.places[index])
        before = places[:, 0]
        now = np.clip(before, motors - self._plays, motors + self._plays)
        moved = (now - before) * np.where(now < 0, -1.0, 1.0)
        was_in = self.moved_in[index] | fresh[:, None, None]
        self.moved_in[index] = np.where(np.abs(moved) > 1e-12, moved > 0, was_in)
        self.places[index] = np.concatenate([now[:, None], places[:, :-1]], axis=1)
        self._fresh[index] = False
