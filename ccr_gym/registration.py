"""Ids of the environments."""

import gymnasium

MAX_EPISODE_STEPS = 64

ENV_IDS = {
    "CCR/LoadCell-v0": "ccr_gym.environments:LoadCell",
    "CCR/PushObstacle-v0": "ccr_gym.environments:PushObstacle",
    "CCR/SpatialPush-v0": "ccr_gym.environments:SpatialPush",
}


def register_envs() -> None:
    """Register every id that is not registered yet."""
    for env_id, entry_point in ENV_IDS.items():
        if env_id not in gymnasium.registry:
            gymnasium.register(
                env_id,
                entry_point=f"{entry_point}Env",
                vector_entry_point=f"{entry_point}VectorEnv",
                max_episode_steps=MAX_EPISODE_STEPS,
            )
