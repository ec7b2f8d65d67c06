"""Minari records data sets, infos included, and finds their environment again."""

import gymnasium
import minari
import numpy as np
from minari import DataCollector

import ccr_gym  # noqa: F401 - registers the ids

DATA = {"CCR/PushObstacle-v1": "ccr/push-obstacle/random-v0", "CCR/SpatialPush-v1": "ccr/spatial-push/random-v0"}


def record(env_id: str, dataset_id: str) -> int:
    env = DataCollector(gymnasium.make(env_id), record_infos=True)
    env.action_space.seed(0)
    for seed in range(3):
        env.reset(seed=seed)
        truncated = False
        while not truncated:
            _, _, _, truncated, _ = env.step(env.action_space.sample())
    if dataset_id in minari.list_local_datasets():
        minari.delete_dataset(dataset_id)
    env.create_dataset(dataset_id=dataset_id, algorithm_name="random", eval_env=env_id)
    env.close()
    data = minari.load_dataset(dataset_id)
    replay, episode = data.recover_environment(), data[1]
    rows = [replay.reset(seed=1)[0], *(replay.step(action)[0] for action in episode.actions)]
    assert np.array_equal(rows, episode.observations)
    assert len(episode.infos["tension"]) == len(rows)
    return data.total_steps


if __name__ == "__main__":
    steps = sum(record(*pair) for pair in DATA.items())
    print(f"Minari {minari.__version__}: {len(DATA)} data sets of {steps} steps, replayed bit by bit")
