"""Episodes of policies on unseen scenes, and what is measured of them."""

import time
from dataclasses import dataclass, fields
from typing import Any

import gymnasium
import numpy as np

import ccr_gym  # noqa: F401 - registers the ids
from agents.policy import Policy
from solver import Status

TOLERANCE = 0.05  # relative force error that counts as reached
SEARCH = 24  # steps in which contact is found, which do not count
STEADY = 16  # last steps, of the steady-state error


@dataclass(frozen=True, slots=True)
class Episode:
    """One episode, step by step.

    Attributes:
        goal: Magnitude of the set-point that holds after every step, ``(k,)`` [N].
        lacking: How far the force is from the set-point after every step, of magnitudes or vectors, ``(k,)`` [N].
        misread: The same of the virtual-work estimate, ``(k,)`` [N].
        true: True contact force magnitude after every step, ``(k,)`` [N].
        estimated: Virtual-work estimate of it, ``(k,)`` [N].
        cost: Force above the limit after every step, ``(k,)`` [N].
        statuses: Solver status of every step.
        equilibria: Equilibrium after every step, if they were to be kept.
        seconds: Time the policy took for its decisions [s].
    """

    goal: np.ndarray
    lacking: np.ndarray
    misread: np.ndarray
    true: np.ndarray
    estimated: np.ndarray
    cost: np.ndarray
    statuses: tuple[Status, ...]
    equilibria: tuple[Any, ...]
    seconds: float

    @property
    def error(self) -> np.ndarray:
        """Relative force error after every step, ``(k,)``."""
        return np.asarray(self.lacking / self.goal)


@dataclass(frozen=True, slots=True)
class Metrics:
    """What one episode comes to.

    Attributes:
        rmse_mn: Root mean square force error after the steps of the search [mN]; what policies are ranked by.
        estimate_rmse_mn: The same of the virtual-work estimate [mN].
        steady_mn: Mean force error of the last steps [mN].
        success: Whether the episode ends within 5 % of the set-point.
        settling_step: Step after which the error stays within 5 %; beyond the last one if it does not.
        overshoot: Largest force above the set-point, relative to it.
        contact_losses: How often contact is lost.
        peak_mn: Largest force [mN].
        violations: Steps with a force above the limit.
        cost_mn: Sum of the force above the limit [mN].
    """

    rmse_mn: float
    estimate_rmse_mn: float
    steady_mn: float
    success: float
    settling_step: float
    overshoot: float
    contact_losses: float
    peak_mn: float
    violations: float
    cost_mn: float


METRICS = tuple(field.name for field in fields(Metrics))


def measure(episode: Episode) -> Metrics:
    """The metrics of an episode."""
    touching, outside = episode.true > 0, np.flatnonzero(episode.error > TOLERANCE)
    return Metrics(
        rmse_mn=_rms_mn(episode.lacking[SEARCH:]),
        estimate_rmse_mn=_rms_mn(episode.misread[SEARCH:]),
        steady_mn=1e3 * float(episode.lacking[-STEADY:].mean()),
        success=float(episode.error[-1] <= TOLERANCE),
        settling_step=float(outside[-1] + 2 if outside.size else 1),
        overshoot=max(0.0, float((episode.true / episode.goal).max()) - 1),
        contact_losses=float((touching[:-1] & ~touching[1:]).sum()),
        peak_mn=1e3 * float(episode.true.max()),
        violations=float((episode.cost > 0).sum()),
        cost_mn=1e3 * float(episode.cost.sum()),
    )


def run_episode(policy: Policy, env_id: str, seed: int, keep: bool = False, **kwargs: Any) -> Episode:
    """Play one episode of an environment made with some arguments; equilibria are kept if asked for."""
    env = gymnasium.make(env_id, obs_mode="dict", disable_env_checker=True, **kwargs)
    observation, info = env.reset(seed=seed)
    policy.reset(env)
    told: list[tuple[Any, ...]] = []
    statuses, equilibria, seconds, truncated = [], [], 0.0, False
    while not truncated:
        start = time.perf_counter()
        action = policy.act(observation)
        seconds += time.perf_counter() - start
        observation, _, _, truncated, info = env.step(action)
        goal, true, estimated = info["desired_force"], info["force_true"], info["force_est"]
        size, reading = np.linalg.norm(true), np.linalg.norm(estimated)
        if np.ndim(goal) == 0:
            away = abs(size - goal), abs(reading - goal)
        else:
            away = np.linalg.norm(true - goal), np.linalg.norm(estimated - goal)
        told.append((np.linalg.norm(goal), *away, size, reading, info["cost"]))
        statuses.append(Status(info["solver_status"]))
        if keep:
            equilibria.append(env.get_wrapper_attr("equilibrium"))
    env.close()
    goal, lacking, misread, true, estimated, cost = np.array(told, float).T
    played = tuple(statuses), tuple(equilibria), seconds
    return Episode(goal, lacking, misread, true, estimated, cost, *played)


def run_episodes(policy: Policy, env_id: str, seed: int, count: int, **kwargs: Any) -> list[Episode]:
    """Play episodes of consecutive seeds."""
    return [run_episode(policy, env_id, seed + i, **kwargs) for i in range(count)]


def scores(policy: Policy, env_id: str, seed: int, count: int, **kwargs: Any) -> np.ndarray:
    """Root mean square force error of episodes of consecutive seeds, ``(count,)`` [mN]."""
    return np.array([measure(e).rmse_mn for e in run_episodes(policy, env_id, seed, count, **kwargs)])


def _rms_mn(forces: np.ndarray) -> float:
    return 1e3 * float(np.sqrt(np.mean(forces**2)))
