"""The observation: what is seen, how it is scaled, and its flat form. All of it for one environment or many."""

from typing import Any

import numpy as np
from gymnasium import spaces

from solver import Robot
from solver.layout import CABLE, Layout

FORCE_SCALE_N = 0.5  # force that an observation of 1 stands for
SENSOR_KEYS = ("force_error", "force_measured")  # seen with a force sensor only


def dict_space(robot: Robot, force_sensor: bool) -> spaces.Dict:
    """The dictionary of what is seen; keys stand in the alphabetical order of the flat form."""
    nodes = robot.segments + 1
    entries: dict[str, spaces.Space[np.ndarray]] = {
        "cable": _box(0, (1,)),
        "contact": _box(0, (len(robot.touch) * robot.positions,)),
        "desired_force": _box(0, (1,)),
        "force_error": _box(-1, (1,)),
        "force_est": _box(-1, (2,)),
        "force_measured": _box(-1, (2,)),
        "nodes": _box(-1, (3 * nodes,)),
    }
    return spaces.Dict({key: entry for key, entry in entries.items() if force_sensor or key not in SENSOR_KEYS})


class Observer:
    """Writes what is seen as scaled float32 rows within the bounds of their space.

    Args:
        robot: The robot.
        layout: Where its numbers stand in a block.
        force_sensor: Whether the measured force is seen.
        cable_limit_mm: Full scale of the cable displacement [mm].
    """

    def __init__(self, robot: Robot, layout: Layout, force_sensor: bool, cable_limit_mm: float) -> None:
        self.dict_space = dict_space(robot, force_sensor)
        boxes = [box for box in self.dict_space.values() if isinstance(box, spaces.Box)]
        self._low, self._high = (np.concatenate([getattr(box, end) for box in boxes]) for end in ("low", "high"))
        self.flat_space = spaces.Box(self._low, self._high)
        ends = np.cumsum([box.shape[0] for box in boxes]).tolist()
        self._places = {
            key: slice(end - box.shape[0], end) for key, box, end in zip(self.dict_space, boxes, ends, strict=True)
        }
        numbers = np.arange(layout.size)
        pose_scale = 1 / np.array([robot.lengths_mm[1], robot.lengths_mm[1], np.pi])
        seen: dict[str, tuple[np.ndarray, np.ndarray | float]] = {  # what is a number of the block, and its scale
            "cable": (numbers[[CABLE]], 1 / cable_limit_mm),
            "contact": (layout.flags(numbers), 1.0),
            "force_measured": (layout.force(numbers), 1 / FORCE_SCALE_N),
            "nodes": (layout.nodes(numbers).ravel(), np.tile(pose_scale, robot.segments + 1)),
        }
        self._source, self._scale = np.zeros(self._low.size, int), np.zeros(self._low.size)
        for key, (source, scale) in seen.items():
            if key in self._places:
                self._source[self._places[key]], self._scale[self._places[key]] = source, scale
        self._force_sensor = force_sensor

    def flat(self, blocks: np.ndarray, force: Any, force_est: np.ndarray, desired: Any) -> np.ndarray:
        """The flat form of one robot, ``(k,)`` float32, or of many, ``(N, k)``.

        Args:
            blocks: Equilibrium, ``(size,)`` or ``(N, size)``.
            force: Magnitude of the measured force [N].
            force_est: Estimated force on the robot, ``(..., 2)`` [N].
            desired: Set-point [N].
        """
        rows, at = blocks[:, self._source] if blocks.ndim > 1 else blocks.take(self._source), self._places
        rows *= self._scale
        rows[..., at["desired_force"].start] = desired / FORCE_SCALE_N
        rows[..., at["force_est"]] = force_est / FORCE_SCALE_N
        if self._force_sensor:
            rows[..., at["force_error"].start] = (desired - force) / FORCE_SCALE_N
        np.maximum(rows, self._low, out=rows)
        np.minimum(rows, self._high, out=rows)
        return rows.astype(np.float32)

    def entries(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """The dictionary form of flat rows ``(..., k)``, as views."""
        return {key: rows[..., place] for key, place in self._places.items()}


def _box(low: float, shape: tuple[int, ...]) -> spaces.Box:
    return spaces.Box(np.full(shape, low, np.float32), np.ones(shape, np.float32))
