"""The imperfections between robot and agent: motors with backlash, sensors with noise, bias and latency.

Every episode samples its own when it begins, all of its noise included, from the generator of its environment.
"""

import math
from dataclasses import dataclass

import numpy as np

from ccr_gym.actions import ActionSpec
from ccr_gym.checks import check_fields, check_range, checked
from ccr_gym.quantities import EnvIndex
from solver.common.validation import SMALLEST

Range = tuple[float, ...]
DELAYED_KEYS = ("contact", "force_est", "force_error", "force_measured", "frames", "nodes")
HISTORY = 8  # observations kept, more than the largest latency
NOISE_STEPS = 256  # steps after which the noise of an episode repeats


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensing:
    """Ranges of the imperfections, which every episode samples from.

    Attributes:
        latency: Delay of all observations but cable displacements and set-point [steps].
        noise_n: Standard deviation of white noise on each component of the measured force [N].
        bias_n: Magnitude of the constant error of each component of the measured force [N].
        backlash_mm: Play between motor and cable: after a reversal the cable rests until it is taken up [mm].
        tendon_loss: Share of the cable load lost to friction before it is measured, unknown to the estimator.
        rigidity_ratio: Rigidity of the robot over its nominal value; it scales forces and leaves shapes unchanged.

    Raises:
        ValueError: If a range is not two numbers within bounds, the smaller one first.
    """

    latency: Range = checked((1, 4), check_range, whole=True, low=0, high=HISTORY - 1)
    noise_n: Range = checked((0.0005, 0.0015), check_range, low=0)
    bias_n: Range = checked((0.0, 0.003), check_range, low=0)
    backlash_mm: Range = checked((0.2, 0.6), check_range, low=0)
    tendon_loss: Range = checked((0.0, 0.3), check_range, low=0, high=0.9)
    rigidity_ratio: Range = checked((0.3, 3.0), check_range, low=SMALLEST)

    def __post_init__(self) -> None:
        check_fields(self)


class SensorModel:
    """Motors and sensors of many robots.

    Attributes:
        rigidity_ratio: Rigidity of each robot over its nominal value, ``(N,)``.
        measured_load_fraction: Fraction of each cable load that is measured, ``(N,)``.

    Args:
        sensing: Ranges to sample from.
        count: Number N of robots.
        space: Dimension d of the space.
        actions: The actuated coordinates.
        delayed: Which columns of an observation are delayed, ``(k,)`` bool.
    """

    def __init__(self, sensing: Sensing, count: int, space: int, actions: ActionSpec, delayed: np.ndarray) -> None:
        self._sensing, self._actions, self._delayed = sensing, actions, delayed
        self._has_backlash = np.arange(actions.size) < actions.cables  # cables have, the insertion has none
        self._latency = np.zeros(count, int)
        self._backlash_mm = np.zeros(count)
        self._noise = np.zeros((count, NOISE_STEPS, space))
        self._motor_mm = np.zeros((count, actions.size))
        self._history = np.zeros((count, HISTORY, delayed.size))
        self._history_empty = np.ones(count, bool)
        self.rigidity_ratio, self.measured_load_fraction = np.ones(count), np.ones(count)

    def begin_episode(self, robot: int, generator: np.random.Generator, motor_mm: np.ndarray) -> None:
        """Sample motors and sensors of a robot's next episode, which begins with the motors at these positions."""
        sensing, space = self._sensing, self._noise.shape[2]
        latency, backlash, loss, rigidity, noise, *biases = generator.random(5 + space).tolist()
        low, high = sensing.latency
        self._latency[robot] = low + int(latency * (high - low + 1))
        self._backlash_mm[robot] = _interpolate(sensing.backlash_mm, backlash)
        self.measured_load_fraction[robot] = 1 - _interpolate(sensing.tendon_loss, loss)
        self.rigidity_ratio[robot] = math.exp(_interpolate(tuple(map(math.log, sensing.rigidity_ratio)), rigidity))
        bias = [_interpolate(sensing.bias_n, abs(2 * part - 1)) * math.copysign(1, part - 0.5) for part in biases]
        white = generator.normal(size=(NOISE_STEPS, space))
        self._noise[robot] = bias + _interpolate(sensing.noise_n, noise) * white
        self._motor_mm[robot] = motor_mm
        self._history_empty[robot] = True

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
