"""Imitation of a teacher that sees the hidden state, by a student that sees what every policy sees.

The student acts, the teacher labels each step with the action it would have taken, and the student learns from the
labels of all rounds so far: S. Ross, G. Gordon, D. Bagnell, "A reduction of imitation learning and structured
prediction to no-regret online learning" (DAgger), AISTATS 2011. What the history does not determine is averaged over.
"""

from dataclasses import dataclass

import numpy as np
import torch
from rich.progress import track
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from torch import nn
from torch.utils.tensorboard import SummaryWriter

from agents.config import CURVE_POINTS, VALIDATION_EPISODES, VALIDATION_SEED
from agents.environment import Observation
from agents.learning.checkpoint import (
    LearnerState,
    TrainingRun,
    flatten_states,
    nest_states,
    restore_statistics,
    statistics_tensors,
)
from agents.learning.checks import Form, check_tensors, moment_forms
from agents.learning.learners import make_envs, play_on
from agents.learning.log import recording
from agents.learning.network import EPSILON, Network, normalized, standard_deviation
from agents.policy import motor_actions, natural, search
from agents.tuned import DistilledSettings
from ccr_gym import ActionSpec, Scales

LEAST_SLOPE = 0.05  # smallest slope that is used [EI/L² per a]
REACHED = 1e-4  # force error below which the teacher rests [EI/L²]


def teacher_actions(envs: VecEnv, observation: Observation) -> np.ndarray:
    """Return the actions ``(N, actions)`` of a controller that sees the true force, its slope, backlash and set-point.

    They are Newton steps to the next set-point, with the exact slope; before contact, full speed towards the obstacle.
    All cables move in the direction of the search; an insertion stays where it is.
    """
    scales: Scales = envs.get_attr("settings", [0])[0].scales
    state = natural(envs.get_attr("privileged_state", [0])[0], scales)
    spec: ActionSpec = envs.get_attr("action_spec", [0])[0]
    direction = search(observation).astype(float)
    force = np.linalg.norm(state.force, axis=1)
    slope = np.maximum(np.abs(_slopes(envs, state.force, direction, scales)), LEAST_SLOPE)
    missing = np.where(np.abs(state.goal - force) < REACHED, 0.0, state.goal - force)
    moves = (missing / slope)[:, None] * direction
    actions = motor_actions(moves, state, spec.increment_mm / scales.travel_mm)
    return np.where(force[:, None] > 0, actions, direction.astype(np.float32))


def _slopes(envs: VecEnv, force: np.ndarray, direction: np.ndarray, scales: Scales) -> np.ndarray:
    """Return the slopes of the magnitudes of regulated forces ``(N, d)`` along a direction, ``(N,)`` [EI/L² per a]."""
    slopes = envs.env_method("force_slopes", indices=[0])[0] * (scales.travel_mm / scales.force_n)
    along, size = np.einsum("nk,nkd->nd", direction, slopes), np.linalg.norm(force, axis=1)
    return np.asarray(np.divide(np.sum(along * force, axis=1), size, out=np.zeros(len(size)), where=size > 0))


class Student:
    """A network with the running statistics of its inputs, in the form in which Stable-Baselines3 plays policies.

    Args:
        network: The network.
        inputs: Size of a row.
    """

    def __init__(self, network: Network, inputs: int) -> None:
        self.network, self.statistics = network, RunningMeanStd(epsilon=EPSILON, shape=(inputs,))

    def normalized(self, rows: np.ndarray) -> torch.Tensor:
        """Return rows of observations, normalised for the network."""
        return normalized(rows, self.statistics.mean, standard_deviation(self.statistics))

    def predict(
        self,
        observation: np.ndarray | dict[str, np.ndarray],
        state: tuple[np.ndarray, ...] | None = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = True,
    ) -> tuple[np.ndarray, tuple[np.ndarray, ...] | None]:
        """Return the actions for rows, ``(N, actions)``, and the state as it is."""
        assert isinstance(observation, np.ndarray)
        with torch.no_grad():
            return self.network(self.normalized(observation))[0].numpy(), state


