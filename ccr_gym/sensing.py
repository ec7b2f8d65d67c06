"""What stands between the robot and who controls it: motors with backlash, sensors with noise, bias and latency.

Every episode has its own, drawn by its environment's generator when it begins, the noise of all its steps included.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ccr_gym.checks import check_fields, check_range, checked
from solver.common.validation import SMALLEST

if TYPE_CHECKING:
    from ccr_gym.bodies import Body

Range = tuple[float, ...]
DELAYED = ("contact", "force_est", "force_error", "force_measured", "frames", "nodes")  # what comes late
HISTORY = 8  # rows kept, beyond the largest latency
NOISE_STEPS = 256  # after so many steps the noise of an episode repeats


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensing:
    """Ranges that every episode draws from.

    Attributes:
        latency: Whole steps after which everything but the cables and the set-point is seen.
        noise_n: Standard deviation of white noise on each component of the measured force [N].
        bias_n: Constant error of each component, in size [N].
        backlash_mm: Play between motor and cable: a reversal moves nothing until it is taken up [mm].
        tendon_loss: Share of the cable load that friction takes before it is measured, unknown to the estimate.
        rigidity_ratio: Rigidity of the robot over the one that is known; forces grow with it, shapes do not change.

    Raises:
        ValueError: If a range is not two numbers, descends, or goes beyond what is possible.
    """

    latency: tuple[int, ...] = checked((1, 4), check_range, whole=True, low=0, high=HISTORY - 1)
    noise_n: Range = checked((0.0005, 0.0015), check_range, low=0)
    bias_n: Range = checked((0.0, 0.003), check_range, low=0)
    backlash_mm: Range = checked((0.2, 0.6), check_range, low=0)
    tendon_loss: Range = checked((0.0, 0.3), check_range, low=0, high=0.9)
    rigidity_ratio: Range = checked((0.3, 3.0), check_range, low=SMALLEST)

    def __post_init__(self) -> None:
        check_fields(self)


class SensorModel:
    """The motors and sensors of many robots.

    Attributes:
        rigidity_ratio: Rigidity of each robot over the one that is known, ``(N,)``.
        grip: Share of each cable load that is measured, ``(N,)``.

    Args:
        sensing: Ranges to draw from.
        count: Number N of robots.
        body: Their model.
        delayed: Which numbers of an observation come late, ``(columns,)`` bool.
    """

    def __init__(self, sensing: Sensing, count: int, body: "Body", delayed: np.ndarray) -> None:
        self._sensing, self._delayed = sensing, delayed
        self._geared = np.arange(body.actions) < body.model.cables  # has play; the insertion has none
        self._latency = np.zeros(count, int)
        self._play = np.zeros(count)
        self._noise = np.zeros((count, NOISE_STEPS, body.model.space))
        self._motors = np.zeros((count, body.actions))
        self._rows = np.zeros((count, HISTORY, delayed.size))
        self._fresh = np.ones(count, bool)
        self.rigidity_ratio, self.measured_load_fraction = np.ones(count), np.ones(count)

    def begin(self, robot: int, generator: np.random.Generator, motors: Any) -> None:
        """Draw the motors and sensors of an episode, which starts with the motors at these places."""
        sensing, space = self._sensing, self._noise.shape[2]
        latency, play, loss, rigidity_ratio, noise, *biases = generator.random(5 + space).tolist()
        low, high = sensing.latency
        self._latency[robot] = low + int(latency * (high - low + 1))
        self._play[robot] = _between(sensing.backlash_mm, play)
        self.measured_load_fraction[robot] = 1 - _between(sensing.tendon_loss, loss)
        self.rigidity_ratio[robot] = math.exp(_between(tuple(map(math.log, sensing.rigidity_ratio)), rigidity_ratio))
        bias = [_between(sensing.bias_n, abs(2 * part - 1)) * math.copysign(1, part - 0.5) for part in biases]
        white = generator.normal(size=(NOISE_STEPS, space))
        self._noise[robot] = bias + _between(sensing.noise_n, noise) * white
        self._motors[robot] = motors
        self._fresh[robot] = True

    def drive(self, places: Any, increments: Any, bounds: tuple[np.ndarray, np.ndarray], which: Any) -> Any:
        """Move motors by increments, within bounds; returns where that leaves what they move [mm].

        Args:
            places: Where that is, ``(..., actions)``, or ``(...,)`` for one [mm].
            increments: Of the motors, likewise [mm].
            bounds: Least and largest place, ``(actions,)`` each [mm].
            which: Which robots.
        """
        low, high = bounds
        motors = self._motors[which]
        motors = np.minimum(np.maximum(motors + np.reshape(increments, motors.shape), low), high)
        self._motors[which] = motors
        slack = self.slack(which)
        moved = np.minimum(np.maximum(np.reshape(places, motors.shape), motors - slack), motors + slack)
        return np.reshape(np.minimum(np.maximum(moved, low), high), np.shape(places))

    def motors(self, which: Any) -> np.ndarray:
        """Places of the motors, which is what their encoders tell, ``(..., actions)`` [mm]."""
        return np.asarray(self._motors[which])

    def slack(self, which: Any) -> np.ndarray:
        """How far the motors can be from what they move, ``(..., actions)`` [mm]."""
        return np.asarray(np.asarray(self._play[which])[..., None] / 2 * self._geared)

    def noise(self, time: np.ndarray, which: Any) -> np.ndarray:
        """Error of the measured force at a step, ``(..., d)`` [N]."""
        return np.asarray(self._noise[np.arange(len(time))[which], time[which] % NOISE_STEPS])

    def late(self, rows: np.ndarray, time: np.ndarray, which: Any) -> np.ndarray:
        """What is seen at a step where some of it comes late, ``(..., columns)``; at first, what was at first."""
        robots = np.atleast_1d(np.arange(len(time))[which])
        now, new, fresh = time[robots], rows.reshape(len(robots), -1), self._fresh[robots]
        self._rows[robots[fresh]] = new[fresh, None]
        self._fresh[robots] = False
        self._rows[robots, now % HISTORY] = new
        before = self._rows[robots, (now - self._latency[robots]) % HISTORY]
        return np.where(self._delayed, before, new).reshape(rows.shape)


def _between(ends: Range, part: float) -> float:
    low, high = ends
    return low + part * (high - low)
