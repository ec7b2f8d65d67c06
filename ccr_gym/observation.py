"""The observation: what is seen, how it is scaled, and its flat form."""

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
    """The space of :func:`observe`; keys stand in the alphabetical order of the flat form."""
    nodes = robot.segments + 1
    entries: dict[str, spaces.Space[np.ndarray]] = {
        "cable": _box(0, (1,)),
        "contact": _box(0, (2 * nodes,)),
        "desired_force": _box(0, (1,)),
        "force_error": _box(-1, (1,)),
        "force_est": _box(-1, (2,)),
        "force_measured": _box(-1, (2,)),
        "nodes": _box(-1, (3 * nodes,)),
    }
    return spaces.Dict({key: entry for key, entry in entries.items() if force_sensor or key not in SENSOR_KEYS})


def flat_space(space: spaces.Dict) -> spaces.Box:
    """One box with the entries of the dictionary in order."""
    boxes = [box for box in space.values() if isinstance(box, spaces.Box)]
    return spaces.Box(*(np.concatenate([getattr(box, end) for box in boxes]) for end in ("low", "high")))


def observe(reading: Reading, force_sensor: bool) -> dict[str, np.ndarray]:
    """Scaled float32 arrays within the bounds of :func:`dict_space`."""
    equilibrium = reading.equilibrium
    length = equilibrium.robot.length_mm
    error = reading.desired_force - np.hypot(*reading.force_measured)
    observation = {
        "cable": np.array([equilibrium.cable_mm / reading.cable_limit_mm]),
        "contact": equilibrium.contact.any(axis=0).ravel(),
        "desired_force": np.array([reading.desired_force / FORCE_SCALE_N]),
        "force_error": np.array([error / FORCE_SCALE_N]),
        "force_est": reading.force_est / FORCE_SCALE_N,
        "force_measured": reading.force_measured / FORCE_SCALE_N,
        "nodes": (equilibrium.nodes / (length, length, np.pi)).ravel(),
    }
    return {
        key: np.clip(value, -1.0, 1.0).astype(np.float32)
        for key, value in observation.items()
        if force_sensor or key not in SENSOR_KEYS
    }


def flatten(observation: dict[str, np.ndarray]) -> np.ndarray:
    """The entries in order as one float32 vector."""
    return np.concatenate(list(observation.values()))


def _box(low: float, shape: tuple[int, ...]) -> spaces.Box:
    return spaces.Box(low, 1.0, shape, np.float32)
