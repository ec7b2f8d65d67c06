"""Ids of the environments."""

import gymnasium

MAX_EPISODE_STEPS = 64

ENV_IDS = {
    "CCR/LoadCell-v0": "ccr_gym.environments:LoadCellEnv",
    "CCR/PushObstacle-v0": "ccr_gym.environments:PushObstacleEnv",
}


def register_envs() -> None:
    """Register every id that is not registered yet."""
    for env_id, entry_point in ENV_IDS.items():
        if env_id not in gymnasium.registry:
            gymnasium.register(env_id, entry_point=entry_point, max_episode_steps=MAX_EPISODE_STEPS)
