"""Train PPO of Stable-Baselines3 and evaluate it; run it after ``pip install '.[agents]'``.

``PPO("MlpPolicy", "CCR/PushObstacle-v1")`` works as well; many environments that are moved in one call are faster.
"""

import sys

import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from agents import SB3VecEnv

ENV_ID, EPISODE = "CCR/PushObstacle-v1", 64  # steps


def errors(model: PPO, scaled: VecNormalize, episodes: int = 100) -> np.ndarray:
    """Return the relative force errors at the end of episodes in test scenes, counted up to 1."""
    envs = SB3VecEnv(ENV_ID, episodes, seed=0, split="test")
    observation, infos = envs.reset(), []
    for _ in range(EPISODE):
        actions, _ = model.predict(scaled.normalize_obs(observation), deterministic=True)
        observation, _, _, infos = envs.step(actions)
    return np.array([-info["reward_force_error"] for info in infos])


def main(steps: int = 100_000) -> tuple[float, float]:
    """Train; return the median force errors before and after."""
    envs = VecNormalize(VecMonitor(SB3VecEnv(ENV_ID, 32, seed=0, split="train")), gamma=0.9)
    settings = {"n_steps": 64, "batch_size": 512, "n_epochs": 8, "gamma": 0.9, "gae_lambda": 0.9}
    policy = {"log_std_init": -0.5, "net_arch": [64, 64]}
    model = PPO("MlpPolicy", envs, learning_rate=1e-3, policy_kwargs=policy, seed=0, device="cpu", **settings)
    before = float(np.median(errors(model, envs)))
    model.learn(steps)
    return before, float(np.median(errors(model, envs)))


if __name__ == "__main__":
    before, after = main(*map(int, sys.argv[1:]))
    print(f"median force error in 100 test scenes: {before:.1%} before, {after:.1%} after training")
