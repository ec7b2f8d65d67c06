"""Environments as policies use them: how they are made, and what their actions move."""

from dataclasses import dataclass

import gymnasium
import numpy as np

import ccr_gym  # noqa: F401 - registers the ids
from ccr_gym import Settings, Task

Observation = dict[str, np.ndarray]
Environment = gymnasium.Env[Observation, np.ndarray]
EnvIndex = slice | list[int] | np.ndarray  # some of the robots or episodes of an array


def make_env(env_id: str, **kwargs: object) -> Environment:
    """Return an environment with dictionary observations, without Gymnasium's checker, which slows every step.

    Args:
        env_id: Id of the environment.
        **kwargs: Arguments of the environment.
    """
    return gymnasium.make(env_id, None, True, obs_mode="dict", **kwargs)


def require_env(env: Environment | None) -> Environment:
    """Return the environment that a controller reads more from than observations.

    Raises:
        ValueError: If there is none.
    """
    if env is None:
        raise ValueError("env is None; this controller reads from its environment: call reset(env)")
    return env


@dataclass(frozen=True, slots=True)
class Actuation:
    """What the actions of an environment move.

    Attributes:
        cables: Number of actuated cables; an action beyond them is the insertion of the base.
        increments: Moves of full actions, ``(actions,)`` [mm].
        low: Smallest displacements, ``(actions,)`` [mm].
        high: Largest displacements, ``(actions,)`` [mm].
    """

    cables: int
    increments: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, task: Task, settings: Settings) -> "Actuation":
        """Return that of the environments of a task with some settings."""
        low, high = task.body.bounds(settings)
        return cls(task.body.model.cables, task.body.increments(settings), low, high)
