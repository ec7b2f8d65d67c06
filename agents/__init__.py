"""Controllers, trained policies, the benchmark and the ``ccr-gym`` command, on top of :mod:`ccr_gym`.

Every name below is imported when it is first used, so that ``import agents`` loads no learning library.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from agents.benchmark.evaluate import Episode as Episode
    from agents.benchmark.evaluate import Metrics as Metrics
    from agents.benchmark.evaluate import measure as measure
    from agents.benchmark.evaluate import run_episode as run_episode
    from agents.benchmark.evaluate import run_episodes as run_episodes
    from agents.benchmark.evaluate import scores as scores
    from agents.controllers.force import ForceController as ForceController
    from agents.controllers.harmonic import HarmonicController as HarmonicController
    from agents.controllers.mpc import PredictiveController as PredictiveController
    from agents.controllers.newton import NewtonController as NewtonController
    from agents.estimation.robot import Knowledge as Knowledge
    from agents.estimation.robot import RobotEstimator as RobotEstimator
    from agents.learning.actor import LearnedPolicy as LearnedPolicy
    from agents.learning.differentiable import differentiable as differentiable
    from agents.learning.differentiable_env import DifferentiableVectorEnv as DifferentiableVectorEnv
    from agents.learning.memory import MemoryVecEnv as MemoryVecEnv
    from agents.learning.pretrained import trained as trained
    from agents.learning.sb3_adapter import SB3VecEnv as SB3VecEnv
    from agents.paper.reproduce import reproduce as reproduce
    from agents.policy import Observation as Observation
    from agents.policy import Policy as Policy
    from agents.policy import search as search
    from agents.replay.estimate import estimate_log as estimate_log
    from agents.replay.log import read_log as read_log
    from agents.replay.robots import read_robot as read_robot
    from agents.replay.robots import robot_json as robot_json
    from agents.replay.scenes import read_scene as read_scene
    from agents.replay.scenes import scene_json as scene_json
    from agents.replay.sensing import read_instruments as read_instruments

PART_OF = "ccr-gym"  # tells this package from others of its name
_MODULES = {
    "DifferentiableVectorEnv": "learning.differentiable_env",
    "Episode": "benchmark.evaluate",
    "ForceController": "controllers.force",
    "HarmonicController": "controllers.harmonic",
    "Knowledge": "estimation.robot",
    "LearnedPolicy": "learning.actor",
    "MemoryVecEnv": "learning.memory",
    "Metrics": "benchmark.evaluate",
    "NewtonController": "controllers.newton",
    "Observation": "policy",
    "Policy": "policy",
    "PredictiveController": "controllers.mpc",
    "RobotEstimator": "estimation.robot",
    "SB3VecEnv": "learning.sb3_adapter",
    "differentiable": "learning.differentiable",
    "estimate_log": "replay.estimate",
    "measure": "benchmark.evaluate",
    "read_instruments": "replay.sensing",
    "read_log": "replay.log",
    "read_robot": "replay.robots",
    "read_scene": "replay.scenes",
    "reproduce": "paper.reproduce",
    "robot_json": "replay.robots",
    "run_episode": "benchmark.evaluate",
    "run_episodes": "benchmark.evaluate",
    "scene_json": "replay.scenes",
    "scores": "benchmark.evaluate",
    "search": "policy",
    "trained": "learning.pretrained",
}
__all__ = list(_MODULES)


def __getattr__(name: str) -> object:
    """Import a public name on its first use."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(importlib.import_module(f"{__name__}.{_MODULES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return all names, including those not imported yet."""
    return sorted({*globals(), *_MODULES})
