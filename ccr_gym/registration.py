"""Ids of the environments."""

import gymnasium

ENV_IDS = {  # entry points, and steps of an episode
    "CCR/LoadCell-v0": ("ccr_gym.environments:LoadCell", 64),
    "CCR/PushObstacle-v0": ("ccr_gym.environments:PushObstacle", 64),
    "CCR/TrackForce-v0": ("ccr_gym.environments:TrackForce", 128),
    "CCR/BracedPush-v0": ("ccr_gym.environments:BracedPush", 64),
    "CCR/SoftObstacle-v0": ("ccr_gym.environments:SoftObstacle", 64),
    "CCR/InsertAndPush-v0": ("ccr_gym.environments:InsertAndPush", 64),
    "CCR/SpatialPush-v0": ("ccr_gym.environments:SpatialPush", 64),
}


def register_envs() -> None:
    """Register every id that is not registered yet."""
    for env_id, (entry_point, steps) in ENV_IDS.items():
        if env_id not in gymnasium.registry:
            gymnasium.register(
                env_id,
                entry_point=f"{entry_point}Env",
                vector_entry_point=f"{entry_point}VectorEnv",
                max_episode_steps=steps,
            )
