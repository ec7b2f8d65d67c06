"""Where files of trained policies are kept."""

from pathlib import Path

from agents.arguments import check_kind
from agents.config import PRETRAINED

SUFFIX = ".safetensors"


def trained(learner: str, env_id: str, folder: Path = PRETRAINED) -> tuple[Path, ...]:
    """Return the files of the policies that a learner trained on an environment, in the order of their seeds.

    Args:
        learner: ``"PPO"``, ``"RecurrentPPO"``, ``"SAC"`` or ``"Distilled"``.
        env_id: Id of the environment.
        folder: Folder of trained policies, as ``ccr-gym retrain`` writes it; by default those in the package.

    Raises:
        TypeError: If a name is no text or the folder no path.
    """
    check_kind("learner", learner, str, "give the name of a learner")
    check_kind("env_id", env_id, str, "give the id of an environment")
    check_kind("folder", folder, Path, "give a pathlib.Path")
    return tuple(sorted((folder / learner / folder_name(env_id)).glob(f"*{SUFFIX}")))


def folder_name(env_id: str) -> str:
    """Return the name of an environment's folder."""
    return env_id.split("/")[-1]
