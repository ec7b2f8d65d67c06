"""Registration of the environments."""

import gymnasium

from ccr_gym.envs import (
    BracedPushEnv,
    InsertAndPushEnv,
    LoadCellEnv,
    MovingObstacleEnv,
    PushObstacleEnv,
    SoftObstacleEnv,
    SpatialPushEnv,
    TaskEnv,
    TrackForceEnv,
)
from ccr_gym.vector_env import make_vector_env

PAPER = {"model": "paper", "estimator": "paper", "regulate": "estimate"}  # the paper's system to the letter
TASK_ENVS: tuple[type[TaskEnv], ...] = (
    LoadCellEnv,
    PushObstacleEnv,
    TrackForceEnv,
    BracedPushEnv,
    SoftObstacleEnv,
    MovingObstacleEnv,
    InsertAndPushEnv,
    SpatialPushEnv,
)
PAPER_ENVS: tuple[type[TaskEnv], ...] = (LoadCellEnv, PushObstacleEnv, SpatialPushEnv)
ENV_IDS: dict[str, type[TaskEnv]] = {
    **{f"CCR/{env.task_class.__name__}-v1": env for env in TASK_ENVS},
    **{f"CCR/{env.task_class.__name__}-Paper-v1": env for env in PAPER_ENVS},
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
                kwargs={"task_name": env_class.task_class.__name__, **(PAPER if "-Paper-" in env_id else {})},
            )
