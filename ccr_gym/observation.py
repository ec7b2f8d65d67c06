"""The observation: its entries, their scales and bounds, and its flat form, for one environment or many."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from gymnasium import spaces

from ccr_gym.adapters import AnyAdapter, Feature, Features
from ccr_gym.quantities import Quantity
from ccr_gym.randomization import DRAWN_SIZE
from ccr_gym.scales import AHEAD
from ccr_gym.sensing import DELAYED_KEYS
from ccr_gym.task import AnyTask

Observation = np.ndarray | dict[str, np.ndarray]
SENSOR_KEYS = ("force_error", "force_measured")  # absent without a force sensor
NOT_NEGATIVE = ("length", "desired_ahead", "contact", "share")
ENCODER_KEYS = ("cable", "length")  # what the encoders read, in the order of the actions


class Known(NamedTuple):
    """What the nominal model and the load cells at the motors tell of one robot, or of many.

    Attributes:
        contact: Contact flags of the model, ``(..., lines · positions)``.
        tensions: Measured tensions, ``(..., c)`` [N].
        free_forces: As of :class:`ccr_gym.estimation.ForceEstimator`, ``(..., commands)`` [N].
        levers: Likewise, ``(..., commands)``.
        share: Share of the model's contact forces that is on the regulated obstacle, 0 where nothing touches.
    """

    contact: np.ndarray
    tensions: np.ndarray
    free_forces: np.ndarray
    levers: np.ndarray
    share: Quantity


class Observer:
    """Writes observations as scaled float32 rows within the bounds of their space.

    Entries are features of the equilibrium block, or inputs: forces and obstacle features that are computed outside.

    Attributes:
        dict_space: Space of the named entries.
        flat_space: Space of their concatenation.
        delayed: Which columns are delayed by latency, ``(k,)`` bool.

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
        # A single number is written to a column, without an axis.
        self._input_columns = {
            key: self._columns[key] if size > 1 else self._columns[key].start
            for key, size in input_sizes.items()
            if key in keys
        }
        self._source, self._scale = np.zeros(self._low.size, int), np.zeros(self._low.size)
        for key in features.keys() & keys:
            if key not in input_sizes:
                self._source[self._columns[key]], self._scale[self._columns[key]] = features[key]
        self.delayed = np.zeros(self._low.size, bool)
        for key in DELAYED_KEYS:
            self.delayed[self._columns.get(key, slice(0))] = True
        self._force_n = adapter.settings.force_span * adapter.scales.force_n
        self._tension_n = adapter.settings.tension_span * adapter.scales.tension_n
        self._lever_scale = adapter.scales.travel_mm / adapter.scales.length_mm
        self._disturb_pose = adapter.disturb_pose
        most = np.maximum(np.abs(adapter.actions.low_mm), adapter.actions.high_mm)
        self._encoder_scale = 1 / most

    def rows(
        self, blocks: np.ndarray, forces: Mapping[str, Quantity], constants: Mapping[str, np.ndarray]
    ) -> np.ndarray:
        """Return flat observations before they are clipped, ``(k,)`` for one robot, ``(N, k)`` for many.

        Args:
            blocks: Equilibria, ``(size,)`` or ``(N, size)``.
            forces: Inputs that are forces, numbers or ``(..., d)`` [N].
            constants: Inputs that stay as they are in an episode, scaled already, ``(..., k)``.
        """
        one = blocks.ndim == 1
        rows = blocks.take(self._source) if one else blocks[:, self._source]
        rows *= self._scale
        for key, force in forces.items():
            columns = self._input_columns.get(key)
            if columns is not None:  # one row is written faster without an ellipsis
                rows[columns if one else (..., columns)] = force / self._force_n
        for key, features in constants.items():
            if (columns := self._input_columns.get(key)) is not None:
                rows[..., columns] = features
        return rows

    def write_encoders(self, rows: np.ndarray, motor_mm: np.ndarray) -> None:
        """Write what the encoders of the motors read, ``(..., actions)`` [mm]."""
        start, scaled = 0, motor_mm * self._encoder_scale
        for key in ENCODER_KEYS:
            if (columns := self._columns.get(key)) is not None:
                count = columns.stop - columns.start
                rows[..., columns] = scaled[..., start : start + count]
                start += count

    def write_sensed(self, rows: np.ndarray, known: Known, errors: np.ndarray) -> None:
        """Write what is known and measured where sensing is not ideal.

        Args:
            rows: Observations, ``(..., k)``, written in place.
            known: What the nominal model and the load cells at the motors tell.
            errors: Errors of the seen shape, ``(..., n + 1, d + turns)`` [mm, rad].
        """
        entries = self.entries(rows)
        entries["contact"][...] = known.contact
        entries["tension"][...] = known.tensions / self._tension_n
        entries["free_tension"][...] = known.free_forces / self._tension_n
        entries["lever"][...] = known.levers * self._lever_scale
        if "share" in entries:
            entries["share"][..., 0] = known.share
        self._disturb_pose(entries, errors)

    def clip(self, rows: np.ndarray) -> np.ndarray:
        """Return rows within the bounds of the space, as float32; overwrites the rows."""
        np.maximum(rows, self._low, out=rows)
        np.minimum(rows, self._high, out=rows)
        return rows.astype(np.float32)

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
