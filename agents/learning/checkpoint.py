"""Checkpoints: everything that resumes a training run, in one file of tensors and JSON.

That is the weights, the moments of the optimisers, the normalisation of observations and rewards, the replay buffer or
the imitated actions, the counters and the learning curve. A resumed run plays new episodes, up to the step in which it
was left: their seeds, and that of exploration, follow from the seed of the run and the number of steps done.
"""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any

import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.running_mean_std import RunningMeanStd

from agents.arguments import check_real, check_whole
from agents.config import VALIDATION_SEED, TrainConfig
from agents.errors import UserError
from agents.files import JsonObject
from agents.learning.checks import (
    Form,
    check_curve,
    check_names,
    check_tensors,
    moment_forms,
)
from agents.learning.learners import WARM_UP
from agents.learning.tensors import Tensors, read_tensors, write_tensors
from agents.tuned import DistilledSettings, LearnerSettings, SACSettings, round_steps

CHECKPOINT = "checkpoint.safetensors"
CHECKPOINTS = 20  # per run, at most
WRITING = 0.05  # largest share of a run's time that may be spent on writing them
REPLAY = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
StateDict = dict[str, Any]  # torch's: tensors, numbers, lists and further mappings


@dataclass(slots=True)
class Progress:
    """Progress of a run.

    Attributes:
        steps: Environment steps done.
        seconds: Their duration [s].
        curve_steps: Environment steps before each validation.
        curve_returns: Mean return of each validation.
    """

    steps: int = 0
    seconds: float = 0.0
    curve_steps: list[int] = field(default_factory=list)
    curve_returns: list[float] = field(default_factory=list)

    def add_validation(self, steps: int, mean_return: float) -> None:
        """Add a point to the learning curve."""
        self.curve_steps.append(steps)
        self.curve_returns.append(mean_return)


@dataclass(frozen=True, slots=True)
class LearnerState:
    """What a learner is resumed from.

    Attributes:
        tensors: Tensors by name.
        counters: Counters by name.
    """

    tensors: Tensors
    counters: dict[str, int] = field(default_factory=dict)


