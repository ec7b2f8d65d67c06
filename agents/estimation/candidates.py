"""Candidates of the hidden numbers of a robot, and where its cables would be with each backlash."""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from agents.environment import EnvIndex
from ccr_gym import Sensing

PLAYS, LOSSES = 9, 13  # candidates of the backlash and of the share of friction
FINE = 8  # backlashes between two candidates, for which way a cable moved
NEAR = 12  # of these to either side of a candidate, that it stands for
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
        self._fine = _refined(candidates.plays)
        self.places = np.zeros((count, steps, commands, len(candidates.plays)))
        self.moved_in = np.ones((count, commands, len(candidates.plays)), bool)
        self._fine_places = np.zeros((count, commands, len(self._fine)))
        self._fine_in = np.ones(self._fine_places.shape, bool)
        self._fresh = np.ones(count, bool)

    def reset(self, index: EnvIndex) -> None:
        """Start new episodes of some robots."""
        self._fresh[index] = True

    def update(self, motors: np.ndarray, index: EnvIndex) -> None:
        """Take in the next positions of motors, ``(k, c)`` [a]."""
        motors, fresh = motors[:, :, None], self._fresh[index]
        places = np.where(fresh[:, None, None, None], motors[:, None], self.places[index])
        was_in = fresh[:, None, None]
        now, self.moved_in[index] = _followed(places[:, 0], motors, self._plays, self.moved_in[index] | was_in)
        self._follow_closely(motors, index)
        self.places[index] = np.concatenate([now[:, None], places[:, :-1]], axis=1)
        self._fresh[index] = False

    def inward(self, index: EnvIndex) -> np.ndarray:
        """Return the probabilities that cables last moved in, as far as the motors tell, ``(k, c, B)``.

        A candidate stands for all backlashes nearby. Where a motor rests just at an end of one of them, they disagree
        about whether the cable has moved.
        """
        if len(self._plays) == 1:
            return self.moved_in[index].astype(float)
        around = np.pad(self._fine_in[index], [(0, 0), (0, 0), (NEAR, NEAR)], mode="edge")
        return np.asarray(sliding_window_view(around, 2 * NEAR + 1, axis=-1)[..., ::FINE, :].mean(axis=-1))

    def _follow_closely(self, motors: np.ndarray, index: EnvIndex) -> None:
        """Follow cables with backlashes between the candidates."""
        fresh = self._fresh[index][:, None, None]
        before = np.where(fresh, motors, self._fine_places[index])
        followed = _followed(before, motors, self._fine, self._fine_in[index] | fresh)
        self._fine_places[index], self._fine_in[index] = followed


def _followed(
    places: np.ndarray, motors: np.ndarray, plays: np.ndarray, moved_in: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return where motors leave cables, and whether these last moved in, ``(k, c, B)`` each."""
    now = np.clip(places, motors - plays, motors + plays)
    moved = (now - places) * np.where(now < 0, -1.0, 1.0)
    return now, np.where(np.abs(moved) > 1e-12, moved > 0, moved_in)


def _refined(plays: np.ndarray) -> np.ndarray:
    """Return the candidates, and backlashes evenly spaced between them."""
    return np.linspace(plays[0], plays[-1], (len(plays) - 1) * FINE + 1)
