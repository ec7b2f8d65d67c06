"""Vector environments of ccr-gym for Stable-Baselines3, which does not take those of Gymnasium."""

from collections.abc import Iterable, Mapping, Sequence

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

import ccr_gym  # noqa: F401 - registers the ids
from agents.arguments import check_whole

LARGEST_SEED = 2**63 - 1
InfoArrays = Mapping[str, "np.ndarray | InfoArrays"]


class SB3VecEnv(VecEnv):
    """Environments of one id, stepped by one call of the solver.

    Environments are reset in the step that ends their episode, as Stable-Baselines3 expects. Their entry of ``infos``
    then holds ``terminal_observation``, ``TimeLimit.truncated`` and the info of the environment; it is empty otherwise.

    Args:
        env_id: Id of the environments.
        n_envs: Number of environments.
        seed: Seed of the first environment; the others get the following ones.
        threads: Threads of the solver.
        **kwargs: Arguments of the environments; the observation is flat unless ``obs_mode`` says otherwise.
    """

    def __init__(self, env_id: str, n_envs: int, seed: int | None = None, threads: int = 1, **kwargs: object) -> None:
        settings = {"obs_mode": "flat", "autoreset_mode": AutoresetMode.SAME_STEP, "threads": threads, **kwargs}
        self._env = gymnasium.make_vec(env_id, n_envs, "vector_entry_point", None, None, **settings)
        super().__init__(n_envs, self._env.single_observation_space, self._env.single_action_space)
        if seed is not None:
            self.seed(seed)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the next reset: the first environment by this seed, the others by the following ones.

        Raises:
            ValueError: If it is neither None nor a whole number from 0 on.
        """
        return super().seed(None if seed is None else check_whole("seed", seed, 0, LARGEST_SEED))

    def reset(self) -> VecEnvObs:
        """Start episodes in all environments."""
        seeds = self._seeds if any(seed is not None for seed in self._seeds) else None
        observation: VecEnvObs = self._env.reset(seed=seeds)[0]  # type: ignore[arg-type] # may be a list
        self._reset_seeds()
        self.reset_infos = [{} for _ in range(self.num_envs)]
        return observation

    def step_async(self, actions: np.ndarray) -> None:
        """Store the actions of the next step."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Step all environments with the stored actions."""
        observation, rewards, terminated, truncated, info = self._env.step(self._actions)
        dones = terminated | truncated
        infos: list[dict[str, object]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(dones).tolist():
            infos[i] = _entry(info["final_info"], i)
            infos[i]["terminal_observation"] = info["final_obs"][i]
            infos[i]["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
        return observation, rewards.astype(np.float32), dones, infos

    def close(self) -> None:
        """Close the environments."""
        self._env.close()

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[object]:
        """Return an attribute of the vector environment, once for each of the environments asked for."""
        value = None if attr_name == "render_mode" else getattr(self._env, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: object, indices: int | Iterable[int] | None = None) -> None:
        """Refuse to set an attribute: the environments share all of them.

        Raises:
            AttributeError: Always.
        """
        raise AttributeError(f"{attr_name} cannot be set; pass it when the environments are made")

    def env_method(
        self, method_name: str, *args: object, indices: int | Iterable[int] | None = None, **kwargs: object
    ) -> list[object]:
        """Call a method of the vector environment once; return its result for each environment asked for."""
        answer = getattr(self._env, method_name)(*args, **kwargs)
        return [answer for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: int | Iterable[int] | None = None) -> list[bool]:
        """Return False for each environment: none has a wrapper of its own."""
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[np.ndarray | None]:
        """Return None for each environment: vector environments are not rendered."""
        return [None] * self.num_envs


def _entry(info: InfoArrays, i: int) -> dict[str, object]:
    """Return the info of one environment from arrays over all."""
    return {
        key: _entry(value, i) if isinstance(value, Mapping) else value[i]
        for key, value in info.items()
        if not key.startswith("_")
    }
