"""Imitation of a teacher that knows what is hidden, by a student that sees what every policy sees.

The student acts, the teacher says what it would have done, and the student learns that from all rounds so far: S. Ross,
G. Gordon, D. Bagnell, "A reduction of imitation learning and structured prediction to no-regret online learning"
(DAgger), AISTATS 2011. What cannot be known from the history is averaged over.
"""

from pathlib import Path
from typing import Any

import numpy as np
import torch
from rich.progress import track
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.running_mean_std import RunningMeanStd
from torch import nn
from torch.utils.tensorboard import SummaryWriter

from agents.config import CURVE_POINTS, VALIDATION_EPISODES, VALIDATION_SEED
from agents.learning.actor import EPSILON, Network, deviation, scaled
from agents.learning.checkpoint import Run, State, flat, nested, restore_statistics, statistics_tensors
from agents.learning.learners import environments
from agents.policy import Observation, effort, search
from agents.tuned import DistilledSettings
from ccr_gym import PrivilegedState

PROBE_MM = 0.02  # move that the slope of the force is measured with
LEAST_SLOPE = 1e-3  # slope that is believed [N/mm]
REACHED_N = 2e-5  # error that the teacher leaves


def teach(envs: Any, observation: Observation) -> np.ndarray:
    """What a controller does that knows the true force, its slope, the play and the next set-point, ``(N, actions)``.

    Newton's step to the set-point, with the slope from a trial move of the robots as they are; full speed towards the
    obstacle before anything touches. In space both cables move along the way of the search, an insertion stays.
    """
    truth: PrivilegedState = envs.get_attr("privileged_state", [0])[0]
    settings, body = envs.get_attr("settings", [0])[0], envs.get_attr("task", [0])[0].body
    way = search(observation).astype(float)
    force = np.linalg.norm(truth.force, axis=1)
    tried = np.linalg.norm(envs.env_method("probe", truth.places + PROBE_MM * way, indices=[0])[0], axis=1)
    slope = np.maximum(np.abs(tried - force) / PROBE_MM, LEAST_SLOPE)
    lacking = np.where(np.abs(truth.goal - force) < REACHED_N, 0.0, truth.goal - force)
    moves = (lacking / slope)[:, None] * way
    acts = effort(moves, truth, body.increments(settings))
    return np.where(force[:, None] > 0, acts, way.astype(np.float32))


class Student:
    """A network and the scaling of what it sees, as Stable-Baselines3 plays policies.

    Args:
        network: The network.
    """

    def __init__(self, network: Network, inputs: int) -> None:
        self.network, self.seen = network, RunningMeanStd(epsilon=EPSILON, shape=(inputs,))

    def scaled(self, rows: np.ndarray) -> torch.Tensor:
        """Rows as the network takes them."""
        return scaled(rows, self.seen.mean, deviation(self.seen))

    def predict(self, rows: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True) -> Any:
        """Actions for rows, ``(N, actions)``."""
        with torch.no_grad():
            return self.network(self.scaled(rows))[0].numpy(), state


