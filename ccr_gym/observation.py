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
    return spaces.Box(np.concatenate([box.low for box in boxes]), np.concatenate([box.high for box in boxes]))


def observe(reading: Reading, space: spaces.Dict) -> dict[str, np.ndarray]:
    """Scaled float32 arrays within the bounds of :func:`dict_space`, views of one vector in the order of the keys."""
    equilibrium = reading.equilibrium
    length = equilibrium.robot.length_mm
    error = reading.desired_force - np.hypot(*reading.force_measured)
    values: dict[str, np.ndarray | tuple[float]] = {
        "cable": (equilibrium.cable_mm / reading.cable_limit_mm,),
        "contact": equilibrium.contact.any(axis=0).ravel(),
        "desired_force": (reading.desired_force / FORCE_SCALE_N,),
        "force_error": (error / FORCE_SCALE_N,),
        "force_est": reading.force_est / FORCE_SCALE_N,
        "force_measured": reading.force_measured / FORCE_SCALE_N,
        "nodes": (equilibrium.nodes / (length, length, np.pi)).ravel(),
    }
    vector = np.concatenate([values[key] for key in space]).astype(np.float32)
    np.clip(vector, -1.0, 1.0, out=vector)
    ends = np.cumsum([len(values[key]) for key in space]).tolist()
    return {key: vector[end - len(values[key]) : end] for key, end in zip(space, ends, strict=True)}


def flatten(observation: dict[str, np.ndarray]) -> np.ndarray:
    """The entries in order as one float32 vector."""
    return np.concatenate(list(observation.values()))


def _box(low: float, shape: tuple[int, ...]) -> spaces.Box:
    return spaces.Box(np.full(shape, low, np.float32), np.ones(shape, np.float32))
