"""PPO by Stable-Baselines3: train, save together what belongs together, and load it again."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecNormalize

import ccr_gym  # noqa: F401 - registers the ids
from agents.config import TrainConfig
from agents.policy import Observation

POLICY, CONFIG, NORMALIZER = "policy.zip", "config.json", "normalizer.pkl"


def train(config: TrainConfig, progress: bool = True) -> Path:
    """Train and save; returns the run folder."""
    torch.set_num_threads(1)  # faster than more for networks this small
    environments = make_vec_env(
        config.env_id,
        n_envs=config.envs,
        seed=config.seed,
        env_kwargs={"obs_mode": "flat", "disable_env_checker": True},
    )
    normalized = VecNormalize(environments, gamma=config.gamma, clip_obs=10.0)
    config.run.mkdir(parents=True, exist_ok=True)
    model = PPO(
        "MlpPolicy",
        normalized,
        learning_rate=LinearSchedule(config.learning_rate, 0.0, 1.0),
        n_steps=config.rollout,
        batch_size=config.batch_size,
        n_epochs=config.epochs,
        gamma=config.gamma,
        gae_lambda=config.gae_lambda,
        policy_kwargs={"net_arch": [config.width] * 2, "log_std_init": config.log_std_init},
        tensorboard_log=str(config.run),
        seed=config.seed,
        device="cpu",
    )
    model.learn(config.steps, progress_bar=progress, tb_log_name="log")
    save(model, normalized, config)
    normalized.close()
    return config.run


def save(model: PPO, normalizer: VecNormalize, config: TrainConfig) -> None:
    """Write policy, normaliser and configuration into the run folder.

    The configuration goes first and comes last, so that a folder whose saving was interrupted does not load.
    """
    (config.run / CONFIG).unlink(missing_ok=True)
    model.save(config.run / POLICY)
    normalizer.save(str(config.run / NORMALIZER))
    config.save(config.run / CONFIG)


class PPOPolicy:
    """A trained policy with the observation scaling it was trained with.

    Args:
        run: A folder that :func:`train` wrote.

    Raises:
        FileNotFoundError: If a piece of the run is missing.
        ValueError: If a piece cannot be read.
    """

    name = "PPO"

    def __init__(self, run: Path) -> None:
        for piece in (CONFIG, POLICY, NORMALIZER):
            if not (run / piece).is_file():
                raise FileNotFoundError(f"{run / piece} is missing; train first: ccr-gym train --run {run}")
        self.config = TrainConfig.load(run / CONFIG)
        self._model = PPO.load(run / POLICY, device="cpu")
        placeholder: Any = make_vec_env(
            lambda: gymnasium.make(self.config.env_id, obs_mode="flat", disable_env_checker=True)
        )
        self._normalizer = VecNormalize.load(str(run / NORMALIZER), placeholder)

    def reset(self) -> None:
        """Nothing to forget."""

    def act(self, observation: Observation) -> np.ndarray:
        """The mean action for a dictionary observation, ``(1,)``."""
        flat = np.concatenate(list(observation.values()))
        return np.asarray(self._model.predict(self._normalizer.normalize_obs(flat), deterministic=True)[0])
