"""The observation: what is seen, how it is scaled, and its flat form. All of it for one environment or many."""

from typing import Any

import numpy as np
from gymnasium import spaces

from ccr_gym.bodies import Body, Seen
from ccr_gym.sensing import DELAYED
from ccr_gym.settings import Settings
from solver.common.layout import Layout

FORCE_SCALE_N = 0.5  # force that an observation of 1 stands for
AHEAD = (2, 4, 8)  # steps that a moving set-point is seen ahead
SENSOR_KEYS = ("force_error", "force_measured")  # seen with a force sensor only


class Observer:
    """Writes what is seen as scaled float32 rows within the bounds of their space.

    Args:
        body: The model of the robot.
        settings: What the environment was told.
        layout: Where the numbers of an equilibrium stand in its block.
        task: What an episode asks.
    """

    def __init__(self, body: Body, settings: Settings, layout: Layout, task: Any) -> None:
        numbers, space = np.arange(layout.size), body.model.space
        goal = space if task.force_vector else 1
        forces = layout.force(numbers) if task.target is None else layout.forces(numbers)[task.target]
        signed = -1.0 if body.model.cables > 1 else 0.0
        seen: Seen = {  # what is a number of the block, and its scale
            "cable": (layout.cables(numbers), 1 / settings.cable_limit_mm),
            "contact": (layout.flags(numbers), 1.0),
            "force_measured": (forces, 1 / FORCE_SCALE_N),
            **body.poses(settings.robot, layout),
        }
        told = {"desired_force": goal, "force_error": goal, "force_est": space}
        if task.moving:
            told["desired_ahead"] = len(AHEAD)
        if settings.sensors:
            told["force_measured"] = space
        if body.obstacle_size:
            told["obstacle"] = body.obstacle_size
        lowest = {
            "length": 0.0,
            "desired_ahead": 0.0,
            "cable": signed,
            "contact": 0.0,
            "desired_force": 0.0 if goal == 1 else -1.0,
        }
        sizes = {key: source.size for key, (source, _) in seen.items()} | told
        keys = [key for key in sorted(sizes) if settings.force_sensor or key not in SENSOR_KEYS]
        self.dict_space = spaces.Dict({key: _box(lowest.get(key, -1.0), (sizes[key],)) for key in keys})
        boxes = [box for box in self.dict_space.values() if isinstance(box, spaces.Box)]
        self._low, self._high = (np.concatenate([getattr(box, end) for box in boxes]) for end in ("low", "high"))
        self.flat_space = spaces.Box(self._low, self._high)
        ends = np.cumsum([sizes[key] for key in keys]).tolist()
        self._places = {key: slice(end - sizes[key], end) for key, end in zip(keys, ends, strict=True)}
        # Numbers that stand alone are put in their place without an axis.
        self._told = {
            key: self._places[key] if told[key] > 1 else self._places[key].start for key in told if key in keys
        }
        self._source, self._scale = np.zeros(self._low.size, int), np.zeros(self._low.size)
        self.delayed = np.zeros(self._low.size, bool)
        for key in DELAYED:
            self.delayed[self._places.get(key, slice(0))] = True
        self._motors = {key: self._places[key] for key in ("cable", "length") if key in self._places}
        for key in seen.keys() & keys:
            source, scale = seen[key]
            self._source[self._places[key]], self._scale[self._places[key]] = source.ravel(), scale
        self._obstacle_scale = np.ones(body.obstacle_size)
        self._obstacle_scale[:3] = 1 / settings.robot.length_mm

    def rows(self, blocks: np.ndarray, told: dict[str, Any], obstacle: np.ndarray) -> np.ndarray:
        """The flat form of one robot, ``(k,)``, or of many, ``(N, k)``, before it is bounded.

        Args:
            blocks: Equilibrium, ``(size,)`` or ``(N, size)``.
            told: Forces [N]: set-point, set-point minus measured, and estimate; numbers or ``(..., d)``.
            obstacle: What is seen of the obstacle, ``(..., o)``.
        """
        rows = blocks[:, self._source] if blocks.ndim > 1 else blocks.take(self._source)
        rows *= self._scale
        one = blocks.ndim == 1  # whose places are found faster without an ellipsis
        for key, force in told.items():
            place = self._told.get(key)
            if place is not None:
                rows[place if one else (..., place)] = force / FORCE_SCALE_N
        if "obstacle" in self._told:
            rows[..., self._told["obstacle"]] = obstacle * self._obstacle_scale
        return rows

    def correct(self, rows: np.ndarray, motors: np.ndarray) -> None:
        """Put what the motors tell in the place of what they move, ``(..., actions)`` [mm]."""
        start = 0
        for place in self._motors.values():
            count = place.stop - place.start
            rows[..., place] = motors[..., start : start + count] * self._scale[place]
            start += count

    def bounded(self, rows: np.ndarray) -> np.ndarray:
        """Rows within the bounds of the space, as float32; the rows are overwritten."""
        np.maximum(rows, self._low, out=rows)
        np.minimum(rows, self._high, out=rows)
        return rows.astype(np.float32)

    def entries(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """The dictionary form of flat rows ``(..., k)``, as views."""
        return {key: rows[..., place] for key, place in self._places.items()}


def _box(low: float, shape: tuple[int, ...]) -> spaces.Box:
    return spaces.Box(np.full(shape, low, np.float32), np.ones(shape, np.float32))
