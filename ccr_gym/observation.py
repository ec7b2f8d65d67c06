"""The observation: its entries, their scales and bounds; the kernel writes its flat form."""

from collections.abc import Set

import numpy as np
from gymnasium import spaces

from ccr_gym.adapters import AnyAdapter, Feature, Features
from ccr_gym.randomization import DRAWN_SIZE
from ccr_gym.scales import AHEAD
from ccr_gym.sensing import DELAYED_KEYS
from ccr_gym.task import AnyTask
from solver.common.transition import ObserverSettings

Observation = np.ndarray | dict[str, np.ndarray]
SENSOR_KEYS = ("force_error", "force_measured")  # absent without a force sensor
NOT_NEGATIVE = ("length", "desired_ahead", "contact", "share")
ENCODER_KEYS = ("cable", "length")  # what the encoders read, in the order of the actions
POSE_KEYS = ("nodes", "frames")  # what a camera or a fibre shows


class Observer:
    """Columns of observations, which are scaled float32 rows within the bounds of their space.

    Entries are features of the equilibrium block, or inputs: forces and obstacle features that are computed outside.

    Attributes:
        dict_space: Space of the named entries.
        flat_space: Space of their concatenation.
        delayed: Which columns are delayed by latency, ``(k,)`` bool.
        kernel_settings: What the kernel writes them by.

    Args:
        adapter: Adapter of the robot.
        task: What an episode asks.
    """

    def __init__(self, adapter: AnyAdapter, task: AnyTask) -> None:
        features, input_sizes = _features(adapter, task), _input_sizes(adapter, task)
        sizes = {key: feature.columns.size for key, feature in features.items()} | input_sizes
        keys = [key for key in sorted(sizes) if adapter.settings.senses_force or key not in SENSOR_KEYS]
        boxes: dict[str, spaces.Space[np.ndarray]] = {
            key: _box(_lowest(key, sizes[key], adapter), sizes[key]) for key in keys
        }
        self.dict_space = spaces.Dict(boxes)
        self._low, self._high = (np.concatenate([getattr(b, end) for b in boxes.values()]) for end in ("low", "high"))
        self.flat_space = spaces.Box(self._low, self._high)
        ends = np.cumsum([sizes[key] for key in keys]).tolist()
        self._columns = {key: slice(end - sizes[key], end) for key, end in zip(keys, ends, strict=True)}
        self._source, self._scale = np.zeros(self._low.size, int), np.zeros(self._low.size)
        for key in features.keys() & keys:
            if key not in input_sizes:
                self._source[self._columns[key]], self._scale[self._columns[key]] = features[key]
        self._force_n = adapter.settings.force_span * adapter.scales.force_n
        self.delayed = np.zeros(self.columns, bool)
        for key in DELAYED_KEYS:
            self.delayed[self._columns.get(key, slice(0))] = True
        self.kernel_settings = self._make_settings(adapter, input_sizes.keys() & keys)

    @property
    def columns(self) -> int:
        """Numbers of an observation."""
        return int(self._low.size)

    def _make_settings(self, adapter: AnyAdapter, inputs: Set[str]) -> ObserverSettings:
        """Return what the kernel writes observations by."""
        scales = adapter.scales
        spans = {key: (columns.start, columns.stop - columns.start) for key, columns in self._columns.items()}
        most = np.maximum(np.abs(adapter.actions.low_mm), adapter.actions.high_mm)
        written = {*inputs, *POSE_KEYS, *(("contact",) if adapter.settings.sensors else ())}
        return ObserverSettings(
            source=self._source.tolist(),
            factor=self._scale,
            low=self._low.astype(float),
            high=self._high.astype(float),
            delayed=self.delayed,
            entries={key: spans[key] for key in written if key in spans and key not in ENCODER_KEYS},
            encoders=[spans[key] for key in ENCODER_KEYS if key in spans],
            encoder_factor=1 / most,
            pose_factor=adapter.pose_scale,
            ahead=AHEAD,
            force_n=self._force_n,
            tension_n=adapter.settings.tension_span * scales.tension_n,
            lever_unit=scales.length_mm / scales.travel_mm,
        )

    @property
    def slices(self) -> dict[str, slice]:
        """Columns of the named entries."""
        return dict(self._columns)

    def as_goal(self, forces: np.ndarray) -> np.ndarray:
        """Return forces [N] as goals within the bounds of their space, float32."""
        return np.asarray(np.clip(forces / self._force_n, -1.0, 1.0), np.float32)

    def entries(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """Return the named entries of flat observations ``(..., k)``, as views."""
        return {key: rows[..., columns] for key, columns in self._columns.items()}


def _features(adapter: AnyAdapter, task: AnyTask) -> Features:
    """Return the entries that are read from the equilibrium block."""
    layout, columns = adapter.layout, np.arange(adapter.layout.size)
    force = adapter.force(columns, task.target)
    return {
        "contact": Feature(layout.flags(columns), 1.0),
        "force_measured": Feature(force, 1 / (adapter.settings.force_span * adapter.scales.force_n)),
        **adapter.pose_features(),
    }


def _input_sizes(adapter: AnyAdapter, task: AnyTask) -> dict[str, int]:
    """Return the sizes of the entries that are computed outside of the equilibrium block."""
    set_point = adapter.space if task.force_vector else 1
    sizes = {"desired_force": set_point, "force_error": set_point, "force_est": adapter.space}
    sizes["cable"] = adapter.actions.commands
    if adapter.actions.size > adapter.actions.commands:
        sizes["length"] = 1
    if task.moving:
        sizes["desired_ahead"] = len(AHEAD)
    if adapter.settings.sensors or adapter.settings.regulate == "estimate":
        sizes["force_measured"] = adapter.space  # with noise or estimated, so not the block's
    if adapter.settings.sensors:
        sizes["tension"] = len(adapter.settings.robot.cables)
        sizes["free_tension"] = sizes["lever"] = adapter.actions.commands
        if task.target is not None:
            sizes["share"] = 1
    if adapter.obstacle_size:
        sizes["obstacle"] = adapter.obstacle_size
    if adapter.settings.randomize and adapter.settings.randomize.observed:
        sizes["robot"] = DRAWN_SIZE
    return sizes


def _lowest(key: str, size: int, adapter: AnyAdapter) -> float:
    """Return the lower bound of an entry: 0 for what cannot be negative, otherwise −1."""
    not_negative = key in NOT_NEGATIVE or (key == "cable" and (adapter.actuation.low >= 0).all())
    return 0.0 if not_negative or (key == "desired_force" and size == 1) else -1.0


def _box(low: float, size: int) -> spaces.Box:
    return spaces.Box(np.full(size, low, np.float32), np.ones(size, np.float32))
