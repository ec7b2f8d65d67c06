"""Gymnasium's checker and wrappers of single environments, all warnings being errors."""

import warnings
from pathlib import Path

import gymnasium
import numpy as np
from gymnasium import wrappers
from gymnasium.utils.env_checker import check_env

import ccr_gym

WRAPPERS = {
    "RecordEpisodeStatistics": wrappers.RecordEpisodeStatistics,
    "NormalizeObservation": wrappers.NormalizeObservation,
    "NormalizeReward": wrappers.NormalizeReward,
    "FlattenObservation": wrappers.FlattenObservation,
    "FrameStackObservation": lambda env: wrappers.FrameStackObservation(env, 3),
    "TransformReward": lambda env: wrappers.TransformReward(env, lambda reward: 2 * reward),
    "TransformObservation": lambda env: wrappers.TransformObservation(env, lambda row: row, env.observation_space),
    "RescaleObservation": lambda env: wrappers.RescaleObservation(env, -2, 2),
    "RescaleAction": lambda env: wrappers.RescaleAction(env, np.float32(-3), np.float32(3)),
    "ClipAction": wrappers.ClipAction,
    "ClipReward": lambda env: wrappers.ClipReward(env, -1, 1),
    "StickyAction": lambda env: wrappers.StickyAction(env, 0.3),
    "DelayObservation": lambda env: wrappers.DelayObservation(env, 2),
    "TimeAwareObservation": wrappers.TimeAwareObservation,
    "TimeLimit": lambda env: wrappers.TimeLimit(env, 10),
    "Autoreset": wrappers.Autoreset,
    "RenderCollection": wrappers.RenderCollection,
    "HumanRendering": wrappers.HumanRendering,
    "AddRenderObservation": lambda env: wrappers.AddRenderObservation(env, render_only=False),
    "AddWhiteNoise": lambda env: wrappers.AddWhiteNoise(env, 0.5),
    "NumpyToTorch": wrappers.NumpyToTorch,
    "RecordVideo": lambda env: wrappers.RecordVideo(env, f"videos/{env.spec.name}", episode_trigger=lambda _: True),
}


def episode(env_id: str, wrapper) -> None:
    env = wrapper(gymnasium.make(env_id, render_mode="rgb_array"))
    env.action_space.seed(0)
    env.reset(seed=0)
    ended = False
    while not ended:
        action = env.action_space.sample()
        _, _, terminated, truncated, _ = env.step(action)
        ended = terminated or truncated
    env.close()


warnings.simplefilter("error")
for env_id in ccr_gym.ENV_IDS:
    check_env(gymnasium.make(env_id, render_mode="rgb_array").unwrapped, skip_render_check=True)
for env_id in ("CCR/PushObstacle-v1", "CCR/SpatialPush-v1"):
    for name, wrapper in WRAPPERS.items():
        try:
            episode(env_id, wrapper)
        except BaseException as error:
            raise RuntimeError(f"{name} of {env_id}: {error!r}") from error
assert len({film.parent for film in Path().glob("videos/*/*.mp4")}) == 2
print(f"Gymnasium {gymnasium.__version__}: check_env of {len(ccr_gym.ENV_IDS)} ids, {len(WRAPPERS)} wrappers")
