"""Checkpoints: all that a run needs to go on, in one file of tensors and numbers.

A run goes on with the weights, the optimisers' moments, the scaling of observations and rewards, the replay buffer or
the imitated actions, its counters and its learning curve. Its episodes are new: their seeds, and that of exploration,
follow from the seed of the run and the steps done.
"""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.running_mean_std import RunningMeanStd

from agents.config import VALIDATION_SEED, TrainConfig
from agents.errors import UserError
from agents.learning.tensors import read_tensors, write_tensors

CHECKPOINT = "checkpoint.safetensors"
CHECKPOINTS = 20  # in a run, at most
WRITING = 0.05  # share of a run's time that writing them may take
REPLAY = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
Tensors = dict[str, torch.Tensor]


@dataclass(slots=True)
class Progress:
    """How far a run is.

    Attributes:
        steps: Environment steps done.
        seconds: What they took [s].
        curve_steps: Steps after which the policy was validated.
        curve_returns: Its mean returns then.
    """

    steps: int = 0
    seconds: float = 0.0
    curve_steps: list[int] = field(default_factory=list)
    curve_returns: list[float] = field(default_factory=list)

    def validated(self, steps: int, mean_return: float) -> None:
        """Add a point to the curve."""
        self.curve_steps.append(steps)
        self.curve_returns.append(mean_return)


@dataclass(frozen=True, slots=True)
class State:
    """What a learner goes on with.

    Attributes:
        tensors: By name.
        counters: By name.
    """

    tensors: Tensors
    counters: dict[str, int] = field(default_factory=dict)


