"""Environments as policies use them."""

from collections.abc import Mapping

import gymnasium
import numpy as np

import ccr_gym  # noqa: F401 - registers the ids
from agents.arguments import check_kind

Observation = dict[str, np.ndarray]
Environment = gymnasium.Env[Observation, np.ndarray]
EnvIndex = slice | list[int] | np.ndarray  # some of the robots or episodes of an array


def make_env(env_id: str, **kwargs: object) -> Environment:
    """Return an environment with dictionary observations, without Gymnasium's checker, which slows every step.

    Args:
        env_id: Id of the environment.
        **kwargs: Arguments of the environment.

    Raises:
        TypeError: If the id is no text.
    """
    check_kind("env_id", env_id, str, "give the id of an environment, one of ccr_gym.ENV_IDS")
    return gymnasium.make(env_id, None, True, obs_mode="dict", **kwargs)


def require_env(env: Environment | None) -> Environment:
    """Return the environment that a controller reads more from than observations.

    Raises:
        ValueError: If there is none.
    """
    if env is None:
        raise ValueError("env is None; this controller reads from its environment: call reset(env)")
    return env


def require_entries(observation: Mapping[str, np.ndarray], *names: str) -> None:
    """Refuse an observation without named entries, or without those of some names.

    Raises:
        ValueError: If it is none of ``obs_mode="dict"``.
    """
    if not isinstance(observation, Mapping):
        raise ValueError(
            f'the observation is a {type(observation).__name__}; policies need named entries: obs_mode="dict"'
        )
    if missing := [name for name in names if not isinstance(observation.get(name), np.ndarray)]:
        raise ValueError(f"the observation has no array {missing[0]!r}; take one of an environment of ccr_gym")
