"""Trained policies and their files.

A file holds the acting network, the normalisation of its inputs, its configuration and its learning curve, as tensors
(weights in half precision) and JSON: no code, and neither the learner nor its critics.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.running_mean_std import RunningMeanStd

from agents.arguments import check_kind, check_real
from agents.config import TrainConfig
from agents.environment import Environment, make_env, require_entries
from agents.errors import UserError
from agents.files import JsonObject
from agents.learning.checks import Form, check_curve, check_tensors
from agents.learning.memory import Memory
from agents.learning.network import LSTMState, Network, normalized, standard_deviation
from agents.learning.pretrained import SUFFIX
from agents.learning.tensors import read_tensors, write_tensors
from agents.policy import Observation
from agents.tuned import RecurrentPPOSettings

ACTOR = f"actor{SUFFIX}"
FORMAT = 2
WEIGHTS = "weights."  # prefix of the names of the network's tensors


@dataclass(frozen=True, slots=True)
class LearningCurve:
    """Mean return of validation episodes during training.

    Attributes:
        steps: Environment steps before each validation.
        returns: Mean return of each validation.
    """

    steps: tuple[int, ...]
    returns: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class TrainingRecord:
    """How a policy was trained.

    Attributes:
        config: Configuration of the run, without its folder.
        curve: Learning curve.
        seconds: Duration [s].
    """

    config: TrainConfig
    curve: LearningCurve
    seconds: float


def export(path: Path, network: Network, statistics: RunningMeanStd, training: TrainingRecord) -> None:
    """Write the file of a trained policy.

    Args:
        path: Path of the file.
        network: Network trained on normalised rows.
        statistics: Mean and variance that rows are normalised by.
        training: How it was trained.

    Raises:
        UserError: If the file cannot be written.
    """
    weights = {f"{WEIGHTS}{name}": value.half() for name, value in network.state_dict().items()}
    scaling = {
        "mean": torch.tensor(statistics.mean).float(),
        "deviation": torch.tensor(standard_deviation(statistics)).float(),
    }
    values = {
        "format": FORMAT,
        "config": replace(training.config, run=Path()).dumps(),
        "training": {**asdict(training.curve), "seconds": training.seconds},
    }
    write_tensors(path, weights | scaling, values)


class LearnedPolicy:
    """A trained policy.

    Args:
        path: File of the policy, or the folder of the run that trained it.

    Attributes:
        path: Its file.
        name: Name of the learner.
        training: How it was trained.

    Raises:
        FileNotFoundError: If the file does not exist.
        UserError: If it is not a trained policy.
        TypeError: If ``path`` is no path.
    """

    def __init__(self, path: Path) -> None:
        check_kind("path", path, Path, "give a pathlib.Path")
        self.path = path = path if path.suffix == SUFFIX else path / ACTOR
        if path.is_dir():
            raise UserError(f"{path} is a folder; a trained policy is a file: move it away, and train again")
        if not path.is_file():
            raise FileNotFoundError(f"{path} is missing; train first: ccr-gym train --run {path.parent}")
        with _rejecting(path):
            tensors, values = read_tensors(path)
            self.training = _training(values)
        config = self.training.config
        self.name = config.learner.name
        self._state: LSTMState | None = None
        env = make_env(config.env_id, sensing=config.sensing)
        space: object = env.observation_space
        assert isinstance(space, spaces.Dict)
        self._shapes = {key: box.shape for key, box in space.items()}
        self._memory = None if isinstance(config.learner, RecurrentPPOSettings) else _memory(env, space)
        inputs = spaces.flatdim(space) if self._memory is None else self._memory.size
        with _rejecting(path):
            self._network = Network(inputs, spaces.flatdim(env.action_space), config.learner)
            weights = self._network.state_dict()
            forms = {f"{WEIGHTS}{name}": Form(tuple(value.shape), torch.float16) for name, value in weights.items()}
            check_tensors(tensors, forms | dict.fromkeys(("mean", "deviation"), Form((inputs,))))
            self._mean, self._deviation = (tensors[name].numpy() for name in ("mean", "deviation"))
            self._network.load_state_dict({name: tensors[f"{WEIGHTS}{name}"].float() for name in weights})

    def reset(self, env: Environment | None = None) -> None:
        """Forget the last episode."""
        self._state = None
        if self._memory is not None:
            self._memory.reset()

    def act(self, observation: Observation) -> np.ndarray:
        """Return the mean action for a dictionary observation.

        Raises:
            ValueError: If the observation is none of ``obs_mode="dict"``, or not of the environment and sensing that
                the policy was trained with.
        """
        require_entries(observation)
        shapes = {key: value.shape for key, value in observation.items()}
        if shapes != self._shapes:
            trained = f"{self.training.config.env_id} with {self.training.config.sensing} sensing"
            raise ValueError(
                f"the observation has the shapes {shapes}; the policy was trained on {trained}, whose observation has "
                f"{self._shapes}"
            )
        rows = {key: value[None] for key, value in observation.items()}
        row = np.concatenate(list(rows.values()), axis=1) if self._memory is None else self._memory.update(rows)
        with torch.no_grad():
            action, self._state = self._network(normalized(row, self._mean, self._deviation), self._state)
        return np.asarray(action[0].numpy())


@contextmanager
def _rejecting(path: Path) -> Iterator[None]:
    """Report every error while a file is read as a file that is not a trained policy."""
    try:
        yield
    except Exception as error:
        raise UserError(f"{path} is not a trained policy ({error!r}); remove it, and train again") from error


def _training(values: JsonObject) -> TrainingRecord:
    """Return how the policy of a file was trained.

    Raises:
        Exception: Of any kind, if the file has another format or is damaged.
    """
    if values["format"] != FORMAT:
        raise ValueError(f"its format is {values['format']}, this version reads {FORMAT}; train the policy again")
    training = values["training"]
    steps, returns = check_curve(training["steps"], training["returns"])
    seconds = check_real("seconds", training["seconds"], 0.0)
    return TrainingRecord(TrainConfig.loads(values["config"]), LearningCurve(tuple(steps), tuple(returns)), seconds)


def _memory(env: Environment, space: spaces.Dict) -> Memory:
    return Memory(space, 1, env.get_wrapper_attr("settings"))
