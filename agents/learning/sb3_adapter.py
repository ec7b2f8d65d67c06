"""A vector environment of ccr-gym as Stable-Baselines3 takes it, which knows none of Gymnasium's."""

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

import ccr_gym  # noqa: F401 - registers the ids


class SB3VecEnv(VecEnv):
    """Environments of one id, moved by one call of the solver.

    Episodes end in the step that resets them, as Stable-Baselines3 expects: the entry of ``infos`` then holds
    ``terminal_observation``, ``TimeLimit.truncated`` and all else the environment tells; it is empty otherwise.

    Args:
        env_id: Id of the environments.
        n_envs: Number of them.
        seed: Seed of the first one; the others count on.
        threads: Threads of the solver.
        **kwargs: Arguments of the environments; the observation is flat unless ``obs_mode`` says otherwise.
    """

    def __init__(self, env_id: str, n_envs: int, seed: int | None = None, threads: int = 1, **kwargs: Any) -> None:
        settings = {"obs_mode": "flat", "autoreset_mode": AutoresetMode.SAME_STEP, "threads": threads, **kwargs}
        self._env = gymnasium.make_vec(env_id, n_envs, vectorization_mode="vector_entry_point", **settings)
        super().__init__(n_envs, self._env.single_observation_space, self._env.single_action_space)
        if seed is not None:
            self.seed(seed)

    def reset(self) -> VecEnvObs:
        """Start episodes in all environments."""
        seeds: Any = self._seeds if any(seed is not None for seed in self._seeds) else None
        observation: VecEnvObs = self._env.reset(seed=seeds)[0]
        self._reset_seeds()
        self.reset_infos = [{} for _ in range(self.num_envs)]
        return observation

    def step_async(self, actions: np.ndarray) -> None:
        """Take the actions."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Move by them."""
        observation, rewards, terminated, truncated, told = self._env.step(self._actions)
        dones = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(dones).tolist():
            infos[i] = _entry(told["final_info"], i)
            infos[i]["terminal_observation"] = told["final_obs"][i]
            infos[i]["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
        return observation, rewards.astype(np.float32), dones, infos

    def close(self) -> None:
        """Let go of the environments."""
        self._env.close()

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        """An attribute of the vector environment, the same for each of some environments."""
        value = None if attr_name == "render_mode" else getattr(self._env, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: int | Iterable[int] | None = None) -> None:
        """Refused: environments of a fleet are not told apart.

        Raises:
            AttributeError: Always.
        """
        raise AttributeError(f"{attr_name} cannot be set; give it when the environments are made")

    def env_method(
        self, method_name: str, *args: Any, indices: int | Iterable[int] | None = None, **kwargs: Any
    ) -> list[Any]:
        """A method of the vector environment, called once; each of some environments is given the answer."""
        answer = getattr(self._env, method_name)(*args, **kwargs)
        return [answer for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type[Any], indices: int | Iterable[int] | None = None) -> list[bool]:
        """No environment is wrapped on its own."""
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[np.ndarray | None]:
        """None: a fleet is not rendered."""
        return [None] * self.num_envs


def _entry(told: dict[str, Any], i: int) -> dict[str, Any]:
    """What one environment tells, of arrays over all."""
    return {
        key: _entry(value, i) if isinstance(value, dict) else value[i]
        for key, value in told.items()
        if not key.startswith("_")
    }
