"""Registration of the environments."""

import gymnasium

from ccr_gym.envs import (
    BracedPushEnv,
    InsertAndPushEnv,
    LoadCellEnv,
    PushObstacleEnv,
    SoftObstacleEnv,
    SpatialPushEnv,
    TaskEnv,
    TrackForceEnv,
)
from ccr_gym.vector_env import make_vector_env

ENV_IDS: dict[str, type[TaskEnv]] = {
    "CCR/LoadCell-v0": LoadCellEnv,
    "CCR/PushObstacle-v0": PushObstacleEnv,
    "CCR/TrackForce-v0": TrackForceEnv,
    "CCR/BracedPush-v0": BracedPushEnv,
    "CCR/SoftObstacle-v0": SoftObstacleEnv,
    "CCR/InsertAndPush-v0": InsertAndPushEnv,
    "CCR/SpatialPush-v0": SpatialPushEnv,
}


def register_envs() -> None:
    """Register every id that is not registered yet."""
    for env_id, env_class in ENV_IDS.items():
        if env_id not in gymnasium.registry:
            gymnasium.register(
                env_id,
                entry_point=f"{env_class.__module__}:{env_class.__name__}",
                vector_entry_point=f"{make_vector_env.__module__}:{make_vector_env.__name__}",
                max_episode_steps=env_class.task_class.steps,
                kwargs={"task_name": env_class.task_class.__name__},
            )
