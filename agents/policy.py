"""The interface of a policy, and what controllers and teachers have in common."""

from typing import Protocol

import numpy as np

from agents.environment import Environment, Observation
from ccr_gym import AHEAD, FORCE_SCALE_N, PrivilegedState

__all__ = ["Observation", "Policy", "motor_actions", "search", "set_points"]


class Policy(Protocol):
    """Chooses actions from dictionary observations (``obs_mode="dict"``)."""

    name: str

    def reset(self, env: Environment | None = None) -> None:
        """Start a new episode; a controller that uses more than its observations takes it from the environment."""

    def act(self, observation: Observation) -> np.ndarray:
        """Return the action for an observation: ``(1,)``, or ``(2,)`` in space and with insertion, in [−1, 1]."""


def search(observation: Observation) -> np.ndarray:
    """Return the full-speed action that bends the robot towards the obstacle, ``(..., actions)``.

    In the plane there is only one direction. In space the two pairs of cables are assumed to be at right angles.

    Args:
        observation: The observation of one robot, or of many.
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
    """Return the set-point magnitudes after each of the next steps, ``(steps,)`` [N].

    They are interpolated between the previewed ones; without a preview the present set-point is held.
    """
    now = float(np.linalg.norm(observation["desired_force"]))
    ahead = observation.get("desired_ahead", np.full(len(AHEAD), now))
    return np.asarray(FORCE_SCALE_N * np.interp(np.arange(1, steps + 1), (0, *AHEAD), (now, *ahead)))


def motor_actions(moves: np.ndarray, state: PrivilegedState, increments: np.ndarray) -> np.ndarray:
    """Return the actions ``(..., actions)`` that move the cables and the base as wanted, backlash included.

    Args:
        moves: Wanted moves, ``(..., actions)`` [mm]; where one is zero the motor stays.
        state: Actuated positions, motor positions and backlash.
        increments: Moves of full actions, ``(actions,)`` [mm].
    """
    play = np.where(moves == 0, 0.0, state.actuated_mm + np.copysign(state.half_backlash_mm, moves) - state.motor_mm)
    wanted = (moves + play) / increments
    return np.asarray(wanted / np.maximum(1.0, np.abs(wanted).max(axis=-1, keepdims=True)), np.float32)
