"""Hindsight experience replay of Stable-Baselines3 on the goal-conditioned form."""

import gymnasium
import stable_baselines3
from stable_baselines3 import SAC, HerReplayBuffer
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env

import ccr_gym  # noqa: F401 - registers the ids

IDS = ("CCR/PushObstacle-v1", "CCR/SpatialPush-v1")
for env_id in IDS:
    for kwargs in ({}, {"task": {"force_vector": True}}) if "Spatial" in env_id else ({},):
        check_env(gymnasium.make(env_id, obs_mode="goal", **kwargs).unwrapped, skip_render_check=True)
        envs = make_vec_env(env_id, 2, seed=0, env_kwargs={"obs_mode": "goal", **kwargs})
        SAC(
            "MultiInputPolicy",
            envs,
            learning_starts=300,
            buffer_size=2000,
            replay_buffer_class=HerReplayBuffer,
            replay_buffer_kwargs={"n_sampled_goal": 4, "goal_selection_strategy": "future"},
            device="cpu",
        ).learn(500)
print(f"SB3 {stable_baselines3.__version__}: SAC with HerReplayBuffer on {', '.join(IDS)}")
