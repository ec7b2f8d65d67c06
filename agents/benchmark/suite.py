"""The benchmark: every policy on every environment, on the same test scenes."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from agents.benchmark.evaluate import METRICS, Episode, measure, run_episode
from agents.benchmark.statistics import cvar, iqm, iqm_interval
from agents.benchmark.video import record
from agents.config import EvaluateConfig
from agents.controllers.force import ForceController
from agents.controllers.harmonic import HarmonicController
from agents.controllers.mpc import PredictiveController
from agents.controllers.newton import NewtonController
from agents.errors import UserError
from agents.files import JsonObject
from agents.learning.actor import LearnedPolicy, TrainingRecord
from agents.learning.pretrained import SUFFIX, folder_name, trained
from agents.policy import Policy
from agents.tuned import LEARNERS, sensing_of
from agents.workers import worker_pool
from solver import Status

SHOWN = 4  # first episodes, which figures show
CONTROLLERS: dict[str, Callable[[str, str | None], Policy]] = {  # made for an environment and its sensing
    "P": ForceController.proportional_only,
    "PI": ForceController.tuned,
    "MPC": lambda *_: PredictiveController(),
    "Harmonic": lambda *_: HarmonicController(),
    "Newton": lambda *_: NewtonController(),
    "Oracle": lambda *_: NewtonController.knowing(),
}


@dataclass(frozen=True, slots=True)
class Entry:
    """A policy on an environment.

    Attributes:
        policy: Name of the policy.
        env_id: Id of the environment.
        sensing: Sensing of the environment.
        files: Files of trained policies, one for each training seed; none for a controller.
    """

    policy: str
    env_id: str
    sensing: str
    files: tuple[Path, ...] = ()

    def load(self) -> list[Policy]:
        """Return the policies of all training seeds, or the controller."""
        if self.policy in CONTROLLERS:
            return [CONTROLLERS[self.policy](self.env_id, self.sensing)]
        return [LearnedPolicy(file) for file in self.files]


@dataclass(frozen=True, slots=True)
class Result:
    """The result of an entry.

    Attributes:
        entry: The entry.
        metrics: Metrics by name, for every training seed and episode, ``(seeds, episodes)``.
        summary: Numbers of the tables, as :func:`summarize` returns them, with ``statuses`` of the solver,
            ``decisions_per_second`` and ``training_seconds``.
        shown: First episodes of the first training seed.
        trainings: How the policy of every training seed was trained; none for a controller.
    """

    entry: Entry
    metrics: dict[str, np.ndarray]
    summary: JsonObject
    shown: tuple[Episode, ...] = ()
    trainings: tuple[TrainingRecord, ...] = ()

    @property
    def rmse(self) -> np.ndarray:
        """Force error of every training seed and episode, ``(seeds, episodes)`` [mN]."""
        return self.metrics["rmse_mn"]

    def as_dict(self) -> JsonObject:
        """Return the summary and the metrics of every episode, for JSON."""
        episodes = {name: np.round(values, 5).tolist() for name, values in self.metrics.items()}
        entry = asdict(self.entry) | {"files": [file.name for file in self.entry.files]}
        return entry | {"summary": self.summary, "episodes": episodes}


def summarize(metrics: dict[str, np.ndarray]) -> JsonObject:
    """Return interquartile mean, interval and tail mean of the force error, and means or medians of other metrics."""
    rmse = metrics["rmse_mn"]
    return {
        **{name: float(values.mean()) for name, values in metrics.items()},
        "settling_step": _median_settling(metrics["settling_step"], metrics["success"] > 0),
        "overshoot": float(np.median(metrics["overshoot"])),
        "rmse_iqm_mn": float(iqm(rmse.ravel())),
        "rmse_interval_mn": iqm_interval(rmse),
        "rmse_of_seeds_mn": [float(iqm(row)) for row in rmse],
        "rmse_cvar_mn": cvar(rmse.ravel()),
    }


def _median_settling(steps: np.ndarray, settled: np.ndarray) -> float:
    """Return the median step, as of an episode that does not settle if no more than half of them settle."""
    return float(min(np.median(np.where(settled, steps, np.inf)), steps.max()))


def entries(config: EvaluateConfig) -> list[Entry]:
    """Return the entries that an evaluation asks for.

    Raises:
        FileNotFoundError: If a run has no trained policy.
        UserError: If a file is not a trained policy or in the folder of another, the runs have different sensing, or
            learners are asked for and no trained policy is found.
    """
    return _entries_of_runs(config) if config.runs else _entries_of_package(config)


def _entries_of_runs(config: EvaluateConfig) -> list[Entry]:
    files: dict[tuple[str, str], list[Path]] = {}
    sensings: dict[str, Path] = {}
    for run in config.runs:
        policy = LearnedPolicy(run)
        trained_with = policy.training.config
        files.setdefault((trained_with.env_id, policy.name), []).append(run)
        sensings[trained_with.sensing] = run
    if len(sensings) > 1:
        both = " and ".join(f"{run} with {sensing}" for sensing, run in sensings.items())
        raise UserError(f"runs must have the same sensing, but {both} sensing are given; evaluate them separately")
    (sensing,) = sensings
    found = [Entry(name, env_id, sensing, tuple(paths)) for (env_id, name), paths in files.items()]
    for env_id in dict.fromkeys(env_id for env_id, _ in files):
        found += [Entry(name, env_id, sensing) for name in config.policies if name not in LEARNERS]
    return found


def _entries_of_package(config: EvaluateConfig) -> list[Entry]:
    found = [
        Entry(policy, env_id, config.sensing or sensing_of(env_id), files)
        for env_id in config.env_ids
        for policy in config.policies
        for files in [trained(policy, env_id, config.pretrained)]
        if policy not in LEARNERS or (files and config.sensing in (None, sensing_of(env_id)))
    ]
    learners = [policy for policy in config.policies if policy in LEARNERS]
    if learners and not any(entry.files for entry in found):
        raise _no_policy(config, learners)
    for entry in found:
        _check_files(entry)
    return found


def _no_policy(config: EvaluateConfig, learners: list[str]) -> UserError:
    """Return the exception for an evaluation of learners, none of which has a policy for it."""
    for other in config.env_ids:
        if any(trained(learner, other, config.pretrained) for learner in learners):
            return UserError(
                f"the policies of {', '.join(learners)} in {config.pretrained} were trained with {sensing_of(other)} "
                f"sensing on {other}, not with {config.sensing}; leave out --sensing, or train with ccr-gym train "
                f"--sensing {config.sensing} and evaluate --runs"
            )
    example = f"{config.pretrained}/{learners[0]}/{folder_name(config.env_ids[0])}/0{SUFFIX}"
    return UserError(f"no trained policy found, such as {example}; train them with ccr-gym retrain")


def _check_files(entry: Entry) -> None:
    """Refuse files that are not policies of the learner and environment in whose folder they are."""
    for policy in entry.load():
        if isinstance(policy, LearnedPolicy):
            config = policy.training.config
            if (policy.name, config.env_id) != (entry.policy, entry.env_id):
                raise UserError(
                    f"{policy.path} is a policy that {policy.name} trained on {config.env_id}, in the folder of "
                    f"{entry.policy} on {entry.env_id}; move it to its own folder"
                )


def play(entry: Entry, seed: int, episodes: int) -> Result:
    """Play the episodes of an entry.

    Args:
        entry: The entry.
        seed: Seed of the first episode; the others have the following ones.
        episodes: Number of episodes per training seed.
    """
    kwargs = {"sensing": entry.sensing, "split": "test"}
    policies, shown, rows = entry.load(), [], []
    statuses: Counter[str] = Counter()
    steps, seconds = 0, 0.0
    for policy in policies:
        for i in range(episodes):
            keep = policy is policies[0] and i < SHOWN
            episode = run_episode(policy, entry.env_id, seed + i, keep, **kwargs)
            rows.append(tuple(asdict(measure(episode)).values()))
            statuses.update(status.name for status in episode.statuses)
            steps, seconds = steps + len(episode.force), seconds + episode.seconds
            if keep:
                shown.append(episode)
    table = np.array(rows).reshape(len(policies), episodes, len(METRICS))
    metrics = {name: table[..., k] for k, name in enumerate(METRICS)}
    trainings = tuple(policy.training for policy in policies if isinstance(policy, LearnedPolicy))
    summary = summarize(metrics) | {
        "statuses": {status.name: statuses[status.name] for status in Status if statuses[status.name]},
        "decisions_per_second": steps / max(seconds, 1e-9),
        "training_seconds": float(np.median([training.seconds for training in trainings])) if trainings else 0.0,
    }
    return Result(entry, metrics, summary, tuple(shown), trainings)


def play_all(config: EvaluateConfig, entries: Sequence[Entry]) -> Iterator[Result]:
    """Play entries in several processes, and yield results as they come; the slowest entries start first."""
    with worker_pool(config.jobs) as pool:
        slowest_first = sorted(entries, key=_speed)
        futures = [pool.submit(play, entry, config.seed, config.episodes) for entry in slowest_first]
        for future in as_completed(futures):
            yield future.result()


def film_all(config: EvaluateConfig, results: Sequence[Result]) -> Iterator[Path]:
    """Record a video of every entry in several processes, all of an environment in one scene, and yield the files."""
    with worker_pool(config.jobs) as pool:
        futures = []
        for result in results:
            entry = result.entry
            scene = telling_scene([other for other in results if other.entry.env_id == entry.env_id])
            path = config.out / "videos" / f"{folder_name(entry.env_id)}-{entry.policy}.mp4"
            futures.append(pool.submit(film, entry, config.seed + scene, path))
        for future in as_completed(futures):
            yield future.result()


def film(entry: Entry, seed: int, path: Path) -> Path:
    """Record a video of the first training seed, and return its file."""
    record(entry.load()[0], entry.env_id, seed, path, sensing=entry.sensing, split="test")
    return path


def telling_scene(results: Sequence[Result]) -> int:
    """Return the scene in which policies differ most, of those where the best of them ends at the set-point, if any.

    Where it does not, its own failure may be the difference, and nobody sees what the set-point asks.
    """
    errors = np.array([result.rmse[0] for result in results])
    best = min(results, key=lambda result: float(iqm(result.rmse.ravel())))
    reached = best.metrics["success"][0] > 0
    spread = errors.max(axis=0) - errors.min(axis=0)
    return int(np.argmax(np.where(reached, spread, -1.0) if reached.any() else spread))


def _speed(entry: Entry) -> tuple[bool, bool]:
    """Return a key that sorts slow entries first: controllers on the exact model, and environments in space."""
    return entry.policy not in ("Newton", "Oracle"), "Spatial" not in entry.env_id
