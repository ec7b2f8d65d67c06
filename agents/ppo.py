"""PPO by Stable-Baselines3: train, save together what belongs together, and load it again."""

from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecEnv, VecFrameStack, VecMonitor, VecNormalize

from agents.config import TrainConfig
from agents.policy import Observation
from agents.sb3_adapter import FleetVecEnv

POLICY, CONFIG, NORMALIZER = "policy.zip", "config.json", "normalizer.pkl"


def learner(environments: VecEnv, config: TrainConfig) -> PPO:
    """An untrained PPO with the settings of a run, on environments whose observations are scaled."""
    scaled = VecNormalize(VecMonitor(environments), gamma=config.gamma, clip_obs=10.0)
    return PPO(
        "MlpPolicy",
        scaled if config.frames == 1 else VecFrameStack(scaled, config.frames),
        learning_rate=LinearSchedule(config.learning_rate, 0.0, 1.0),
        n_steps=config.rollout,
        batch_size=config.batch_size,
        n_epochs=config.epochs,
        gamma=config.gamma,
        gae_lambda=config.gae_lambda,
        policy_kwargs={"net_arch": [config.width] * 2, "log_std_init": config.log_std_init},
        seed=config.seed,
        device="cpu",
    )


def train(config: TrainConfig, progress: bool = True) -> Path:
    """Train and save; returns the run folder."""
    torch.set_num_threads(1)  # faster than more for networks this small
    config.run.mkdir(parents=True, exist_ok=True)
    told = {"sensing": config.sensing, "split": "train"}
    model = learner(FleetVecEnv(config.env_id, config.envs, config.seed, config.threads, **told), config)
    model.tensorboard_log = str(config.run)
    model.learn(config.steps, progress_bar=progress, tb_log_name="log")
    normalizer = model.get_vec_normalize_env()
    assert normalizer is not None
    save(model, normalizer, config)
    normalizer.close()
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
        self._seen: np.ndarray | None = None
        self._normalizer = VecNormalize.load(str(run / NORMALIZER), FleetVecEnv(self.config.env_id, 1))

    def reset(self, env: Any = None) -> None:
        """Forget what was seen before."""
        self._seen = None

    def act(self, observation: Observation) -> np.ndarray:
        """The mean action for a dictionary observation."""
        flat = np.asarray(self._normalizer.normalize_obs(np.concatenate(list(observation.values()))))
        if self._seen is None:
            self._seen = np.zeros(self.config.frames * flat.size, np.float32)
        self._seen = np.concatenate([self._seen[flat.size :], flat])
        return np.asarray(self._model.predict(self._seen, deterministic=True)[0])
