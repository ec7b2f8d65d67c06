"""The observation: what is seen, how it is scaled, and its flat form."""

import math
from typing import NamedTuple

import numpy as np
from gymnasium import spaces

from solver import Equilibrium, Robot

FORCE_SCALE_N = 0.5  # force that an observation of 1 stands for
SENSOR_KEYS = ("force_error", "force_measured")  # seen with a force sensor only


class Reading(NamedTuple):
    """What the sensors say at one instant, in physical units.

    Attributes:
        equilibrium: Source of node poses, contact flags and cable displacement.
        force_measured: Contact force on the robot as a force sensor gives it, ``(2,)`` [N].
        force_est: The same by virtual work, ``(2,)`` [N].
        desired_force: Set-point [N].
        cable_limit_mm: Full scale of the cable displacement [mm].
    """

    equilibrium: Equilibrium
    force_measured: np.ndarray
    force_est: np.ndarray
    desired_force: float
    cable_limit_mm: float


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
    """Writes readings as scaled float32 vectors within the bounds of their space.

    Args:
        robot: The robot.
        force_sensor: Whether the measured force is seen.
    """

    def __init__(self, robot: Robot, force_sensor: bool) -> None:
        self.dict_space = dict_space(robot, force_sensor)
        boxes = [box for box in self.dict_space.values() if isinstance(box, spaces.Box)]
        low, high = (np.concatenate([getattr(box, end) for box in boxes]) for end in ("low", "high"))
        self.flat_space = spaces.Box(low, high)
        ends = np.cumsum([box.shape[0] for box in boxes]).tolist()
        self._places = {
            key: slice(end - box.shape[0], end) for key, box, end in zip(self.dict_space, boxes, ends, strict=True)
        }
        self._pose_scale = (robot.length_mm, robot.length_mm, np.pi)
        self._force_sensor = force_sensor

    def flat(self, reading: Reading) -> np.ndarray:
        """The flat form, ``(k,)`` float32."""
        equilibrium, at = reading.equilibrium, self._places
        vector = np.empty(self.flat_space.shape, np.float32)
        vector[at["cable"]] = equilibrium.cable_mm / reading.cable_limit_mm
        vector[at["contact"]] = equilibrium.contact.any(axis=0).ravel()
        vector[at["desired_force"]] = reading.desired_force / FORCE_SCALE_N
        vector[at["force_est"]] = reading.force_est / FORCE_SCALE_N
        vector[at["nodes"]] = (equilibrium.nodes / self._pose_scale).ravel()
        if self._force_sensor:
            vector[at["force_error"]] = (reading.desired_force - math.hypot(*reading.force_measured)) / FORCE_SCALE_N
            vector[at["force_measured"]] = reading.force_measured / FORCE_SCALE_N
        return np.clip(vector, self.flat_space.low, self.flat_space.high, out=vector)

    def entries(self, reading: Reading) -> dict[str, np.ndarray]:
        """The dictionary form, views of one vector."""
        vector = self.flat(reading)
        return {key: vector[place] for key, place in self._places.items()}


def _box(low: float, shape: tuple[int, ...]) -> spaces.Box:
    return spaces.Box(np.full(shape, low, np.float32), np.ones(shape, np.float32))
