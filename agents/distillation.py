"""Imitation of a teacher that knows what is hidden, by a student that sees what every policy sees.

The student acts, the teacher says what it would have done, and the student learns that from all rounds so far: S. Ross,
G. Gordon, D. Bagnell, "A reduction of imitation learning and structured prediction to no-regret online learning"
(DAgger), AISTATS 2011. What cannot be known from the history is averaged over.
"""

from typing import Any

import numpy as np
import torch
from rich.progress import track
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.running_mean_std import RunningMeanStd
from torch import nn
from torch.utils.tensorboard import SummaryWriter

from agents.actor import EPSILON, Curve, Network, deviation, scaled
from agents.config import CURVE_POINTS, VALIDATION_EPISODES, VALIDATION_SEED, TrainConfig
from agents.learners import environments
from agents.policy import Observation, effort, search
from agents.tuned import DistilledSettings
from ccr_gym.fleet import Truth

PROBE_MM = 0.02  # move that the slope of the force is measured with
LEAST_SLOPE = 1e-3  # slope that is believed [N/mm]
REACHED_N = 2e-5  # error that the teacher leaves


def teach(envs: Any, observation: Observation) -> np.ndarray:
    """What a controller does that knows the true force, its slope, the play and the next set-point, ``(N, actions)``.

    Newton's step to the set-point, with the slope from a trial move of the robots as they are; full speed towards the
    obstacle before anything touches. In space both cables move along the way of the search, an insertion stays.
    """
    truth: Truth = envs.get_attr("truth", [0])[0]
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


def distill(config: TrainConfig, settings: DistilledSettings, progress: bool) -> tuple[Network, RunningMeanStd, Curve]:
    """Train a student; its network, what its rows are scaled by, and its learning curve."""
    torch.manual_seed(config.seed)
    generator = np.random.default_rng(config.seed)
    envs = environments(config, settings.envs, config.seed)
    validation = environments(config, VALIDATION_EPISODES, VALIDATION_SEED)
    (inputs,), (actions,) = envs.observation_space.shape or (), envs.action_space.shape or ()
    student = Student(Network(inputs, actions, settings), inputs)
    rounds = max(1, settings.steps // (settings.envs * settings.rollout))
    count = settings.envs * settings.rollout
    kept = np.zeros((rounds * count, inputs), np.float32), np.zeros((rounds * count, actions), np.float32)
    adam = torch.optim.Adam(student.network.parameters(), lr=settings.learning_rate)
    fading = torch.optim.lr_scheduler.LinearLR(adam, 1.0, 0.0, rounds * settings.gradient_steps)
    steps, returns, rows = [], [], envs.reset()
    with SummaryWriter(str(config.run / "log_1")) as log:
        for done in track(range(rounds), "distil", disable=not progress):
            here = slice(done * count, (done + 1) * count)
            share = max(0.0, 1 - done / settings.weaning)
            rows = _play(envs, student, rows, (kept[0][here], kept[1][here]), share, generator)
            student.seen.update(kept[0][here])
            loss = _learn(student, kept[0][: here.stop], kept[1][: here.stop], settings, adam, fading, generator)
            log.add_scalar("train/loss", loss, here.stop)
            if (done + 1) % max(1, rounds // CURVE_POINTS) == 0:
                played: Any = student
                mean: Any = evaluate_policy(played, validation, VALIDATION_EPISODES)[0]
                steps.append(here.stop)
                returns.append(float(mean))
                log.add_scalar("eval/mean_reward", returns[-1], here.stop)
    return student.network, student.seen, Curve(tuple(steps), tuple(returns))


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


def _learn(
    student: Student,
    rows: np.ndarray,
    taught: np.ndarray,
    settings: DistilledSettings,
    adam: torch.optim.Optimizer,
    fading: torch.optim.lr_scheduler.LRScheduler,
    generator: np.random.Generator,
) -> float:
    """Gradient steps on batches of all that is kept; the mean loss."""
    total = 0.0
    for _ in range(settings.gradient_steps):
        batch = generator.integers(len(rows), size=settings.batch_size)
        acts = student.network.unbounded(student.scaled(rows[batch]))
        loss = nn.functional.huber_loss(acts, torch.from_numpy(taught[batch]), delta=settings.huber)
        adam.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        adam.step()
        fading.step()
        total += loss.item()
    return total / settings.gradient_steps
