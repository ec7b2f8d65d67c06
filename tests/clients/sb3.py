"""Stable-Baselines3: its checker, PPO and SAC on its own vectors, and VecVideoRecorder."""

from pathlib import Path

import gymnasium
import stable_baselines3
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import SubprocVecEnv, VecNormalize, VecVideoRecorder

import ccr_gym  # noqa: F401 - registers the ids

IDS = ("CCR/PushObstacle-v1", "CCR/InsertAndPush-v1", "CCR/SpatialPush-v1")

if __name__ == "__main__":
    for env_id in IDS:
        check_env(gymnasium.make(env_id), skip_render_check=False)
        envs = VecNormalize(make_vec_env(env_id, 4, seed=0))
        model = PPO("MlpPolicy", envs, n_steps=64, batch_size=64, n_epochs=2, device="cpu").learn(512)
        evaluate_policy(model, envs, 2)
        for algorithm in (SAC, TD3):
            algorithm("MlpPolicy", env_id, learning_starts=64, buffer_size=1000, device="cpu").learn(200)
    PPO("MultiInputPolicy", gymnasium.make(IDS[0], obs_mode="dict"), n_steps=64, device="cpu").learn(64)
    workers = make_vec_env(f"ccr_gym:{IDS[0]}", 2, vec_env_cls=SubprocVecEnv, vec_env_kwargs={"start_method": "spawn"})
    PPO("MlpPolicy", workers, n_steps=64, device="cpu").learn(128)
    workers.close()
    filmed = make_vec_env(IDS[-1], 2, env_kwargs={"render_mode": "rgb_array"})
    filmed = VecVideoRecorder(filmed, "sb3", lambda step: step == 0, video_length=20)
    PPO("MlpPolicy", filmed, n_steps=32, device="cpu").learn(64)
    filmed.close()
    assert list(Path("sb3").glob("*.mp4"))
    print(
        f"Stable-Baselines3 {stable_baselines3.__version__}: check_env, PPO, SAC, TD3, SubprocVecEnv, VecVideoRecorder"
    )
