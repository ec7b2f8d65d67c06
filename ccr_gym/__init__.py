"""Gymnasium environments for contact-aware control of a cable-driven continuum robot; importing registers them."""

from ccr_gym.env import ContactEnv
from ccr_gym.registration import ENV_IDS, register_envs
from ccr_gym.reward import RewardWeights
from ccr_gym.settings import Settings, SpatialSettings
from ccr_gym.tasks import LoadCell, PushObstacle, SpatialPush, Task
from ccr_gym.vector_env import ContactVectorEnv

__all__ = [
    "ENV_IDS",
    "ContactEnv",
    "ContactVectorEnv",
    "LoadCell",
    "PushObstacle",
    "RewardWeights",
    "Settings",
    "SpatialPush",
    "SpatialSettings",
    "Task",
]
__version__ = "0.1.0"

register_envs()
