"""Gymnasium environments for contact-aware control of a cable-driven continuum robot; importing registers them."""

from ccr_gym.env import ContactEnv
from ccr_gym.episodes import PrivilegedState
from ccr_gym.observation import AHEAD, FORCE_SCALE_N
from ccr_gym.registration import ENV_IDS, register_envs
from ccr_gym.reward import RewardWeights
from ccr_gym.sensing import Sensing
from ccr_gym.settings import InsertionSettings, Settings, SpatialSettings
from ccr_gym.tasks import (
    BracedPush,
    InsertAndPush,
    LoadCell,
    PushObstacle,
    SoftObstacle,
    SpatialPush,
    Task,
    TrackForce,
)
from ccr_gym.vector_env import ContactVectorEnv

__all__ = [
    "AHEAD",
    "ENV_IDS",
    "FORCE_SCALE_N",
    "BracedPush",
    "ContactEnv",
    "ContactVectorEnv",
    "InsertAndPush",
    "InsertionSettings",
    "LoadCell",
    "PrivilegedState",
    "PushObstacle",
    "RewardWeights",
    "Sensing",
    "Settings",
    "SoftObstacle",
    "SpatialPush",
    "SpatialSettings",
    "Task",
    "TrackForce",
]
__version__ = "0.1.0"

register_envs()