class Run:
    """A run in its folder: how far it is, what was kept of it, and when that is to be kept next.

    Args:
        config: Of the run.

    Attributes:
        config: Of the run.
        progress: How far it is.
        state: What its learner goes on with; none where it begins.
        seed: That of its configuration where it begins; where it goes on another, so that the scenes are new.

    Raises:
        UserError: If its checkpoint is damaged.
    """

    def __init__(self, config: TrainConfig) -> None:
        self.config, self.progress, self.state = config, Progress(), None
        self._path = config.run / CHECKPOINT
        if self._path.exists():
            with self.refusing_damage():
                tensors, values = read_tensors(self._path)
                self.progress, self.state = Progress(**values["progress"]), State(tensors, values["counters"])
        self._began = time.perf_counter() - self.progress.seconds
        self.seed = config.seed if self.state is None else _another_seed(config, self.progress.steps)
        self._plan(0.0)

    @property
    def seconds(self) -> float:
        """What it has taken so far [s]."""
        return time.perf_counter() - self._began

    def keep(self, steps: int, state: Callable[[], State]) -> None:
        """Write a checkpoint in the place of the one before, if it is time.

        Args:
            steps: Environment steps done and learnt from.
            state: Gives what is to be kept.

        Raises:
            UserError: If it cannot be written; the one before is kept.
        """
        began = self.seconds
        if steps >= self._next and began >= self._rested:
            self.progress.steps, self.progress.seconds = steps, began
            kept, progress = state(), {name: getattr(self.progress, name) for name in Progress.__slots__}
            write_tensors(self._path, kept.tensors, {"progress": progress, "counters": kept.counters})
            self._plan(self.seconds - began)

    @contextmanager
    def refusing_damage(self) -> Iterator[None]:
        """While a checkpoint is read: whatever goes wrong is told as what it is.

        Raises:
            UserError: If anything does.
        """
        try:
            yield
        except Exception as error:
            raise UserError(f"{self._path} is damaged ({error!r}); begin again with --restart") from error

    def _plan(self, took: float) -> None:
        """Say when the next one is due, after one that took some seconds."""
        self._next = self.progress.steps + max(self.config.learner.steps // CHECKPOINTS, 1)
        self._rested = self.seconds + took / WRITING


def _another_seed(config: TrainConfig, steps: int) -> int:
    drawn = np.random.SeedSequence([config.seed, steps]).generate_state(1)
    return int(drawn[0]) % (VALIDATION_SEED - config.learner.envs)


def learner_state(model: BaseAlgorithm) -> State:
    """What a learner of Stable-Baselines3 goes on with."""
    tensors, counters = flat(model.get_parameters()), {"updates": int(model._n_updates)}
    for name, statistics in _scaling(model).items():
        tensors |= statistics_tensors(name, statistics)
    if isinstance(model, SAC):
        assert model.log_ent_coef is not None
        replay = _replay(model)
        tensors["log_ent_coef"] = model.log_ent_coef
        tensors |= {f"replay.{name}": torch.from_numpy(getattr(replay, name)[: replay.size()]) for name in REPLAY}
        counters |= {"position": replay.pos, "full": int(replay.full)}
    return State(tensors, counters)


def restore_learner(model: BaseAlgorithm, steps: int, state: State) -> None:
    """Bring an untrained learner to where it was after some steps.

    Raises:
        Exception: Any, if the state is not of such a learner.
    """
    model.set_parameters(nested(state.tensors, model.get_parameters()), device="cpu")
    model.num_timesteps, model._n_updates = steps, state.counters["updates"]
    for name, statistics in _scaling(model).items():
        restore_statistics(name, statistics, state.tensors)
    if isinstance(model, SAC):
        assert model.log_ent_coef is not None
        model.log_ent_coef.data.copy_(state.tensors["log_ent_coef"])
        replay = _replay(model)
        replay.pos, replay.full = state.counters["position"], bool(state.counters["full"])
        for name in REPLAY:
            getattr(replay, name)[: replay.size()] = state.tensors[f"replay.{name}"].numpy()


def flat(states: Mapping[str, Mapping[str, Any]]) -> Tensors:
    """State dictionaries of modules and optimisers as tensors with names of their own; :func:`nested` undoes it.

    Of optimisers the moments are kept; their settings are those of the run.
    """
    return {f"{name}/{key}": tensor for name, state in states.items() for key, tensor in _entries(state).items()}


def nested(tensors: Tensors, states: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """State dictionaries like some others, filled with what is kept."""
    filled: dict[str, Any] = {}
    for name, state in states.items():
        entries = {key.removeprefix(f"{name}/"): t for key, t in tensors.items() if key.startswith(f"{name}/")}
        filled[name] = {**state, "state": _moments(entries)} if "param_groups" in state else entries
    return filled


def _entries(state: Mapping[str, Any]) -> Mapping[str, torch.Tensor]:
    if "param_groups" not in state:
        return state
    return {f"{index}.{key}": tensor for index, moments in state["state"].items() for key, tensor in moments.items()}


def _moments(entries: Tensors) -> dict[int, Tensors]:
    moments: dict[int, Tensors] = {}
    for name, tensor in entries.items():
        index, key = name.split(".")
        moments.setdefault(int(index), {})[key] = tensor
    return moments


def statistics_tensors(name: str, statistics: RunningMeanStd) -> Tensors:
    """Running mean and variance as tensors, in double precision."""
    values = {"mean": statistics.mean, "var": statistics.var, "count": statistics.count}
    return {f"{name}.{key}": torch.tensor(value, dtype=torch.float64) for key, value in values.items()}


def restore_statistics(name: str, statistics: RunningMeanStd, tensors: Tensors) -> None:
    """Undo :func:`statistics_tensors`."""
    mean, var, count = (tensors[f"{name}.{key}"].numpy() for key in ("mean", "var", "count"))
    shape = np.shape(statistics.mean)
    statistics.mean, statistics.var, statistics.count = mean.reshape(shape), var.reshape(shape), float(count)


def _scaling(model: BaseAlgorithm) -> dict[str, RunningMeanStd]:
    """Of observations and of rewards."""
    normalizer = model.get_vec_normalize_env()
    assert normalizer is not None
    assert isinstance(normalizer.obs_rms, RunningMeanStd)
    return {"observations": normalizer.obs_rms, "returns": normalizer.ret_rms}


def _replay(model: SAC) -> ReplayBuffer:
    assert isinstance(model.replay_buffer, ReplayBuffer)
    return model.replay_buffer
