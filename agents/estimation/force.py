"""The contact force from virtual work, corrected by a force sensor whose readings come late."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from agents.environment import EnvIndex
from ccr_gym import Sensing

DRIFT = 0.2  # change of the error of virtual work over the change of the force, per step
LEAST_DRIFT = 0.01  # of such a change, over the force
LEAST_NOISE = 1e-3  # of the sensor, where it has none [EI/L²]
EXPECTED = 6.0  # readings that the expected noise of the sensor is worth
SATURATED = 1 - 1e-6  # of the largest reading
CORRECTED = 0.03  # standard deviation of a corrected force, over the force: a late reading is of another place


class Work(NamedTuple):
    """What virtual work tells of the contact force of k robots.

    Attributes:
        force: The force, ``(k,)`` [EI/L²].
        slow: Variance of its error from the model and from what is known of the robot, which changes slowly.
        white: Variance of its error from the noise of the tensions.
    """

    force: np.ndarray
    slow: np.ndarray
    white: np.ndarray


class ForceFilter:
    """Follows the difference between sensor and virtual work of many robots, as a random walk.

    The zero and the noise of the sensor are mean and deviation of its readings before contact.

    Args:
        count: Number N of robots.
        sensing: Ranges of the imperfections.
        latency: Largest delay [steps].
        span: Force that is observed as 1 [EI/L²].
    """

    def __init__(self, count: int, sensing: Sensing, latency: int, span: float) -> None:
        self._span = span
        self._expected = max(float(np.mean(sensing.force_noise)), LEAST_NOISE) ** 2
        self._steps = 2 * sensing.force_resolution[1] ** 2 / 12  # of the zero as well; it does not average out
        self._zero, self._squares, self._readings = np.zeros((count, 3)), np.zeros(count), np.zeros(count)
        self._past = np.zeros((3, count, latency + 2))  # of virtual work, the present one first
        self._shift, self._spread = np.zeros(count), np.full(count, np.inf)

    def reset(self, index: EnvIndex) -> None:
        """Start new episodes of some robots."""
        for part in (self._zero, self._squares, self._readings, self._shift):
            part[index] = 0.0
        self._past[:, index] = 0.0
        self._spread[index] = np.inf

    def update(
        self,
        observation: Mapping[str, np.ndarray],
        work: Work,
        latency: np.ndarray,
        touching: np.ndarray,
        index: EnvIndex,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the magnitude of the force and its standard deviation, ``(k,)`` each [EI/L²].

        Args:
            observation: The next observations.
            work: What virtual work tells.
            latency: Delay of the sensor [steps].
            touching: Whether something touches, ``(k,)`` bool.
            index: The robots.
        """
        if "force_measured" not in observation:
            deviation = np.sqrt(work.slow + work.white)
            return np.where(touching, work.force, 0.0), np.where(touching, deviation, 0.0)
        measured = self._span * observation["force_measured"].astype(float)
        if "tension" not in observation:
            return np.linalg.norm(measured, axis=1), np.zeros(len(measured))
        past = np.concatenate([np.stack(work)[..., None], self._past[:, index][..., :-1]], axis=2)
        self._past[:, index] = past
        self._note_zero(measured, ~touching & ~past[0].any(axis=1), index)
        read = (np.abs(observation["force_measured"]) < SATURATED).all(axis=1)
        return self._correct(measured, past, np.rint(latency).astype(int), touching, read, index)

    def _note_zero(self, measured: np.ndarray, free: np.ndarray, index: EnvIndex) -> None:
        readings = self._readings[index] + free
        zero, size = self._zero[index], measured.shape[1]
        away = np.where(free[:, None], measured - zero[:, :size], 0.0)
        zero[:, :size] += away / np.maximum(readings, 1.0)[:, None]
        self._squares[index] += np.where(readings > 1, (away * (measured - zero[:, :size])).mean(axis=1), 0.0)
        self._zero[index], self._readings[index] = zero, readings

    def _correct(
        self,
        measured: np.ndarray,
        past: np.ndarray,
        latency: np.ndarray,
        touching: np.ndarray,
        read: np.ndarray,
        index: EnvIndex,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the corrected force and its standard deviation; a sensor at its limit is not read.

        What the sensor differs from virtual work by is the error of either: that of its zero, which stays, and that of
        virtual work. The difference is followed, and shared out by their variances. It is one of the past: where
        virtual work has become less certain since, so has the force.
        """
        robots = np.arange(len(latency))
        now, then, before = Work(*past[..., 0]), Work(*past[:, robots, latency]), Work(*past[:, robots, latency + 1])
        readings = np.maximum(self._readings[index], 1.0)
        noise = (EXPECTED * self._expected + self._squares[index]) / (EXPECTED + readings - 1)
        zero = noise / readings + self._steps
        size = _length(measured - self._zero[index][:, : measured.shape[1]], noise)
        drift = (DRIFT * (past[0, :, 0] - past[0, :, 1])) ** 2 + (LEAST_DRIFT * now.force) ** 2
        spread = self._spread[index] + drift + np.maximum(then.slow - before.slow, 0.0)
        spread = np.minimum(spread, now.slow + zero)
        shift = np.where(np.isinf(self._spread[index]), 0.0, self._shift[index])
        gain = spread / (spread + noise + then.white)
        gain = np.where(touching & read & (then.force > 0), gain, 0.0)
        shift, spread = shift + gain * (size - then.force - shift), (1 - gain) * spread
        self._shift[index], self._spread[index] = np.where(touching, shift, 0.0), np.where(touching, spread, np.inf)
        share = now.slow / (now.slow + zero)
        force = np.maximum(now.force + share * shift, 0.0)
        spread = spread + np.maximum(now.slow - then.slow, 0.0)
        deviation = np.sqrt(share**2 * spread + share * zero + now.white + (CORRECTED * force) ** 2)
        return np.where(touching, force, 0.0), np.where(touching, deviation, 0.0)


def _length(vectors: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Return the lengths of noisy vectors ``(k, d)``, less what the noise across them adds on average."""
    squares = (vectors**2).sum(axis=1) - (vectors.shape[1] - 1) * variance
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))
