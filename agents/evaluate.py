"""Policies on the same unseen episodes, and what they achieve."""

import time
from collections import Counter
from dataclasses import asdict, dataclass
from typing import Any

import gymnasium
import numpy as np

import ccr_gym  # noqa: F401 - registers the ids
from agents.policy import Policy
from solver import Status

TOLERANCE = 0.05  # relative force error that counts as reached


@dataclass(frozen=True, slots=True)
class Episode:
    """One episode, step by step.

    Attributes:
        desired: Magnitude of the set-point [N].
        lacking: How far the force is from the set-point after every step, of magnitudes or vectors, ``(k,)`` [N].
        true: True contact force magnitude after every step, ``(k,)`` [N].
        estimated: Virtual-work estimate of it, ``(k,)`` [N].
        statuses: Solver status of every step.
        equilibria: Equilibrium after every step.
        seconds: Time the policy took for its decisions [s].
    """

    desired: float
    lacking: np.ndarray
    true: np.ndarray
    estimated: np.ndarray
    statuses: tuple[Status, ...]
    equilibria: tuple[Any, ...]
    seconds: float

    @property
    def error(self) -> np.ndarray:
        """Relative force error after every step, ``(k,)``."""
        return np.asarray(self.lacking / self.desired)


@dataclass(frozen=True, slots=True)
class Summary:
    """What a policy achieved over its episodes.

    Attributes:
        policy: Its name.
        median_error: Median of the final relative force error.
        mean_error: Mean of it.
        median_error_mn: Median of the final force error [mN].
        success: Share of episodes that end within 5 % of the set-point.
        settling_steps: Median step after which the error stays within 5 %, of the episodes that end there.
        peak_overshoot: Median of the largest force above the set-point, relative to it.
        contact_losses: Mean number of times an episode loses contact.
        statuses: Solver statuses counted over all steps.
        decisions_per_second: Decisions of the policy per second.
    """

    policy: str
    median_error: float
    mean_error: float
    median_error_mn: float
    success: float
    settling_steps: float
    peak_overshoot: float
    contact_losses: float
    statuses: dict[str, int]
    decisions_per_second: float

    def as_dict(self) -> dict[str, object]:
        """For JSON."""
        return asdict(self)


def run_episode(policy: Policy, env_id: str, seed: int, **kwargs: Any) -> Episode:
    """Play one episode of an environment made with some arguments."""
    env = gymnasium.make(env_id, obs_mode="dict", disable_env_checker=True, **kwargs)
    observation, info = env.reset(seed=seed)
    policy.reset(env)
    lacking: list[float] = []
    true, estimated, statuses, equilibria, seconds = [], [], [], [], 0.0
    truncated = False
    while not truncated:
        start = time.perf_counter()
        action = policy.act(observation)
        seconds += time.perf_counter() - start
        observation, _, _, truncated, info = env.step(action)
        true.append(np.linalg.norm(info["force_true"]))
        goal = info["desired_force"]
        lacking.append(abs(true[-1] - goal) if np.ndim(goal) == 0 else float(np.linalg.norm(info["force_true"] - goal)))
        estimated.append(np.linalg.norm(info["force_est"]))
        statuses.append(Status(info["solver_status"]))
        equilibria.append(env.get_wrapper_attr("equilibrium"))
    env.close()
    told = tuple(statuses), tuple(equilibria), seconds
    desired = float(np.linalg.norm(info["desired_force"]))
    return Episode(desired, np.array(lacking), np.array(true), np.array(estimated), *told)


def run_episodes(policy: Policy, env_id: str, seed: int, count: int, **kwargs: Any) -> list[Episode]:
    """Play episodes of consecutive seeds."""
    return [run_episode(policy, env_id, seed + i, **kwargs) for i in range(count)]


def summarize(name: str, episodes: list[Episode]) -> Summary:
    """Reduce episodes to what a table shows."""
    final = np.array([episode.error[-1] for episode in episodes])
    settled = [_settling_step(episode) for episode in episodes if episode.error[-1] <= TOLERANCE]
    statuses = Counter(status.name for episode in episodes for status in episode.statuses)
    return Summary(
        policy=name,
        median_error=float(np.median(final)),
        mean_error=float(final.mean()),
        median_error_mn=float(np.median([1e3 * e.lacking[-1] for e in episodes])),
        success=float((final <= TOLERANCE).mean()),
        settling_steps=float(np.median(settled)) if settled else float("nan"),
        peak_overshoot=float(np.median([max(0.0, e.true.max() / e.desired - 1) for e in episodes])),
        contact_losses=float(np.mean([_contact_losses(e) for e in episodes])),
        statuses={status.name: statuses[status.name] for status in Status if statuses[status.name]},
        decisions_per_second=sum(len(e.true) for e in episodes) / max(sum(e.seconds for e in episodes), 1e-9),
    )


def _settling_step(episode: Episode) -> int:
    outside = np.flatnonzero(episode.error > TOLERANCE)
    return int(outside[-1]) + 2 if outside.size else 1


def _contact_losses(episode: Episode) -> int:
    touching = episode.true > 0
    return int((touching[:-1] & ~touching[1:]).sum())
