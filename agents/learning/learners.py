"""The learners: Stable-Baselines3's PPO and SAC, sb3-contrib's recurrent PPO, untrained."""

from typing import Any

from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize

from agents.config import TrainConfig
from agents.learning.actor import CLIP, EPSILON
from agents.learning.memory import MemoryVecEnv
from agents.learning.sb3_adapter import SB3VecEnv
from agents.tuned import DistilledSettings, LearnerSettings, PPOSettings, RecurrentPPOSettings, SACSettings

KINDS: dict[type[LearnerSettings], type[BaseAlgorithm]] = {
    PPOSettings: PPO,
    RecurrentPPOSettings: RecurrentPPO,
    SACSettings: SAC,
}


def environments(config: TrainConfig, count: int, seed: int) -> VecEnv:
    """Environments of training scenes as a learner sees them, before their observations are scaled."""
    told: dict[str, Any] = {"sensing": config.sensing, "split": "train"}
    if isinstance(config.learner, RecurrentPPOSettings):
        return VecMonitor(SB3VecEnv(config.env_id, count, seed, config.threads, **told))
    return VecMonitor(MemoryVecEnv(SB3VecEnv(config.env_id, count, seed, config.threads, obs_mode="dict", **told)))


def scaled(bare: VecEnv, config: TrainConfig) -> VecNormalize:
    """The same with observations and rewards scaled by what has been seen of them."""
    off_policy = isinstance(config.learner, SACSettings)
    gamma = getattr(config.learner, "gamma", 1.0)
    return VecNormalize(bare, gamma=gamma, clip_obs=CLIP, norm_reward=not off_policy, epsilon=EPSILON)


def learner(envs: VecNormalize, config: TrainConfig) -> BaseAlgorithm:
    """An untrained learner with the settings of a run."""
    settings = config.learner
    assert not isinstance(settings, DistilledSettings)
    common: dict[str, Any] = {
        "learning_rate": LinearSchedule(settings.learning_rate, 0.0, 1.0),
        "batch_size": settings.batch_size,
        "gamma": settings.gamma,
        "seed": config.seed,
        "device": "cpu",
    }
    if isinstance(settings, SACSettings):
        return SAC(
            "MlpPolicy",
            envs,
            buffer_size=settings.buffer,
            tau=settings.tau,
            gradient_steps=settings.gradient_steps,
            learning_starts=100 * settings.envs,
            policy_kwargs={"net_arch": {"pi": [settings.width] * 2, "qf": [2 * settings.width] * 2}},
            **common,
        )
    common |= {"n_steps": settings.rollout, "n_epochs": settings.epochs, "gae_lambda": settings.gae_lambda}
    policy: dict[str, Any] = {"log_std_init": settings.log_std_init, "net_arch": [settings.width] * 2}
    if isinstance(settings, PPOSettings):
        return PPO("MlpPolicy", envs, policy_kwargs=policy, **common)
    policy |= {"net_arch": [settings.width], "lstm_hidden_size": settings.hidden}
    return RecurrentPPO("MlpLstmPolicy", envs, policy_kwargs=policy, **common)
