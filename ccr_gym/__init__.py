"""Gymnasium environments for contact-aware control of a cable-driven continuum robot; importing registers them."""

from ccr_gym.env import ContactEnv
from ccr_gym.registration import ENV_IDS, register_envs
from ccr_gym.reward import RewardWeights
from ccr_gym.tasks import LoadCell, PushObstacle, Task

__all__ = ["ENV_IDS", "ContactEnv", "LoadCell", "PushObstacle", "RewardWeights", "Task"]
__version__ = "0.1.0"

register_envs()
