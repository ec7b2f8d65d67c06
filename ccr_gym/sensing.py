"""The imperfections between robot and agent: motors with backlash, sensors with noise, errors and latency.

Every episode samples its own when it begins, from the generator of its environment. Sizes are multiples of the robot's
natural units (:class:`ccr_gym.scales.Scales`).
"""

import math
from dataclasses import dataclass
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from ccr_gym.actions import ActionSpec
from ccr_gym.checks import check_fields, check_range, checked
from ccr_gym.noise import correlated, draw_start, white
from ccr_gym.quantities import EnvIndex
from ccr_gym.scales import Scales
from ccr_gym.state import Arrays, put, take
from solver import Transmission
from solver.common.validation import SMALLEST

Range = tuple[float, ...]
DELAYED_KEYS = ("force_error", "force_measured", "frames", "nodes")  # what a camera and a force sensor tell
HISTORY = 8  # observations kept, more than the largest latency
MAX_LOSS, MAX_SIZE = 0.9, 1e6  # largest share of friction; largest play, noise or error [natural units]
DEGREE = math.pi / 180
NUMBERS = (
    "latency",
    "backlash_mm",
    "tendon_loss",
    "rigidity_ratio",
    "tension_noise",
    "force_noise",
    "force_resolution",
    "start",
)  # of Imperfections, that are single numbers
NUMBERS_OF = attrgetter(*NUMBERS)
EPISODE = np.dtype([(name, int if name in ("latency", "start") else float) for name in NUMBERS])
STATE = (
    "_numbers",
    "_motor_mm",
    "_moved_in",
    "_tension_zero",
    "_force_bias",
    "_pose_noise",
    "_pose_error",
    "_history",
    "_history_empty",
)  # arrays of a SensorModel


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensing:
    """Ranges of the imperfections, which every episode samples from; ``docs/sensing.md`` has formulas and sources.

    Attributes:
        latency: Delay of the shape and of the force sensor [steps].
        backlash: Play between motor and cable: after a reversal the cable rests until it is taken up [a].
        rigidity_ratio: Rigidity of the robot over its nominal value; it scales forces and leaves shapes unchanged.
        tendon_loss: Share of the tension that friction takes between motor and robot, against the motion, as in
            :class:`solver.Transmission`.
        tension_noise: Standard deviation of white noise on the measured tensions [EI/(aL)].
        tension_zero: Magnitude of the constant error of each measured tension [EI/(aL)].
        force_noise: Standard deviation of white noise on each component of the measured force [EI/L²].
        force_bias: Magnitude of the constant error of each component of the measured force [EI/L²].
        force_resolution: What the measured force is a multiple of, component by component; 0 for no steps [EI/L²].
        angle_noise: Standard deviation of white noise on the angle of each disk [rad].
        angle_error: Standard deviation of its constant error, correlated along the robot [rad].
        place_noise: Standard deviation of white noise on the place of each disk, per axis [L].
        place_error: Standard deviation of its constant error, correlated along the robot [L].

    Raises:
        ValueError: If a range is not two numbers within bounds, the smaller one first.
    """

    latency: Range = checked((1, 4), check_range, whole=True, low=0, high=HISTORY - 1)
    backlash: Range = checked((0.025, 0.075), check_range, low=0, high=MAX_SIZE)
    rigidity_ratio: Range = checked((0.3, 3.0), check_range, low=SMALLEST)
    tendon_loss: Range = checked((0.0, 0.3), check_range, low=0, high=MAX_LOSS)
    tension_noise: Range = checked((0.006, 0.015), check_range, low=0, high=MAX_SIZE)
    tension_zero: Range = checked((0.0, 0.03), check_range, low=0, high=MAX_SIZE)
    force_noise: Range = checked((0.065, 0.26), check_range, low=0, high=MAX_SIZE)
    force_bias: Range = checked((0.0, 0.4), check_range, low=0, high=MAX_SIZE)
    force_resolution: Range = checked((0.0, 0.13), check_range, low=0, high=MAX_SIZE)
    angle_noise: Range = checked((0.6 * DEGREE, 0.6 * DEGREE), check_range, low=0, high=1)
    angle_error: Range = checked((0.5 * DEGREE, 0.5 * DEGREE), check_range, low=0, high=1)
    place_noise: Range = checked((0.002, 0.002), check_range, low=0, high=1)
    place_error: Range = checked((0.002, 0.002), check_range, low=0, high=1)

    def __post_init__(self) -> None:
        check_fields(self)


