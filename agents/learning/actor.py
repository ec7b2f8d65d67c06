"""A trained policy alone: the small network that acts, its normaliser, its configuration and its learning curve.

One file holds all of it: tensors, of which the weights in half precision, and text, no code. Neither the learner nor
its critics are needed.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.running_mean_std import RunningMeanStd
from torch import nn

import ccr_gym  # noqa: F401 - registers the ids
from agents.config import TrainConfig
from agents.errors import UserError
from agents.learning.memory import Memory
from agents.learning.tensors import read_tensors, write_tensors
from agents.policy import Observation
from agents.tuned import LearnerSettings, RecurrentPPOSettings, SACSettings

SUFFIX = ".safetensors"
ACTOR = f"actor{SUFFIX}"
FORMAT = 2
WEIGHTS = "weights."  # before the names of the network's tensors
CLIP = 10.0  # of scaled rows
EPSILON = 1e-8  # of their variance


@dataclass(frozen=True, slots=True)
class Curve:
    """Mean return of validation episodes during training.

    Attributes:
        steps: Environment steps done.
        returns: Mean return after them.
    """

    steps: tuple[int, ...]
    returns: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Training:
    """How a policy was made.

    Attributes:
        config: Of the run, without its folder.
        curve: Its learning curve.
        seconds: What it took [s].
    """

    config: TrainConfig
    curve: Curve
    seconds: float


class Network(nn.Module):
    """From a scaled row to the mean action.

    Args:
        inputs: Numbers of a row.
        actions: Numbers of an action.
        settings: Of the learner, which say how many units there are.
    """

    def __init__(self, inputs: int, actions: int, settings: LearnerSettings) -> None:
        super().__init__()
        width, self.squashed = settings.width, isinstance(settings, SACSettings)
        self.lstm = nn.LSTM(inputs, settings.hidden) if isinstance(settings, RecurrentPPOSettings) else None
        sizes = [inputs, width, width] if self.lstm is None else [self.lstm.hidden_size, width]
        layers: list[nn.Module] = []
        for before, after in pairwise(sizes):
            layers += [nn.Linear(before, after), nn.ReLU() if self.squashed else nn.Tanh()]
        self.layers = nn.Sequential(*layers, nn.Linear(width, actions))

    def forward(self, row: torch.Tensor, state: Any = None) -> tuple[torch.Tensor, Any]:
        """Action ``(1, actions)`` of a row ``(1, inputs)``, and what the LSTM keeps."""
        if self.lstm is not None:
            row, state = self.lstm(row, state)
        action = self.unbounded(row)
        return torch.tanh(action) if self.squashed else action.clip(-1.0, 1.0), state

    def unbounded(self, row: torch.Tensor) -> torch.Tensor:
        """What is cut or squashed to the bounds of actions."""
        return torch.as_tensor(self.layers(row))

    @classmethod
    def of(cls, policy: BasePolicy, settings: LearnerSettings) -> "Network":
        """The network of a learner's policy."""
        assert isinstance(policy.observation_space, spaces.Box)
        assert isinstance(policy.action_space, spaces.Box)
        network = cls(policy.observation_space.shape[0], policy.action_space.shape[0], settings)
        trained: Any = policy
        if network.squashed:
            parts = [*trained.actor.latent_pi, trained.actor.mu]
        else:
            parts = [*trained.mlp_extractor.policy_net, trained.action_net]
        for mine, theirs in zip(network.layers, parts, strict=True):
            mine.load_state_dict(theirs.state_dict())
        if network.lstm is not None:
            network.lstm.load_state_dict(trained.lstm_actor.state_dict())
        return network


def scaled(rows: np.ndarray, mean: np.ndarray, deviation: np.ndarray) -> torch.Tensor:
    """Rows as a network takes them."""
    return torch.as_tensor(np.clip((rows - mean) / deviation, -CLIP, CLIP), dtype=torch.float32)


def deviation(seen: RunningMeanStd) -> np.ndarray:
    """What rows are divided by."""
    return np.asarray(np.sqrt(seen.var + EPSILON))


