"""Untrained learners: PPO and SAC of Stable-Baselines3, recurrent PPO of sb3-contrib, and their environments."""

import numpy as np
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.type_aliases import PolicyPredictor
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs

from agents.config import TrainConfig
from agents.learning.memory import MemoryVecEnv
from agents.learning.network import CLIP, EPSILON
from agents.learning.sb3_adapter import SB3VecEnv
from agents.tuned import DistilledSettings, LearnerSettings, PPOSettings, RecurrentPPOSettings, SACSettings

WARM_UP = 100  # steps of all environments, with random actions, before SAC learns
ALGORITHMS: dict[type[LearnerSettings], type[BaseAlgorithm]] = {
    PPOSettings: PPO,
    RecurrentPPOSettings: RecurrentPPO,
    SACSettings: SAC,
}


def make_envs(config: TrainConfig, count: int, seed: int) -> VecMonitor:
    """Return environments with training scenes, as a learner sees them before its observations are normalised."""
    sensing, split = config.sensing, "train"
    if isinstance(config.learner, RecurrentPPOSettings):
        return VecMonitor(SB3VecEnv(config.env_id, count, seed, config.threads, sensing=sensing, split=split))
    envs = SB3VecEnv(config.env_id, count, seed, config.threads, obs_mode="dict", sensing=sensing, split=split)
    return VecMonitor(MemoryVecEnv(envs))


def normalized_envs(envs: VecEnv, config: TrainConfig) -> VecNormalize:
    """Return environments whose observations, and for PPO rewards, are normalised by running statistics."""
    off_policy = isinstance(config.learner, SACSettings)
    gamma = getattr(config.learner, "gamma", 1.0)
    return VecNormalize(envs, gamma=gamma, clip_obs=CLIP, norm_reward=not off_policy, epsilon=EPSILON)


def play_on(policy: PolicyPredictor, envs: VecEnv, done: int) -> tuple[VecEnvObs, np.ndarray]:
    """Play new episodes up to the step in which a run was left, as they all began together and are equally long.

    Without this, a run that is often resumed would see little but how episodes begin.

    Args:
        policy: The policy.
        envs: Environments.
        done: Steps of each environment that the run has done.

    Returns:
        The rows of the next step, and which episodes it begins, ``(N,)`` bool.
    """
    rows, starts = envs.reset(), np.ones(envs.num_envs, bool)
    state: tuple[np.ndarray, ...] | None = None
    for _ in range(done % envs.get_attr("max_episode_steps", [0])[0]):
        actions, state = policy.predict(rows, state, starts)  # type: ignore[arg-type] # rows are arrays
        rows, _, starts, _ = envs.step(actions)
    return rows, starts


def make_learner(envs: VecNormalize, config: TrainConfig) -> BaseAlgorithm:
    """Return an untrained learner with the settings of a run."""
    settings = config.learner
    assert not isinstance(settings, DistilledSettings)
    if isinstance(settings, SACSettings):
        return _sac(envs, settings, config.seed)
    if isinstance(settings, PPOSettings):
        return _ppo(envs, settings, config.seed)
    return _recurrent_ppo(envs, settings, config.seed)


def _sac(envs: VecNormalize, settings: SACSettings, seed: int) -> SAC:
    return SAC(
        "MlpPolicy",
        envs,
        learning_rate=LinearSchedule(settings.learning_rate, 0.0, 1.0),
        buffer_size=settings.buffer,
        learning_starts=WARM_UP * settings.envs,
        batch_size=settings.batch_size,
        tau=settings.tau,
        gamma=settings.gamma,
        gradient_steps=settings.gradient_steps,
        policy_kwargs={"net_arch": {"pi": [settings.width] * 2, "qf": [2 * settings.width] * 2}},
        seed=seed,
        device="cpu",
    )


def _ppo(envs: VecNormalize, settings: PPOSettings, seed: int) -> PPO:
    return PPO(
        "MlpPolicy",
        envs,
        learning_rate=LinearSchedule(settings.learning_rate, 0.0, 1.0),
        n_steps=settings.rollout,
        batch_size=settings.batch_size,
        n_epochs=settings.epochs,
        gamma=settings.gamma,
        gae_lambda=settings.gae_lambda,
        policy_kwargs={"log_std_init": settings.log_std_init, "net_arch": [settings.width] * 2},
        seed=seed,
        device="cpu",
    )


def _recurrent_ppo(envs: VecNormalize, settings: RecurrentPPOSettings, seed: int) -> RecurrentPPO:
    return RecurrentPPO(
        "MlpLstmPolicy",
        envs,
        learning_rate=LinearSchedule(settings.learning_rate, 0.0, 1.0),
        n_steps=settings.rollout,
        batch_size=settings.batch_size,
        n_epochs=settings.epochs,
        gamma=settings.gamma,
        gae_lambda=settings.gae_lambda,
        policy_kwargs={
            "log_std_init": settings.log_std_init,
            "net_arch": [settings.width],
            "lstm_hidden_size": settings.hidden,
        },
        seed=seed,
        device="cpu",
    )
