"""The contract of everything that acts."""

from typing import Any, Protocol

import numpy as np

from ccr_gym import AHEAD, FORCE_SCALE_N, PrivilegedState

Observation = dict[str, np.ndarray]


class Policy(Protocol):
    """Acts on dictionary observations (`obs_mode="dict"`)."""

    name: str

    def reset(self, env: Any = None) -> None:
        """Forget the episode; a controller that knows more than it sees is given the environment of the next one."""

    def act(self, observation: Observation) -> np.ndarray:
        """The action for an observation, ``(1,)``, in space ``(2,)``, in [−1, 1]."""


def search(observation: Observation) -> np.ndarray:
    """The full action that bends the robot towards the obstacle, ``(..., actions)``: in the plane there is one way.

    In space the cables are taken to be at right angles.

    Args:
        observation: What is seen, of one robot or of many.
    """
    many = observation["desired_force"].shape[:-1]
    if "length" in observation:
        return np.broadcast_to(np.array([1.0, 0.0], np.float32), (*many, 2))
    if "obstacle" not in observation:
        return np.ones((*many, 1), np.float32)
    azimuth = np.arctan2(observation["obstacle"][..., 1], observation["obstacle"][..., 0])
    pull = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
    return np.asarray(pull / np.abs(pull).max(axis=-1, keepdims=True), np.float32)


def set_points(observation: Observation, steps: int) -> np.ndarray:
    """Magnitudes of the set-points after the next steps, ``(steps,)`` [N]: as now, unless they are previewed."""
    now = float(np.linalg.norm(observation["desired_force"]))
    ahead = observation.get("desired_ahead", np.full(len(AHEAD), now))
    return np.asarray(FORCE_SCALE_N * np.interp(np.arange(1, steps + 1), (0, *AHEAD), (now, *ahead)))


def effort(moves: np.ndarray, truth: PrivilegedState, increments: np.ndarray) -> np.ndarray:
    """Actions, ``(..., actions)``, for moves of what motors with play move [mm]: the play is taken up as well.

    Args:
        moves: Wanted moves, ``(..., actions)`` [mm]; where one is zero the motor stays.
        truth: Places, motors and slack.
        increments: What full actions move, ``(actions,)`` [mm].
    """
    play = np.where(moves == 0, 0.0, truth.actuated_mm + np.copysign(truth.half_backlash_mm, moves) - truth.motor_mm)
    wanted = (moves + play) / increments
    return np.asarray(wanted / np.maximum(1.0, np.abs(wanted).max(axis=-1, keepdims=True)), np.float32)


class Tare:
    """The force sensor with its zero taken off: the mean of what it reads while nothing touches."""

    def __init__(self) -> None:
        self._readings: list[np.ndarray] = []

    def forget(self) -> None:
        """Begin a new episode."""
        self._readings.clear()

    def force(self, observation: Observation) -> np.ndarray | None:
        """The measured force, ``(d,)`` [N]; ``None`` while nothing is seen to touch, which tells the zero."""
        measured = FORCE_SCALE_N * observation["force_measured"].astype(float)
        if not observation["contact"].any():
            self._readings.append(measured)
            return None
        return measured - np.mean(self._readings, axis=0) if self._readings else measured