class Imitation:
    """A student, the labels of all rounds so far, and the optimiser.

    Args:
        inputs: Size of a row.
        actions: Size of an action.
        settings: Settings of the learner.
    """

    def __init__(self, inputs: int, actions: int, settings: DistilledSettings) -> None:
        self.student, self.settings = Student(Network(inputs, actions, settings), inputs), settings
        self.count = settings.envs * settings.rollout  # steps per round
        self.rounds = max(1, settings.steps // self.count)
        self.rows = np.zeros((self.rounds * self.count, inputs), np.float32)
        self.labels = np.zeros((self.rounds * self.count, actions), np.float32)
        self.adam = torch.optim.Adam(self.student.network.parameters(), lr=settings.learning_rate)

    def state(self, steps: int) -> LearnerState:
        """Return the state after some steps."""
        tensors = flatten_states({"network": self.student.network.state_dict(), "adam": self.adam.state_dict()})
        data = {"rows": torch.from_numpy(self.rows[:steps]), "labels": torch.from_numpy(self.labels[:steps])}
        return LearnerState(tensors | data | statistics_tensors("observations", self.student.statistics))

    def restore(self, steps: int, state: LearnerState) -> None:
        """Restore a state of :meth:`state`.

        Raises:
            Exception: Of any kind, if the state is that of another learner or damaged; nothing is then changed.
        """
        forms = {name: Form.of(tensor) for name, tensor in self.state(steps).tensors.items()}
        check_tensors(state.tensors, forms | moment_forms("adam", self.adam))
        states = {"network": self.student.network.state_dict(), "adam": self.adam.state_dict()}
        nested = nest_states(state.tensors, states)
        self.student.network.load_state_dict(nested["network"])
        self.adam.load_state_dict(nested["adam"])
        self.rows[:steps], self.labels[:steps] = (state.tensors[name].numpy() for name in ("rows", "labels"))
        restore_statistics("observations", self.student.statistics, state.tensors)

    def learn(self, done: int, generator: np.random.Generator) -> float:
        """Take the gradient steps that follow a round, on batches from all rounds so far; return their mean loss."""
        total, count, steps = 0.0, (done + 1) * self.count, self.settings.gradient_steps
        for k in range(done * steps, (done + 1) * steps):
            for group in self.adam.param_groups:
                group["lr"] = self.settings.learning_rate * (1 - k / (self.rounds * steps))
            total += self._descend(generator.integers(count, size=self.settings.batch_size))
        return total / steps

    def _descend(self, batch: np.ndarray) -> float:
        """Take one gradient step; return the loss before it."""
        actions = self.student.network.unbounded(self.student.normalized(self.rows[batch]))
        labels = torch.from_numpy(self.labels[batch])
        loss = nn.functional.huber_loss(actions, labels, delta=self.settings.huber)
        self.adam.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        self.adam.step()
        return loss.item()


@dataclass(slots=True)
class Rollouts:
    """Environments in which the student and the teacher act.

    Attributes:
        envs: Environments that show their dictionary observations.
        rows: Present rows of observations.
        generator: Chooses the environments that the teacher drives.
    """

    envs: VecEnvWrapper
    rows: np.ndarray
    generator: np.random.Generator

    def play(self, imitation: Imitation, done: int) -> None:
        """Play the next round after those done; store its rows and labels."""
        student, settings, count = imitation.student, imitation.settings, self.envs.num_envs
        share = max(0.0, 1 - done / settings.weaning)  # of environments that the teacher drives
        for k in range(imitation.count // count):
            step = slice(done * imitation.count + k * count, done * imitation.count + (k + 1) * count)
            labels = teacher_actions(self.envs, self.envs.shown)
            imitation.rows[step], imitation.labels[step] = self.rows, labels
            driven = self.generator.random(count) < share
            actions = labels if driven.all() else student.predict(self.rows)[0]
            rows, *_ = self.envs.step(np.where(driven[:, None], labels, actions))
            assert isinstance(rows, np.ndarray)
            self.rows = rows


def distill(run: TrainingRun, settings: DistilledSettings, progress: bool) -> tuple[Network, RunningMeanStd]:
    """Train a student to the end of a run; return its network and the statistics that its rows are normalised by."""
    torch.manual_seed(run.config.seed)
    envs = make_envs(run.config, settings.envs, run.seed)
    validation = make_envs(run.config, VALIDATION_EPISODES, VALIDATION_SEED)
    (inputs,), (actions,) = envs.observation_space.shape or (), envs.action_space.shape or ()
    imitation = Imitation(inputs, actions, settings)
    if run.state:
        with run.rejecting_damage():
            imitation.restore(run.progress.steps, run.state)
    rows, _ = play_on(imitation.student, envs, run.progress.steps // settings.envs)
    generator = np.random.default_rng(run.seed)
    assert isinstance(rows, np.ndarray)
    rollouts, first = Rollouts(envs, rows, generator), run.progress.steps // imitation.count
    with recording(run.config.run) as log:
        writer = SummaryWriter(str(log))
    with writer:
        for done in track(range(first, imitation.rounds), "distil", disable=not progress):
            steps = (done + 1) * imitation.count
            rollouts.play(imitation, done)
            imitation.student.statistics.update(imitation.rows[steps - imitation.count : steps])
            writer.add_scalar("train/loss", imitation.learn(done, generator), steps)
            if (done + 1) % max(1, imitation.rounds // CURVE_POINTS) == 0:
                mean_return = _validate(imitation.student, validation)
                run.progress.add_validation(steps, mean_return)
                writer.add_scalar("eval/mean_reward", mean_return, steps)
            run.save_if_due(steps, lambda: imitation.state(steps))  # noqa: B023 - called at once
    return imitation.student.network, imitation.student.statistics


def _validate(student: Student, envs: VecEnv) -> float:
    """Return the mean return of validation episodes."""
    mean, _ = evaluate_policy(student, envs, VALIDATION_EPISODES)
    return float(np.mean(mean))  # a number, which is typed as one or many
