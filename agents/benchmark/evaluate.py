"""Episodes of policies, and metrics of them."""

import time
from dataclasses import dataclass, fields

import numpy as np

from agents.arguments import check_kind, check_whole
from agents.environment import make_env
from agents.policy import Policy
from solver import Equilibrium, Status
from solver.spatial import SpatialEquilibrium

TOLERANCE = 0.05  # relative force error that counts as success
SEARCH = 24  # first steps, in which contact is found; their errors do not count
MOST = 2**31 - 1  # of seeds and episodes
STEADY = 16  # last steps, for the steady-state error


@dataclass(frozen=True, slots=True)
class Episode:
    """One episode, step by step.

    Attributes:
        goal: Magnitude of the set-point after every step, ``(k,)`` [N].
        error_n: Distance of the regulated force from the set-point, of magnitudes or vectors, ``(k,)`` [N].
        estimate_error_n: Distance of the virtual-work estimate from the set-point, ``(k,)`` [N].
        force: Magnitude of the regulated force: the true one, or the estimate if that is to be regulated, ``(k,)`` [N].
        estimated: Magnitude of the virtual-work estimate, ``(k,)`` [N].
        cost: Force above the limit, ``(k,)`` [N].
        statuses: Solver status of every step.
        equilibria: Equilibrium after every step, if they were asked for.
        seconds: CPU time that the policy took to act [s].
    """

    goal: np.ndarray
    error_n: np.ndarray
    estimate_error_n: np.ndarray
    force: np.ndarray
    estimated: np.ndarray
    cost: np.ndarray
    statuses: tuple[Status, ...]
    equilibria: tuple[Equilibrium | SpatialEquilibrium, ...]
    seconds: float

    @property
    def error(self) -> np.ndarray:
        """Relative force error after every step, ``(k,)``."""
        return np.asarray(self.error_n / self.goal)


@dataclass(frozen=True, slots=True)
class Metrics:
    """Metrics of one episode.

    Attributes:
        rmse_mn: Root mean square force error after the steps of the search [mN]; policies are ranked by it.
        estimate_rmse_mn: The same for the virtual-work estimate [mN].
        steady_mn: Mean force error of the last steps [mN].
        success: 1 if the episode ends within 5 % of the set-point, else 0.
        settling_step: Step from which the error stays within 5 %; one beyond the last if it does not.
        overshoot: Largest force above the set-point, relative to the set-point.
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
    """Return the metrics of an episode.

    Raises:
        TypeError: If it is no :class:`Episode`.
    """
    check_kind("episode", episode, Episode, "take one of run_episode")
    touching, outside = episode.force > 0, np.flatnonzero(episode.error > TOLERANCE)
    return Metrics(
        rmse_mn=_rms_mn(episode.error_n[SEARCH:]),
        estimate_rmse_mn=_rms_mn(episode.estimate_error_n[SEARCH:]),
        steady_mn=1e3 * float(episode.error_n[-STEADY:].mean()),
        success=float(episode.error[-1] <= TOLERANCE),
        settling_step=float(outside[-1] + 2 if outside.size else 1),
        overshoot=max(0.0, float((episode.force / episode.goal).max()) - 1),
        contact_losses=float((touching[:-1] & ~touching[1:]).sum()),
        peak_mn=1e3 * float(episode.force.max()),
        violations=float((episode.cost > 0).sum()),
        cost_mn=1e3 * float(episode.cost.sum()),
    )


def run_episode(policy: Policy, env_id: str, seed: int, keep: bool = False, **kwargs: object) -> Episode:
    """Play one episode of an environment.

    Args:
        policy: The policy.
        env_id: Id of the environment.
        seed: Seed of the episode.
        keep: Whether to keep the equilibria.
        **kwargs: Arguments of the environment, such as ``sensing`` and ``split``.
    """
    if not (callable(getattr(policy, "reset", None)) and callable(getattr(policy, "act", None))):
        check_kind("policy", policy, (), "give an object with the methods reset and act of agents.Policy")
    env = make_env(env_id, **kwargs)
    regulated = {"true": "force_true", "estimate": "force_est"}[env.get_wrapper_attr("settings").regulate]
    observation, info = env.reset(seed=seed)
    policy.reset(env)
    rows: list[tuple[float, ...]] = []
    statuses, equilibria, seconds, truncated = [], [], 0.0, False
    while not truncated:
        start = time.process_time()
        action = policy.act(observation)
        seconds += time.process_time() - start
        observation, _, _, truncated, info = env.step(action)
        rows.append(_forces(info["desired_force"], info[regulated], info["force_est"], info["cost"]))
        statuses.append(Status(info["solver_status"]))
        if keep:
            equilibria.append(env.get_wrapper_attr("equilibrium"))
    env.close()
    goal, error, estimate_error, force, estimated, cost = np.array(rows, float).T
    outcome = tuple(statuses), tuple(equilibria), seconds
    return Episode(goal, error, estimate_error, force, estimated, cost, *outcome)


def _forces(goal: np.ndarray | float, force: np.ndarray, estimated: np.ndarray, cost: float) -> tuple[float, ...]:
    """Return the numbers of a step in the order of :class:`Episode`."""
    size, estimate = float(np.linalg.norm(force)), float(np.linalg.norm(estimated))
    if np.ndim(goal) == 0:
        errors = abs(size - float(goal)), abs(estimate - float(goal))
    else:
        errors = float(np.linalg.norm(force - goal)), float(np.linalg.norm(estimated - goal))
    return float(np.linalg.norm(goal)), *errors, size, estimate, cost


def run_episodes(policy: Policy, env_id: str, seed: int, count: int, **kwargs: object) -> list[Episode]:
    """Play episodes with consecutive seeds.

    Raises:
        ValueError: If the first seed is no whole number, or the count no positive one.
    """
    seed, count = check_whole("seed", seed, 0, MOST), check_whole("count", count, 1, MOST)
    return [run_episode(policy, env_id, seed + i, False, **kwargs) for i in range(count)]


def scores(policy: Policy, env_id: str, seed: int, count: int, **kwargs: object) -> np.ndarray:
    """Return the root mean square force errors of episodes with consecutive seeds, ``(count,)`` [mN].

    Args:
        policy: The policy.
        env_id: Id of the environment.
        seed: Seed of the first episode.
        count: Number of episodes.
        **kwargs: Arguments of the environment, such as ``sensing`` and ``split``.
    """
    return np.array([measure(episode).rmse_mn for episode in run_episodes(policy, env_id, seed, count, **kwargs)])


def _rms_mn(forces: np.ndarray) -> float:
    return 1e3 * float(np.sqrt(np.mean(forces**2)))