class Imitation:
    """A student, what it has been taught so far, and its optimiser.

    Args:
        inputs: Numbers of a row.
        actions: Numbers of an action.
        settings: Of the learner.
    """

    def __init__(self, inputs: int, actions: int, settings: DistilledSettings) -> None:
        self.student, self.settings = Student(Network(inputs, actions, settings), inputs), settings
        self.count = settings.envs * settings.rollout  # steps of a round
        self.rounds = max(1, settings.steps // self.count)
        self.rows = np.zeros((self.rounds * self.count, inputs), np.float32)
        self.taught = np.zeros((self.rounds * self.count, actions), np.float32)
        self.adam = torch.optim.Adam(self.student.network.parameters(), lr=settings.learning_rate)

    def state(self, steps: int) -> State:
        """What it goes on with after some steps."""
        tensors = flat({"network": self.student.network.state_dict(), "adam": self.adam.state_dict()})
        kept = {"rows": torch.from_numpy(self.rows[:steps]), "taught": torch.from_numpy(self.taught[:steps])}
        return State(tensors | kept | statistics_tensors("observations", self.student.seen))

    def restore(self, steps: int, state: State) -> None:
        """Undo :meth:`state`.

        Raises:
            Exception: Any, if the state is not of such a learner.
        """
        states = {"network": self.student.network.state_dict(), "adam": self.adam.state_dict()}
        filled = nested(state.tensors, states)
        self.student.network.load_state_dict(filled["network"])
        self.adam.load_state_dict(filled["adam"])
        self.rows[:steps], self.taught[:steps] = (state.tensors[name].numpy() for name in ("rows", "taught"))
        restore_statistics("observations", self.student.seen, state.tensors)


def distill(run: Run, settings: DistilledSettings, log: Path, progress: bool) -> tuple[Network, RunningMeanStd]:
    """Train a student to the end of a run; its network, and what its rows are scaled by."""
    config, seed = run.config, run.seed
    torch.manual_seed(config.seed)
    generator = np.random.default_rng(seed)
    envs = environments(config, settings.envs, seed)
    validation = environments(config, VALIDATION_EPISODES, VALIDATION_SEED)
    (inputs,), (actions,) = envs.observation_space.shape or (), envs.action_space.shape or ()
    imitation = Imitation(inputs, actions, settings)
    student = imitation.student
    if run.state:
        with run.refusing_damage():
            imitation.restore(run.progress.steps, run.state)
    first, rows = run.progress.steps // imitation.count, envs.reset()
    with SummaryWriter(str(log)) as writer:
        for done in track(range(first, imitation.rounds), "distil", disable=not progress):
            here = slice(done * imitation.count, (done + 1) * imitation.count)
            share = max(0.0, 1 - done / settings.weaning)
            rows = _play(envs, student, rows, (imitation.rows[here], imitation.taught[here]), share, generator)
            student.seen.update(imitation.rows[here])
            writer.add_scalar("train/loss", _learn(imitation, done, generator), here.stop)
            if (done + 1) % max(1, imitation.rounds // CURVE_POINTS) == 0:
                played: Any = student
                mean: Any = evaluate_policy(played, validation, VALIDATION_EPISODES)[0]
                run.progress.validated(here.stop, float(mean))
                writer.add_scalar("eval/mean_reward", float(mean), here.stop)
            run.keep(here.stop, lambda: imitation.state(here.stop))  # noqa: B023 - called at once
    return student.network, student.seen


def _play(
    envs: Any,
    student: Student,
    rows: Any,
    kept: tuple[np.ndarray, np.ndarray],
    share: float,
    generator: np.random.Generator,
) -> Any:
    """Play a round, in a share of the environments by the teacher, and keep what was seen and taught."""
    steps = len(kept[0]) // envs.num_envs
    for k in range(steps):
        here = slice(k * envs.num_envs, (k + 1) * envs.num_envs)
        kept[0][here], kept[1][here] = rows, teach(envs, envs.shown)
        taught = generator.random(envs.num_envs) < share
        actions = kept[1][here] if taught.all() else student.predict(rows)[0]
        rows, *_ = envs.step(np.where(taught[:, None], kept[1][here], actions))
    return rows


def _learn(imitation: Imitation, done: int, generator: np.random.Generator) -> float:
    """Gradient steps on batches of all that is kept after some rounds; the mean loss."""
    settings, student, total = imitation.settings, imitation.student, 0.0
    seen, steps = (done + 1) * imitation.count, settings.gradient_steps
    for k in range(done * steps, (done + 1) * steps):
        for group in imitation.adam.param_groups:
            group["lr"] = settings.learning_rate * (1 - k / (imitation.rounds * steps))
        batch = generator.integers(seen, size=settings.batch_size)
        acts = student.network.unbounded(student.scaled(imitation.rows[batch]))
        taught = torch.from_numpy(imitation.taught[batch])
        loss = nn.functional.huber_loss(acts, taught, delta=settings.huber)
        imitation.adam.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        imitation.adam.step()
        total += loss.item()
    return total / steps