def export(path: Path, network: Network, seen: RunningMeanStd, training: Training) -> None:
    """Write an actor.

    Args:
        path: Of its file.
        network: Trained on scaled rows.
        seen: Mean and variance that rows are scaled by.
        training: How it was made.

    Raises:
        UserError: If it cannot be written.
    """
    weights = {f"{WEIGHTS}{name}": value.half() for name, value in network.state_dict().items()}
    scaling = {"mean": torch.tensor(seen.mean), "deviation": torch.tensor(deviation(seen))}
    values = {
        "format": FORMAT,
        "config": replace(training.config, run=Path()).dumps(),
        "training": {**asdict(training.curve), "seconds": training.seconds},
    }
    write_tensors(path, weights | {name: value.float() for name, value in scaling.items()}, values)


@contextmanager
def _refusing_others(path: Path) -> Iterator[None]:
    """While a file is read: whatever goes wrong is told as what it is."""
    try:
        yield
    except Exception as error:
        raise UserError(f"{path} is not a trained policy: {error!r}") from error


def _training(tensors: Mapping[str, torch.Tensor], values: Mapping[str, Any]) -> Training:
    """How the policy of a file was made."""
    if values["format"] != FORMAT:
        raise ValueError(f"its format is {values['format']}; this version reads {FORMAT}: train it anew")
    if not all(tensor.isfinite().all() for tensor in tensors.values()):
        raise ValueError("its weights are not finite")
    told = values["training"]
    curve = Curve(tuple(told["steps"]), tuple(told["returns"]))
    return Training(TrainConfig.loads(values["config"]), curve, float(told["seconds"]))


class LearnedPolicy:
    """A trained policy.

    Args:
        path: Its file, or the folder of the run that made it.

    Attributes:
        name: Of the learner.
        training: How it was made.

    Raises:
        FileNotFoundError: If there is no such file.
        UserError: If it is something else.
    """

    def __init__(self, path: Path) -> None:
        path = path if path.suffix == SUFFIX else path / ACTOR
        if not path.is_file():
            raise FileNotFoundError(f"{path} is missing; train first: ccr-gym train --run {path.parent}")
        with _refusing_others(path):
            tensors, values = read_tensors(path)
            self.training = _training(tensors, values)
        config = self.training.config
        self.name, self._state = config.learner.name, None
        env: Any = gymnasium.make(config.env_id, sensing=config.sensing, disable_env_checker=True)
        self._sizes = {key: box.shape for key, box in env.observation_space.items()}
        recurrent = isinstance(config.learner, RecurrentPPOSettings)
        self._memory = None if recurrent else Memory(env.observation_space, 1, env.get_wrapper_attr("settings"))
        inputs = spaces.flatdim(env.observation_space) if self._memory is None else self._memory.size
        with _refusing_others(path):
            self._mean, self._deviation = (tensors[name].numpy().reshape(inputs) for name in ("mean", "deviation"))
            self._network = Network(inputs, env.action_space.shape[0], config.learner)
            weights = {name: value.float() for name, value in tensors.items() if name.startswith(WEIGHTS)}
            self._network.load_state_dict({name.removeprefix(WEIGHTS): value for name, value in weights.items()})

    def reset(self, env: Any = None) -> None:
        """Forget the episode before."""
        self._state = None
        if self._memory is not None:
            self._memory.forget()

    def act(self, observation: Observation) -> np.ndarray:
        """The mean action for a dictionary observation.

        Raises:
            ValueError: If the observation is not that of its environment with the sensing it was trained with.
        """
        sizes = {key: value.shape for key, value in observation.items()}
        if sizes != self._sizes:
            trained = f"{self.training.config.env_id} with {self.training.config.sensing} sensing"
            raise ValueError(f"the observation has the shapes {sizes}; those of {trained} are {self._sizes}")
        rows = {key: value[None] for key, value in observation.items()}
        row = np.concatenate(list(rows.values()), axis=1) if self._memory is None else self._memory.recall(rows)
        with torch.no_grad():
            action, self._state = self._network(scaled(row, self._mean, self._deviation), self._state)
        return np.asarray(action[0].numpy())
