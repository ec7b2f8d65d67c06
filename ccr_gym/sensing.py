"""The imperfections between robot and agent: motors with backlash, sensors with noise, errors and latency.

Every episode samples its own when it begins, from the generator of its environment. Sizes are multiples of the robot's
natural units (:class:`ccr_gym.scales.Scales`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ccr_gym.actions import ActionSpec
from ccr_gym.checks import check_fields, check_range, checked
from ccr_gym.noise import correlated, draw_start
from ccr_gym.scales import Scales
from ccr_gym.state import Arrays, put, take
from solver.common.rows import as_slice
from solver.common.validation import SMALLEST

Range = tuple[float, ...]
DELAYED_KEYS = ("force_error", "force_measured", "frames", "nodes")  # what a camera and a force sensor tell
HISTORY = 8  # observations kept, as in the kernel; more than the largest latency
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
)  # of Imperfections, that are single numbers, in the kernel's order
LATENCY, RIGIDITY, START = map(NUMBERS.index, ("latency", "rigidity_ratio", "start"))
SIGNED = "tension_zero", "force_bias"  # several numbers of an episode, of either sign, whose magnitudes are in a range


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
    """The imperfections of k episodes; those of :class:`Sensing`, in the units of the robot.

    Attributes:
        numbers: Those of :data:`NUMBERS`, ``(k, 8)``.
        tension_zero: Constant errors of the measured tensions, ``(k, c)`` [N].
        force_bias: Constant errors of the measured forces, ``(k, d)`` [N].
        pose_noise: Standard deviations of places and turns of a disk, ``(k, d + turns)`` [mm, rad].
        pose_error: Constant errors of places and turns of all disks, ``(k, n + 1, d + turns)`` [mm, rad].
    """

    numbers: np.ndarray
    tension_zero: np.ndarray
    force_bias: np.ndarray
    pose_noise: np.ndarray
    pose_error: np.ndarray

    def number(self, name: str) -> np.ndarray:
        """Return one of the numbers of each episode, ``(k,)``."""
        return self.numbers[:, NUMBERS.index(name)]


class ImperfectionSampler:
    """Samples the imperfections of episodes.

    Args:
        sensing: Ranges to sample from.
        scales: Natural units of the robot.
        body: Sizes of what is sensed.
    """

    def __init__(self, sensing: Sensing, scales: Scales, body: Body) -> None:
        self._body, (self._least, most) = body, map(int, sensing.latency)
        length, tension, force = scales.length_mm, scales.tension_n, scales.force_n
        logarithms = tuple(map(math.log, sensing.rigidity_ratio))
        drawn: dict[str, tuple[Range, float, int]] = {  # in the order of the draws: range, unit, and how many
            "latency": ((0.0, float(most - self._least + 1)), 1.0, 1),
            "backlash_mm": (sensing.backlash, scales.travel_mm, 1),
            "rigidity_ratio": (logarithms, 1.0, 1),
            "tendon_loss": (sensing.tendon_loss, 1.0, 1),
            "tension_noise": (sensing.tension_noise, tension, 1),
            "tension_zero": (sensing.tension_zero, tension, body.cables),
            "force_noise": (sensing.force_noise, force, 1),
            "force_bias": (sensing.force_bias, force, body.space),
            "force_resolution": (sensing.force_resolution, force, 1),
            "place_noise": (sensing.place_noise, length, 1),
            "angle_noise": (sensing.angle_noise, 1.0, 1),
            "place_error": (sensing.place_error, length, 1),
            "angle_error": (sensing.angle_error, 1.0, 1),
        }
        ranges, units, counts = zip(*drawn.values(), strict=True)
        low, high = np.repeat(np.array(ranges, float), counts, axis=0).T
        self._low, self._spans, self._units = low, high - low, np.repeat(units, counts)
        names = np.repeat(list(drawn), counts).tolist()
        self._signed = np.array([name in SIGNED for name in names])
        self._columns = {name: np.flatnonzero(np.array(names) == name) for name in SIGNED}
        self._columns["numbers"] = np.array([names.index(name) for name in NUMBERS[:-1]])
        for kind in ("noise", "error"):
            place, angle = names.index(f"place_{kind}"), names.index(f"angle_{kind}")
            self._columns[f"pose_{kind}"] = np.array([place] * body.space + [angle] * body.turns)

    def sample(self, generators: Sequence[np.random.Generator]) -> Imperfections:
        """Return the imperfections of episodes, each sampled by a generator of its own."""
        body, values = self._body, self._spread([generator.random(len(self._low)) for generator in generators])
        parts = {name: values[:, columns] for name, columns in self._columns.items()}
        errors = correlated(generators, body.nodes, body.space + body.turns)
        errors *= parts["pose_error"][:, None]
        errors[:, 0] = 0.0  # the base is clamped where everybody knows it
        numbers = np.empty((len(values), len(NUMBERS)))
        numbers[:, :-1] = parts.pop("numbers")
        numbers[:, LATENCY] = np.floor(numbers[:, LATENCY]) + self._least
        numbers[:, RIGIDITY] = list(map(math.exp, numbers[:, RIGIDITY].tolist()))
        numbers[:, START] = list(map(draw_start, generators))
        return Imperfections(numbers, **parts | {"pose_error": errors})

    def _spread(self, drawn: list[np.ndarray]) -> np.ndarray:
        """Return numbers in their ranges from numbers between 0 and 1, ``(k, draws)``."""
        parts = np.array(drawn)
        signs = 2 * parts - 1
        values = self._low + np.where(self._signed, np.abs(signs), parts) * self._spans
        return np.asarray(np.where(self._signed, np.copysign(values, signs), values) * self._units)


class SensorModel:
    """Motors and sensors of many robots; the kernel moves and reads them (``solver/native/transition/sensors.hpp``).

    Attributes:
        arrays: Their state, by name.

    Args:
        count: Number N of robots.
        body: Sizes of what is sensed.
        actions: The actuated coordinates.
        columns: Numbers of an observation.
    """

    def __init__(self, count: int, body: Body, actions: ActionSpec, columns: int) -> None:
        self._has_backlash = np.arange(actions.size) < actions.commands  # cables have, the insertion has none
        self.arrays: Arrays = {
            "numbers": np.zeros((count, len(NUMBERS))),
            "motor_mm": np.zeros((count, actions.size)),
            "moved_in": np.ones((count, body.cables), bool),
            "tension_zero": np.zeros((count, body.cables)),
            "force_bias": np.zeros((count, body.space)),
            "pose_noise": np.zeros((count, body.space + body.turns)),
            "pose_error": np.zeros((count, body.nodes, body.space + body.turns)),
            "history": np.zeros((count, HISTORY, columns)),
            "history_empty": np.ones(count, bool),
        }
        self._column("rigidity_ratio")[:] = 1.0

    @property
    def rigidity_ratio(self) -> np.ndarray:
        """Rigidity of each robot over its nominal value, ``(N,)``."""
        return self._column("rigidity_ratio")

    @property
    def tendon_loss(self) -> np.ndarray:
        """Share of the tension that friction takes, ``(N,)``."""
        return self._column("tendon_loss")

    @property
    def latency(self) -> np.ndarray:
        """Delay of shape and force sensor, ``(N,)`` [steps]."""
        return self._column("latency").astype(int)

    @property
    def motor_mm(self) -> np.ndarray:
        """Motor positions, as encoders read them, ``(N, actions)`` [mm]."""
        return self.arrays["motor_mm"]

    @property
    def half_backlash_mm(self) -> np.ndarray:
        """How far motors and actuated coordinates can be apart, ``(N, actions)`` [mm]."""
        return self._column("backlash_mm")[:, None] / 2 * self._has_backlash

    def _column(self, name: str) -> np.ndarray:
        return self.arrays["numbers"][:, NUMBERS.index(name)]

    def begin_episodes(self, robots: list[int], sampled: Imperfections, motor_mm: np.ndarray) -> None:
        """Begin the next episodes of some robots, with the motors at positions ``(k, actions)``."""
        at = as_slice(robots)
        for name, rows in zip(Imperfections._fields, sampled, strict=True):
            self.arrays[name][at] = rows
        self.arrays["motor_mm"][at] = motor_mm
        self.arrays["moved_in"][at] = self.arrays["history_empty"][at] = True

    def get_rows(self, robots: list[int]) -> Arrays:
        """Return the state of some robots."""
        return take(self.arrays, list(self.arrays), robots)

    def set_rows(self, robots: list[int], rows: Arrays) -> None:
        """Put robots into a state of :meth:`get_rows`."""
        put(self.arrays, rows, robots)
