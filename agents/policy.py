"""The interface of a policy, and what controllers and teachers have in common.

Controllers compute in the natural units of the robot (:class:`ccr_gym.Scales`): forces in EI/L², cable displacements in
the offset a of the cables. So their gains suit robots of any size and rigidity.
"""

from typing import Protocol

import numpy as np

from agents.environment import Environment, Observation, require_entries
from ccr_gym import AHEAD, PrivilegedState, Scales

__all__ = ["Observation", "Policy", "motor_actions", "natural", "search", "set_points"]


class Policy(Protocol):
    """Chooses actions from dictionary observations (``obs_mode="dict"``)."""

    name: str

    def reset(self, env: Environment | None = None) -> None:
        """Start a new episode; a controller that uses more than its observations takes it from the environment."""

    def act(self, observation: Observation) -> np.ndarray:
        """Return the action for an observation, ``(actions,)`` in [−1, 1]."""


def search(observation: Observation) -> np.ndarray:
    """Return the full-speed action that bends the robot towards the obstacle, ``(..., actions)``.

    All sections bend alike, and an insertion stays where it is. In space the pairs of cables of the paper's model are
    assumed to be at right angles.

    Args:
        observation: The observation of one robot, or of many.

    Raises:
        ValueError: If the observation is none of ``obs_mode="dict"``.
    """
    require_entries(observation, "desired_force", "cable")
    many, commands = observation["desired_force"].shape[:-1], observation["cable"].shape[-1]
    pull = np.ones((*many, commands), np.float32)
    if "obstacle" in observation:
        azimuth = np.arctan2(observation["obstacle"][..., 1], observation["obstacle"][..., 0])
        towards = np.stack([np.cos(azimuth), np.sin(azimuth)] * (commands // 2), axis=-1)
        pull = np.asarray(towards / np.abs(towards).max(axis=-1, keepdims=True), np.float32)
    if "length" in observation:
        pull = np.concatenate([pull, np.zeros((*many, 1), np.float32)], axis=-1)
    return pull


def set_points(observation: Observation, steps: int, span: float) -> np.ndarray:
    """Return the set-point magnitudes after each of the next steps, ``(steps,)`` [EI/L²].

    They are interpolated between the previewed ones; without a preview the present set-point is held.

    Args:
        observation: The observation of one robot.
        steps: Number of steps.
        span: Force that is observed as 1 [EI/L²].
    """
    now = float(np.linalg.norm(observation["desired_force"]))
    ahead = observation.get("desired_ahead", np.full(len(AHEAD), now))
    return np.asarray(span * np.interp(np.arange(1, steps + 1), (0, *AHEAD), (now, *ahead)))


def natural(state: PrivilegedState, scales: Scales) -> PrivilegedState:
    """Return a state in the natural units of its robot: forces in EI/L², places in the cable travel a."""
    force, travel = scales.force_n, scales.travel_mm
    return state._replace(
        force=state.force / force,
        goal=state.goal / force,
        actuated_mm=state.actuated_mm / travel,
        motor_mm=state.motor_mm / travel,
        half_backlash_mm=state.half_backlash_mm / travel,
    )


def motor_actions(moves: np.ndarray, state: PrivilegedState, increments: np.ndarray) -> np.ndarray:
    """Return the actions ``(..., actions)`` that move the cables and the base as wanted, backlash included.

    Args:
        moves: Wanted moves, ``(..., actions)``; where one is zero the motor stays.
        state: Actuated positions, motor positions and backlash, in the same unit.
        increments: Moves of full actions, ``(actions,)``, in the same unit.
    """
    play = np.where(moves == 0, 0.0, state.actuated_mm + np.copysign(state.half_backlash_mm, moves) - state.motor_mm)
    wanted = (moves + play) / increments
    return np.asarray(wanted / np.maximum(1.0, np.abs(wanted).max(axis=-1, keepdims=True)), np.float32)