class TrainingRun:
    """A training run: its progress, its last checkpoint, and when the next one is due.

    Args:
        config: Configuration of the run.

    Attributes:
        config: Configuration of the run.
        progress: Progress so far.
        state: State of the learner in the checkpoint; ``None`` for a new run.
        seed: Seed of the configuration for a new run; another one for a resumed run, so that its scenes are new.

    Raises:
        UserError: If the checkpoint is damaged.
    """

    def __init__(self, config: TrainConfig) -> None:
        self.config, self.progress = config, Progress()
        self.state: LearnerState | None = None
        self._path = config.run / CHECKPOINT
        if self._path.exists():
            with self.rejecting_damage():
                tensors, values = read_tensors(self._path)
                self.progress = _progress(values["progress"], config.learner)
                self.state = LearnerState(tensors, _counters(values["counters"], config.learner, self.progress.steps))
        self._began = time.perf_counter() - self.progress.seconds
        self.seed = config.seed if self.state is None else _resumed_seed(config, self.progress.steps)
        self._schedule(0.0)

    @property
    def seconds(self) -> float:
        """Duration so far [s]."""
        return time.perf_counter() - self._began

    def save_if_due(self, steps: int, state: Callable[[], LearnerState]) -> None:
        """Replace the checkpoint if the next one is due.

        Args:
            steps: Environment steps done and learned from.
            state: Returns the state of the learner.

        Raises:
            UserError: If it cannot be written; the last checkpoint then stays.
        """
        began = self.seconds
        if steps >= self._next_steps and began >= self._next_seconds:
            self.progress.steps, self.progress.seconds = steps, began
            saved, progress = state(), {name: getattr(self.progress, name) for name in Progress.__slots__}
            write_tensors(self._path, saved.tensors, {"progress": progress, "counters": saved.counters})
            self._schedule(self.seconds - began)

    @contextmanager
    def rejecting_damage(self) -> Iterator[None]:
        """Report every error while a checkpoint is read as a damaged checkpoint.

        Raises:
            UserError: In place of any exception.
        """
        try:
            yield
        except Exception as error:
            raise UserError(f"{self._path} is damaged ({error!r}); start the run again with --restart") from error

    def _schedule(self, duration: float) -> None:
        """Set when the next checkpoint is due, after one that took some seconds."""
        self._next_steps = self.progress.steps + max(self.config.learner.steps // CHECKPOINTS, 1)
        self._next_seconds = self.seconds + duration / WRITING


def _progress(values: JsonObject, learner: LearnerSettings) -> Progress:
    """Return the progress that a checkpoint holds.

    Raises:
        Exception: Of any kind, if a run with these settings cannot have made it.
    """
    check_names(values, Progress.__slots__)
    round_ = round_steps(learner)
    steps = check_whole("steps", values["steps"], round_, max(learner.steps, round_))
    if steps % round_:
        raise ValueError(f"steps is {steps}; it must be a multiple of {round_}, after which the learner learns")
    curve = check_curve(values["curve_steps"], values["curve_returns"], steps)
    return Progress(steps, check_real("seconds", values["seconds"], 0.0), *curve)


def _counters(values: JsonObject, learner: LearnerSettings, steps: int) -> dict[str, int]:
    """Return the counters that a checkpoint holds.

    Raises:
        Exception: Of any kind, if they are not those of a learner after these steps.
    """
    rounds, counters = steps // round_steps(learner), {}
    if isinstance(learner, SACSettings):
        size = max(learner.buffer // learner.envs, 1)
        counters = {"position": rounds % size, "full": int(rounds >= size)}
        counters["updates"] = max(0, rounds - WARM_UP) * learner.gradient_steps
    elif not isinstance(learner, DistilledSettings):
        counters = {"updates": rounds * learner.epochs}
    check_names(values, counters)
    for name, value in counters.items():
        if type(values[name]) is not int or values[name] != value:
            raise ValueError(f"{name} is {values[name]!r:.80}; after {steps} steps it must be {value}")
    return counters


def _resumed_seed(config: TrainConfig, steps: int) -> int:
    (seed,) = np.random.SeedSequence([config.seed, steps]).generate_state(1)
    return int(seed) % (VALIDATION_SEED - config.learner.envs)


def learner_state(model: BaseAlgorithm) -> LearnerState:
    """Return the state of a learner of Stable-Baselines3."""
    tensors, counters = flatten_states(model.get_parameters()), {"updates": int(model._n_updates)}
    for name, statistics in _normalization(model).items():
        tensors |= statistics_tensors(name, statistics)
    if isinstance(model, SAC):
        assert model.log_ent_coef is not None
        replay = _replay(model)
        tensors["log_ent_coef"] = model.log_ent_coef
        tensors |= {f"replay.{name}": torch.from_numpy(getattr(replay, name)[: replay.size()]) for name in REPLAY}
        counters |= {"position": replay.pos, "full": int(replay.full)}
    return LearnerState(tensors, counters)


def restore_learner(model: BaseAlgorithm, steps: int, state: LearnerState) -> None:
    """Put an untrained learner into a saved state, after some steps.

    Raises:
        Exception: Of any kind, if the state is that of another learner or damaged; the learner is then unchanged.
    """
    check_tensors(state.tensors, _forms(model, state.counters))
    states = nest_states(state.tensors, model.get_parameters())
    model.set_parameters(states, device="cpu")  # type: ignore[arg-type] # takes more than its annotation says
    model.num_timesteps, model._n_updates = steps, state.counters["updates"]
    for name, statistics in _normalization(model).items():
        restore_statistics(name, statistics, state.tensors)
    if isinstance(model, SAC):
        assert model.log_ent_coef is not None
        model.log_ent_coef.data.copy_(state.tensors["log_ent_coef"])
        replay = _replay(model)
        replay.pos, replay.full = state.counters["position"], bool(state.counters["full"])
        for name in REPLAY:
            getattr(replay, name)[: replay.size()] = state.tensors[f"replay.{name}"].numpy()


def _forms(model: BaseAlgorithm, counters: Mapping[str, int]) -> dict[str, Form]:
    """Return the forms of the tensors of a learner with these counters."""
    forms = {name: Form.of(tensor) for name, tensor in learner_state(model).tensors.items()}
    if counters["updates"]:
        for name in model.get_parameters():
            if name.endswith("optimizer"):
                forms |= moment_forms(name, attrgetter(name)(model))
    if isinstance(model, SAC):
        replay = _replay(model)
        size = replay.buffer_size if counters["full"] else counters["position"]
        arrays = {f"replay.{name}": torch.from_numpy(getattr(replay, name)) for name in REPLAY}
        forms |= {name: Form((size, *array.shape[1:]), array.dtype) for name, array in arrays.items()}
    return forms


def flatten_states(states: Mapping[str, StateDict]) -> Tensors:
    """Return the tensors of state dictionaries under unique names; :func:`nest_states` is the inverse.

    Only the moments of optimisers are kept; their settings are those of the run.
    """
    return {f"{name}/{key}": tensor for name, state in states.items() for key, tensor in _entries(state).items()}


def nest_states(tensors: Tensors, states: Mapping[str, StateDict]) -> dict[str, StateDict]:
    """Return state dictionaries of the structure of ``states``, with the values of ``tensors``."""
    nested: dict[str, StateDict] = {}
    for name, state in states.items():
        entries = {key.removeprefix(f"{name}/"): t for key, t in tensors.items() if key.startswith(f"{name}/")}
        nested[name] = {**state, "state": _moments(entries)} if "param_groups" in state else {**entries}
    return nested


def _entries(state: StateDict) -> Mapping[str, torch.Tensor]:
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
    """Return running mean, variance and count as tensors in double precision."""
    values = {"mean": statistics.mean, "var": statistics.var, "count": statistics.count}
    return {f"{name}.{key}": torch.tensor(value, dtype=torch.float64) for key, value in values.items()}


def restore_statistics(name: str, statistics: RunningMeanStd, tensors: Tensors) -> None:
    """Set running statistics from the tensors of :func:`statistics_tensors`, which have been checked."""
    mean, var, count = (tensors[f"{name}.{key}"].numpy() for key in ("mean", "var", "count"))
    statistics.mean, statistics.var, statistics.count = mean, var, float(count)


def _normalization(model: BaseAlgorithm) -> dict[str, RunningMeanStd]:
    normalizer = model.get_vec_normalize_env()
    assert normalizer is not None
    assert isinstance(normalizer.obs_rms, RunningMeanStd)
    return {"observations": normalizer.obs_rms, "returns": normalizer.ret_rms}


def _replay(model: SAC) -> ReplayBuffer:
    assert isinstance(model.replay_buffer, ReplayBuffer)
    return model.replay_buffer
