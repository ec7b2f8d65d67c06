"""Gymnasium environments for contact-aware control of a cable-driven continuum robot; importing it registers them."""

from ccr_gym.imports import check_kernel, check_packages, warn_of_foreign_agents

# ruff: noqa: E402 - the checks come before what they check
check_packages("solver")
check_kernel()
warn_of_foreign_agents()

from ccr_gym.actions import ActionSpec
from ccr_gym.arrays import StepSlopes
from ccr_gym.contact_env import ContactEnv
from ccr_gym.envs import (
    BracedPushEnv,
    InsertAndPushEnv,
    LoadCellEnv,
    MovingObstacleEnv,
    PushObstacleEnv,
    SoftObstacleEnv,
    SpatialPushEnv,
    TrackForceEnv,
)
from ccr_gym.randomization import Randomization
from ccr_gym.readings import PrivilegedState
from ccr_gym.registration import ENV_IDS, register_envs
from ccr_gym.reward import RewardWeights
from ccr_gym.scales import AHEAD, FORCE_SPAN, TENSION_SPAN, Scales
from ccr_gym.sensing import EXACT, Sensing
from ccr_gym.settings import InsertionSettings, Settings, SpatialSettings
from ccr_gym.task import Assignment, Task
from ccr_gym.tasks import (
    BracedPush,
    InsertAndPush,
    LoadCell,
    MovingObstacle,
    PushObstacle,
    SoftObstacle,
    SpatialPush,
    TrackForce,
)
from ccr_gym.vector_env import ContactVectorEnv, make_vector_env

__all__ = [
    "AHEAD",
    "ENV_IDS",
    "EXACT",
    "FORCE_SPAN",
    "TENSION_SPAN",
    "ActionSpec",
    "Assignment",
    "BracedPush",
    "BracedPushEnv",
    "ContactEnv",
    "ContactVectorEnv",
    "InsertAndPush",
    "InsertAndPushEnv",
    "InsertionSettings",
    "LoadCell",
    "LoadCellEnv",
    "MovingObstacle",
    "MovingObstacleEnv",
    "PrivilegedState",
    "PushObstacle",
    "PushObstacleEnv",
    "Randomization",
    "RewardWeights",
    "Scales",
    "Sensing",
    "Settings",
    "SoftObstacle",
    "SoftObstacleEnv",
    "SpatialPush",
    "SpatialPushEnv",
    "SpatialSettings",
    "StepSlopes",
    "Task",
    "TrackForce",
    "TrackForceEnv",
    "check_packages",
    "make_vector_env",
    "register_envs",
]
__version__ = "0.1.0"

register_envs()
