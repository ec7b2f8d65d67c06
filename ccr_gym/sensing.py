"""The imperfections between robot and agent: motors with backlash, sensors with noise, bias and latency.

Every episode samples its own when it begins, all of its noise included, from the generator of its environment. Sizes
are multiples of the robot's natural units (:class:`ccr_gym.scales.Scales`).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ccr_gym.actions import ActionSpec
from ccr_gym.checks import check_fields, check_range, checked
from ccr_gym.quantities import EnvIndex
from ccr_gym.scales import Scales
from ccr_gym.state import Arrays, put, take
from solver import Transmission
from solver.common.validation import SMALLEST

Range = tuple[float, ...]
DELAYED_KEYS = ("contact", "force_est", "force_error", "force_measured", "frames", "nodes")
STATE = (
    "_latency",
    "_backlash_mm",
    "_noise",
    "_motor_mm",
    "_loss",
    "_moved_in",
    "_history",
    "_history_empty",
    "rigidity_ratio",
)  # arrays of a SensorModel
MAX_LOSS = 0.9  # share of the tension that friction takes at most
HISTORY = 8  # observations kept, more than the largest latency
NOISE_STEPS = 256  # steps after which the noise of an episode repeats


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensing:
    """Ranges of the imperfections, which every episode samples from.

    Attributes:
        latency: Delay of all observations but cable displacements and set-point [steps].
        noise: Standard deviation of white noise on each component of the measured force [EI/L²].
        bias: Magnitude of the constant error of each component of the measured force [EI/L²].
        backlash: Play between motor and cable: after a reversal the cable rests until it is taken up [a].
        tendon_loss: Share of the tension that friction takes between motor and robot, against the motion, as in
            :class:`solver.Transmission`; unknown to the estimator.
        rigidity_ratio: Rigidity of the robot over its nominal value; it scales forces and leaves shapes unchanged.

    Raises:
        ValueError: If a range is not two numbers within bounds, the smaller one first.
    """

    latency: Range = checked((1, 4), check_range, whole=True, low=0, high=HISTORY - 1)
    noise: Range = checked((0.01, 0.03), check_range, low=0)
    bias: Range = checked((0.0, 0.06), check_range, low=0)
    backlash: Range = checked((0.025, 0.075), check_range, low=0)
    tendon_loss: Range = checked((0.0, 0.3), check_range, low=0, high=MAX_LOSS)
    rigidity_ratio: Range = checked((0.3, 3.0), check_range, low=SMALLEST)

    def __post_init__(self) -> None:
        check_fields(self)


EXACT = Sensing(latency=(0, 0), noise=(0, 0), bias=(0, 0), backlash=(0, 0), tendon_loss=(0, 0), rigidity_ratio=(1, 1))


class Imperfections(NamedTuple):
    """The imperfections of one episode.

    Attributes:
        latency: Delay [steps].
        backlash_mm: Play between motors and cables [mm].
        tendon_loss: Share of the tension that is lost.
        rigidity_ratio: Rigidity over its nominal value.
        force_error_n: Error of the measured force at every step, bias and noise, ``(NOISE_STEPS, d)`` [N].
    """

    latency: int
    backlash_mm: float
    tendon_loss: float
    rigidity_ratio: float
    force_error_n: np.ndarray


def sample_imperfections(sensing: Sensing, scales: Scales, space: int, generator: np.random.Generator) -> Imperfections:
    """Return the imperfections of an episode.

    Args:
        sensing: Ranges to sample from.
        scales: Natural units of the robot.
        space: Dimension d of the space.
        generator: Generator of the environment.
    """
    latency, backlash, loss, rigidity, noise, *biases = generator.random(5 + space).tolist()
    low, high = map(int, sensing.latency)
    bias = [_interpolate(sensing.bias, abs(2 * part - 1)) * math.copysign(1, part - 0.5) for part in biases]
    white = generator.normal(size=(NOISE_STEPS, space))
    return Imperfections(
        low + int(latency * (high - low + 1)),
        _interpolate(sensing.backlash, backlash) * scales.travel_mm,
        _interpolate(sensing.tendon_loss, loss),
        math.exp(_interpolate(tuple(map(math.log, sensing.rigidity_ratio)), rigidity)),
        (bias + _interpolate(sensing.noise, noise) * white) * scales.force_n,
    )


class SensorModel:
    """Motors and sensors of many robots.

    Attributes:
        rigidity_ratio: Rigidity of each robot over its nominal value, ``(N,)``.

    Args:
        count: Number N of robots.
        space: Dimension d of the space.
        cables: Number of cables.
        actions: The actuated coordinates.
        delayed: Which columns of an observation are delayed, ``(k,)`` bool.
    """

    def __init__(self, count: int, space: int, cables: int, actions: ActionSpec, delayed: np.ndarray) -> None:
        self._actions, self._delayed = actions, delayed
        self._has_backlash = np.arange(actions.size) < actions.commands  # cables have, the insertion has none
        self._latency = np.zeros(count, int)
        self._backlash_mm = np.zeros(count)
        self._noise = np.zeros((count, NOISE_STEPS, space))
        self._motor_mm = np.zeros((count, actions.size))
        self._loss, self._moved_in = np.zeros(count), np.ones((count, cables), bool)
        self._history = np.zeros((count, HISTORY, delayed.size))
        self._history_empty = np.ones(count, bool)
        self.rigidity_ratio = np.ones(count)

    def begin_episode(self, robot: int, sampled: Imperfections, motor_mm: np.ndarray) -> None:
        """Begin a robot's next episode, with the motors at these positions."""
        self._latency[robot], self._backlash_mm[robot] = sampled.latency, sampled.backlash_mm
        self._loss[robot], self.rigidity_ratio[robot] = sampled.tendon_loss, sampled.rigidity_ratio
        self._noise[robot] = sampled.force_error_n
        self._motor_mm[robot], self._moved_in[robot] = motor_mm, True
        self._history_empty[robot] = True

    def get_rows(self, robots: list[int]) -> Arrays:
        """Return the state of some robots."""
        return take(self, STATE, robots)

    def set_rows(self, robots: list[int], rows: Arrays) -> None:
        """Put robots into a state of :meth:`get_rows`."""
        put(self, rows, robots)

    def move_cables(self, before_mm: np.ndarray, after_mm: np.ndarray, index: EnvIndex) -> None:
        """Note which way cables have moved, displacements ``(..., cables)`` [mm]."""
        self._moved_in[index] = self._transmission(index).moved(before_mm, after_mm).moved_in

    def motor_tensions(self, tensions: np.ndarray, index: EnvIndex) -> np.ndarray:
        """Return the tensions that the motors see for nominal ones in the robot, ``(..., cables)`` [N]."""
        ratio = np.asarray(self.rigidity_ratio[index])[..., None]
        return self._transmission(index).motor_tensions(ratio * tensions)

    def _transmission(self, index: EnvIndex) -> Transmission:
        return Transmission(np.asarray(self._loss[index]), self._moved_in[index])

    def apply_backlash(self, actuated_mm: np.ndarray, increment_mm: np.ndarray, index: EnvIndex) -> np.ndarray:
        """Move the motors by increments, within bounds, and return where that leaves the actuated coordinates [mm].

        Args:
            actuated_mm: Actuated coordinates, ``(..., actions)``, or ``(...,)`` for a single one [mm].
            increment_mm: Increments of the motors, likewise [mm].
            index: The robots.
        """
        low, high, motor_mm = self._actions.low_mm, self._actions.high_mm, self._motor_mm[index]
        motor_mm = np.minimum(np.maximum(motor_mm + np.reshape(increment_mm, motor_mm.shape), low), high)
        self._motor_mm[index] = motor_mm
        half = self.half_backlash_mm(index)
        moved = np.minimum(np.maximum(np.reshape(actuated_mm, motor_mm.shape), motor_mm - half), motor_mm + half)
        return np.reshape(np.minimum(np.maximum(moved, low), high), np.shape(actuated_mm))

    def motor_mm(self, index: EnvIndex) -> np.ndarray:
        """Return the motor positions, as encoders read them, ``(..., actions)`` [mm]."""
        return np.asarray(self._motor_mm[index])

    def half_backlash_mm(self, index: EnvIndex) -> np.ndarray:
        """Return how far motors and actuated coordinates can be apart, ``(..., actions)`` [mm]."""
        return np.asarray(np.asarray(self._backlash_mm[index])[..., None] / 2 * self._has_backlash)

    def force_error(self, time: np.ndarray, index: EnvIndex) -> np.ndarray:
        """Return the error of the measured force at a step, bias and noise, ``(..., d)`` [N]."""
        return np.asarray(self._noise[np.arange(len(time))[index], time[index] % NOISE_STEPS])

    def apply_latency(self, rows: np.ndarray, time: np.ndarray, index: EnvIndex) -> np.ndarray:
        """Return observations whose delayed columns are those of earlier steps, of the first step at the beginning.

        Args:
            rows: Present observations, ``(..., k)``.
            time: Step of each episode, ``(N,)``.
            index: The robots.
        """
        robots = np.atleast_1d(np.arange(len(time))[index])
        now, present, empty = time[robots], rows.reshape(len(robots), -1), self._history_empty[robots]
        self._history[robots[empty]] = present[empty, None]
        self._history_empty[robots] = False
        self._history[robots, now % HISTORY] = present
        earlier = self._history[robots, (now - self._latency[robots]) % HISTORY]
        return np.where(self._delayed, earlier, present).reshape(rows.shape)


def _interpolate(ends: Range, part: float) -> float:
    low, high = ends
    return low + part * (high - low)
