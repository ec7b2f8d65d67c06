"""Environments as policies use them."""

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np

from agents.arguments import check_kind
from ccr_gym import ContactEnv

Observation = dict[str, np.ndarray]
Environment = gymnasium.Env[Observation, np.ndarray]
EnvIndex = slice | list[int] | np.ndarray  # some of the robots or episodes of an array


def make_env(env_id: str, **kwargs: object) -> Environment:
    """Return an environment with dictionary observations, without Gymnasium's checker, which slows every step.

    Args:
        env_id: Id of the environment.
        **kwargs: Arguments of the environment, and ``max_episode_steps``.

    Raises:
        TypeError: If the id is no text.
    """
    check_kind("env_id", env_id, str, "give the id of an environment, one of ccr_gym.ENV_IDS")
    options: dict[str, Any] = {"disable_env_checker": True, "obs_mode": "dict", **kwargs}
    return gymnasium.make(env_id, **options)


def require_env(env: Environment | None) -> Environment:
    """Return the environment that a controller reads more from than observations.

    Raises:
        ValueError: If there is none.
        TypeError: If it is another one, or several.
    """
    if env is None:
        raise ValueError("env is None; this controller reads from its environment: call reset(env)")
    if not (isinstance(env, gymnasium.Env) and isinstance(env.unwrapped, ContactEnv)):
        raise TypeError(f"env is {env!r:.80}; this controller reads from a single environment of ccr_gym")
    return env


def require_reset(policy: object) -> None:
    """Refuse a controller that has no environment and no estimator yet.

    Raises:
        gymnasium.error.ResetNeeded: If it has none.
    """
    if not hasattr(policy, "_estimator"):
        raise gymnasium.error.ResetNeeded("call reset(env) before act()")


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