NONE = (0.0, 0.0)
EXACT = Sensing(
    latency=(0, 0),
    backlash=NONE,
    rigidity_ratio=(1, 1),
    tendon_loss=NONE,
    tension_noise=NONE,
    tension_zero=NONE,
    force_noise=NONE,
    force_bias=NONE,
    force_resolution=NONE,
    angle_noise=NONE,
    angle_error=NONE,
    place_noise=NONE,
    place_error=NONE,
)


class Body(NamedTuple):
    """Sizes of what is sensed of a robot.

    Attributes:
        space: Dimension d of the space.
        cables: Number of cables c.
        nodes: Number of nodes n + 1.
        turns: Numbers that turn a disk, 1 in the plane and 3 in space.
    """

    space: int
    cables: int
    nodes: int
    turns: int


class Imperfections(NamedTuple):
    """The imperfections of one episode; those of :class:`Sensing`, in the units of the robot.

    Attributes:
        latency: Delay [steps].
        backlash_mm: Play between motors and cables [mm].
        rigidity_ratio: Rigidity over its nominal value.
        tendon_loss: Share of the tension that is lost.
        tension_noise: Standard deviation of the measured tensions [N].
        tension_zero: Constant errors of the measured tensions, ``(c,)`` [N].
        force_noise: Standard deviation of the measured force [N].
        force_bias: Constant error of the measured force, ``(d,)`` [N].
        force_resolution: What the measured force is a multiple of [N].
        pose_noise: Standard deviations of places and turns of a disk, ``(d + turns,)`` [mm, rad].
        pose_error: Constant errors of places and turns of all disks, ``(n + 1, d + turns)`` [mm, rad].
        start: Where the white noise begins.
    """

    latency: int
    backlash_mm: float
    rigidity_ratio: float
    tendon_loss: float
    tension_noise: float
    tension_zero: np.ndarray
    force_noise: float
    force_bias: np.ndarray
    force_resolution: float
    pose_noise: np.ndarray
    pose_error: np.ndarray
    start: int


def sample_imperfections(sensing: Sensing, scales: Scales, body: Body, generator: np.random.Generator) -> Imperfections:
    """Return the imperfections of an episode.

    Args:
        sensing: Ranges to sample from.
        scales: Natural units of the robot.
        body: Sizes of what is sensed.
        generator: Generator of the environment.
    """
    draws, length, tension, force = (
        _Draws(generator, 11 + body.cables + body.space),
        scales.length_mm,
        scales.tension_n,
        scales.force_n,
    )
    low, high = map(int, sensing.latency)
    imperfections = Imperfections(
        latency=draws.whole(low, high),
        backlash_mm=draws.between(sensing.backlash) * scales.travel_mm,
        rigidity_ratio=math.exp(draws.between(tuple(map(math.log, sensing.rigidity_ratio)))),
        tendon_loss=draws.between(sensing.tendon_loss),
        tension_noise=draws.between(sensing.tension_noise) * tension,
        tension_zero=draws.signed(sensing.tension_zero, body.cables) * tension,
        force_noise=draws.between(sensing.force_noise) * force,
        force_bias=draws.signed(sensing.force_bias, body.space) * force,
        force_resolution=draws.between(sensing.force_resolution) * force,
        pose_noise=_pose_sizes(draws.between(sensing.place_noise) * length, draws.between(sensing.angle_noise), body),
        pose_error=_pose_sizes(draws.between(sensing.place_error) * length, draws.between(sensing.angle_error), body)
        * correlated(generator, body.nodes, body.space + body.turns),
        start=draw_start(generator),
    )
    imperfections.pose_error[0] = 0.0  # the base is clamped where everybody knows it
    return imperfections


class _Draws:
    """Numbers from ranges, all drawn in one call of a generator."""

    def __init__(self, generator: np.random.Generator, count: int) -> None:
        self._parts = iter(generator.random(count).tolist())

    def whole(self, low: int, high: int) -> int:
        return low + int(next(self._parts) * (high - low + 1))

    def between(self, ends: Range) -> float:
        low, high = ends
        return float(low + next(self._parts) * (high - low))

    def signed(self, ends: Range, count: int) -> np.ndarray:
        """Return numbers of either sign whose magnitudes are from a range."""
        sides = np.array([2 * next(self._parts) - 1 for _ in range(count)])
        return np.asarray(np.copysign(ends[0] + np.abs(sides) * (ends[1] - ends[0]), sides))


def _pose_sizes(place_mm: float, angle: float, body: Body) -> np.ndarray:
    """Return the sizes of the errors of a disk's place and turns, ``(d + turns,)`` [mm, rad]."""
    return np.array([place_mm] * body.space + [angle] * body.turns)


