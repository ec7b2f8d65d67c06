"""Gymnasium's three vectorisers and their wrappers, all warnings being errors."""

import warnings
from pathlib import Path

import gymnasium
import numpy as np
from gymnasium.wrappers import vector

import ccr_gym  # noqa: F401 - registers the ids

MODES = ("sync", "async", "vector_entry_point")
IDS = ("CCR/PushObstacle-v1", "CCR/InsertAndPush-v1", "CCR/SpatialPush-v1")
WRAPPERS = {
    "RecordEpisodeStatistics": vector.RecordEpisodeStatistics,
    "NormalizeObservation": vector.NormalizeObservation,
    "NormalizeReward": vector.NormalizeReward,
    "FlattenObservation": vector.FlattenObservation,
    "TransformReward": lambda envs: vector.TransformReward(envs, lambda rewards: 2 * rewards),
    "TransformObservation": lambda envs: vector.TransformObservation(envs, lambda rows: 2 * rows),
    "RescaleObservation": lambda envs: vector.RescaleObservation(envs, -2, 2),
    "RescaleAction": lambda envs: vector.RescaleAction(envs, np.float32(-3), np.float32(3)),
    "ClipAction": vector.ClipAction,
    "ClipReward": lambda envs: vector.ClipReward(envs, -1, 1),
    "DictInfoToList": vector.DictInfoToList,
    "NumpyToTorch": vector.NumpyToTorch,
    "RecordVideo": lambda envs: vector.RecordVideo(
        envs, f"videos/{type(envs).__name__}", episode_trigger=lambda _: True
    ),
}


def roll(envs, steps: int = 70) -> np.ndarray:
    envs.action_space.seed(0)
    rows = [envs.reset(seed=0)[0]]
    for _ in range(steps):  # longer than an episode
        actions = envs.action_space.sample()
        rows.append(envs.step(actions)[0])
    envs.close()
    return np.array(rows)


def make(env_id: str, mode: str, **kwargs):
    return gymnasium.make_vec(env_id, 3, vectorization_mode=mode, **kwargs)


if __name__ == "__main__":
    warnings.simplefilter("error")
    for env_id in IDS:
        by_mode = [roll(make(env_id, mode)) for mode in MODES]
        assert all(np.array_equal(rows, by_mode[0]) for rows in by_mode), f"the modes differ on {env_id}"
    for mode in ("sync", "vector_entry_point"):
        for name, wrapper in WRAPPERS.items():
            try:
                envs = wrapper(make(IDS[-1], mode, render_mode="rgb_array"))
                envs.reset(seed=0)
                for _ in range(70):
                    envs.step(envs.single_action_space.sample()[None].repeat(3, 0))
                envs.close()
            except BaseException as error:
                raise RuntimeError(f"{name} of {IDS[-1]}, {mode}: {error!r}") from error
    assert len({film.parent for film in Path().glob("videos/*/*.mp4")}) == 2
    print(f"Gymnasium {gymnasium.__version__}: {', '.join(MODES)} bit-identical, {len(WRAPPERS)} vector wrappers")