class SensorModel:
    """Motors and sensors of many robots.

    Args:
        count: Number N of robots.
        body: Sizes of what is sensed.
        actions: The actuated coordinates.
        delayed: Which columns of an observation are delayed, ``(k,)`` bool.
    """

    def __init__(self, count: int, body: Body, actions: ActionSpec, delayed: np.ndarray) -> None:
        self._actions, self._delayed, self._body = actions, delayed, body
        self._has_backlash = np.arange(actions.size) < actions.commands  # cables have, the insertion has none
        self._numbers = np.zeros(count, EPISODE)
        self._numbers["rigidity_ratio"] = 1.0
        self._motor_mm, self._moved_in = np.zeros((count, actions.size)), np.ones((count, body.cables), bool)
        self._tension_zero, self._force_bias = np.zeros((count, body.cables)), np.zeros((count, body.space))
        self._pose_noise = np.zeros((count, body.space + body.turns))
        self._pose_error = np.zeros((count, body.nodes, body.space + body.turns))
        self._white = body.cables + body.space + (body.nodes - 1) * (body.space + body.turns)  # numbers of a step
        self._history = np.zeros((count, HISTORY, delayed.size))
        self._history_empty = np.ones(count, bool)

    @property
    def rigidity_ratio(self) -> np.ndarray:
        """Rigidity of each robot over its nominal value, ``(N,)``."""
        return self._numbers["rigidity_ratio"]

    @property
    def tendon_loss(self) -> np.ndarray:
        """Share of the tension that friction takes, ``(N,)``."""
        return self._numbers["tendon_loss"]

    @property
    def latency(self) -> np.ndarray:
        """Delay of shape and force sensor, ``(N,)`` [steps]."""
        return self._numbers["latency"]

    def begin_episode(self, robot: int, sampled: Imperfections, motor_mm: np.ndarray) -> None:
        """Begin a robot's next episode, with the motors at these positions."""
        self._numbers[robot] = NUMBERS_OF(sampled)
        self._tension_zero[robot], self._force_bias[robot] = sampled.tension_zero, sampled.force_bias
        self._pose_noise[robot], self._pose_error[robot] = sampled.pose_noise, sampled.pose_error
        self._motor_mm[robot], self._moved_in[robot], self._history_empty[robot] = motor_mm, True, True

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
        return Transmission(np.asarray(self.tendon_loss[index]), self._moved_in[index])

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
        return np.asarray(np.asarray(self._numbers["backlash_mm"][index])[..., None] / 2 * self._has_backlash)

    def measured_tensions(self, tensions: np.ndarray, time: np.ndarray, index: EnvIndex) -> np.ndarray:
        """Return what load cells at the motors read for nominal tensions in the robot, ``(..., c)`` [N]."""
        noise = self._noise(time, index, 0, self._body.cables) * self._numbers["tension_noise"][index][..., None]
        return np.asarray(self.motor_tensions(tensions, index) + self._tension_zero[index] + noise)

    def measured_force(self, force: np.ndarray, time: np.ndarray, index: EnvIndex) -> np.ndarray:
        """Return what the force sensor reads for forces ``(..., d)`` [N]: bias, noise, then steps of its resolution."""
        noise = (
            self._noise(time, index, self._body.cables, self._body.space)
            * self._numbers["force_noise"][index][..., None]
        )
        read = force + self._force_bias[index] + noise
        step = self._numbers["force_resolution"][index][..., None]
        return np.asarray(np.where(step > 0, np.round(read / np.where(step > 0, step, 1.0)) * step, read))

    def pose_errors(self, time: np.ndarray, index: EnvIndex) -> np.ndarray:
        """Return errors of the seen places and turns of all disks, ``(..., n + 1, d + turns)`` [mm, rad]."""
        errors = self._pose_error[index].copy()
        moving = errors[..., 1:, :]
        first = self._body.cables + self._body.space
        noise = self._noise(time, index, first, self._white - first).reshape(moving.shape)
        moving += noise * self._pose_noise[index][..., None, :]
        return np.asarray(errors)

    def _noise(self, time: np.ndarray, index: EnvIndex, first: int, count: int) -> np.ndarray:
        """Return some of the white noise of a step, of unit variance, ``(..., count)``."""
        return white(np.asarray(self._numbers["start"][index] + time[index] * self._white + first), count)

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
        earlier = self._history[robots, (now - self.latency[robots]) % HISTORY]
        return np.where(self._delayed, earlier, present).reshape(rows.shape)
