"""The benchmark: every policy on every environment, on the same test scenes."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from agents.benchmark.evaluate import METRICS, Episode, measure, run_episode
from agents.benchmark.statistics import cvar, iqm, iqm_interval
from agents.benchmark.video import record
from agents.config import PRETRAINED, EvaluateConfig
from agents.controllers.force import ForceController
from agents.controllers.mpc import PredictiveController
from agents.controllers.newton import NewtonController
from agents.errors import UserError
from agents.learning.actor import SUFFIX, LearnedPolicy, Training
from agents.policy import Policy
from agents.tuned import LEARNERS
from agents.workers import workers
from solver import Status

SHOWN = 4  # first episodes that are kept for figures


@dataclass(frozen=True, slots=True)
class Entry:
    """A policy on an environment.

    Attributes:
        policy: Its name.
        env_id: The environment.
        sensing: What it is played with.
        files: Trained policies, one for each training seed; none for a controller.
    """

    policy: str
    env_id: str
    sensing: str
    files: tuple[Path, ...] = ()

    def load(self) -> list[Policy]:
        """The policies of all training seeds, or the controller."""
        controllers: dict[str, Any] = {
            "P": ForceController.proportional_only,
            "PI": ForceController.tuned,
            "MPC": PredictiveController.tuned,
            "Newton": lambda _: NewtonController(),
            "Oracle": lambda _: NewtonController.knowing(),
        }
        if self.policy in controllers:
            return [controllers[self.policy](self.env_id)]
        return [LearnedPolicy(file) for file in self.files]


@dataclass(frozen=True, slots=True)
class Result:
    """What an entry achieved.

    Attributes:
        entry: Which.
        metrics: Of every training seed and episode, ``(seeds, episodes)`` each, by name.
        summary: The numbers of a table, as :func:`summarize` gives them.
        shown: First episodes of the first training seed.
        trainings: How the policy of every training seed was made; none for a controller.
    """

    entry: Entry
    metrics: dict[str, np.ndarray]
    summary: dict[str, Any]
    shown: tuple[Episode, ...] = ()
    trainings: tuple[Training, ...] = ()

    @property
    def rmse(self) -> np.ndarray:
        """Force error of every training seed and episode, ``(seeds, episodes)`` [mN]."""
        return self.metrics["rmse_mn"]

    def as_dict(self) -> dict[str, Any]:
        """For JSON: summary and every episode."""
        episodes = {name: np.round(values, 5).tolist() for name, values in self.metrics.items()}
        entry = asdict(self.entry) | {"files": [file.name for file in self.entry.files]}
        return entry | {"summary": self.summary, "episodes": episodes}


def summarize(metrics: dict[str, np.ndarray]) -> dict[str, Any]:
    """Interquartile mean of the force error with its interval and tail mean; means or medians of what else there is."""
    rmse = metrics["rmse_mn"]
    return {
        **{name: float(values.mean()) for name, values in metrics.items()},
        "settling_step": float(np.median(metrics["settling_step"])),
        "overshoot": float(np.median(metrics["overshoot"])),
        "rmse_iqm_mn": float(iqm(rmse.ravel())),
        "rmse_interval_mn": iqm_interval(rmse),
        "rmse_of_seeds_mn": [float(iqm(row)) for row in rmse],
        "rmse_cvar_mn": cvar(rmse.ravel()),
    }


def entries(config: EvaluateConfig) -> list[Entry]:
    """What is to be played.

    Raises:
        FileNotFoundError: If a run has no trained policy.
        UserError: If a file is something else, runs were made with different sensing, or there are no trained policies
            where learners are asked for.
    """
    if not config.runs:
        return _without_runs(config)
    found: dict[tuple[str, str], list[Path]] = {}
    sensings: dict[str, Path] = {}
    for run in config.runs:
        learned = LearnedPolicy(run)
        trained_as = learned.training.config
        found.setdefault((trained_as.env_id, learned.name), []).append(run)
        sensings[trained_as.sensing] = run
    if len(sensings) > 1:
        told = " and ".join(f"{run} with {sensing}" for sensing, run in sensings.items())
        raise UserError(f"runs must have the same sensing; {told}. Evaluate them apart")
    (sensing,) = sensings
    played = [Entry(name, env_id, sensing, tuple(files)) for (env_id, name), files in found.items()]
    for env_id in dict.fromkeys(env_id for env_id, _ in found):
        played += [Entry(name, env_id, sensing) for name in config.policies if name not in LEARNERS]
    return played


def _without_runs(config: EvaluateConfig) -> list[Entry]:
    played = [
        Entry(policy, env_id, "realistic", files)
        for env_id in config.env_ids
        for policy in config.policies
        for files in [trained(policy, env_id, config.pretrained)]
        if policy not in LEARNERS or files
    ]
    learners = [policy for policy in config.policies if policy in LEARNERS]
    if learners and not any(entry.files for entry in played):
        place = f"{config.pretrained}/{learners[0]}/{folder_name(config.env_ids[0])}/0{SUFFIX}"
        raise UserError(f"there are no trained policies as {place}; ccr-gym retrain makes them")
    return played


def trained(learner: str, env_id: str, folder: Path = PRETRAINED) -> tuple[Path, ...]:
    """Files of trained policies, in order of their training seeds; by default those that come with the package."""
    return tuple(sorted((folder / learner / folder_name(env_id)).glob(f"*{SUFFIX}")))


def folder_name(env_id: str) -> str:
    """Name of an environment as that of a folder."""
    return env_id.split("/")[-1]


def play(entry: Entry, seed: int, episodes: int, video: Path | None = None) -> Result:
    """Play an entry's episodes, of consecutive seeds; record the first to a video if asked for."""
    told = {"sensing": entry.sensing, "split": "test"}
    policies, shown, rows = entry.load(), [], []
    statuses: Counter[str] = Counter()
    steps, seconds = 0, 0.0
    for policy in policies:
        for i in range(episodes):
            keep = policy is policies[0] and i < SHOWN
            episode = run_episode(policy, entry.env_id, seed + i, keep, **told)
            rows.append(tuple(asdict(measure(episode)).values()))
            statuses.update(status.name for status in episode.statuses)
            steps, seconds = steps + len(episode.true), seconds + episode.seconds
            if keep:
                shown.append(episode)
    if video is not None:
        record(policies[0], entry.env_id, seed, video, **told)
    table = np.array(rows).reshape(len(policies), episodes, len(METRICS))
    metrics = {name: table[..., k] for k, name in enumerate(METRICS)}
    trainings = tuple(policy.training for policy in policies if isinstance(policy, LearnedPolicy))
    summary = summarize(metrics) | {
        "statuses": {status.name: statuses[status.name] for status in Status if statuses[status.name]},
        "decisions_per_second": steps / max(seconds, 1e-9),
        "training_seconds": float(np.median([training.seconds for training in trainings])) if trainings else 0.0,
    }
    return Result(entry, metrics, summary, tuple(shown), trainings)


def play_all(config: EvaluateConfig, played: list[Entry]) -> Iterator[Result]:
    """Play entries on several processes, and give their results as they come."""
    with workers(config.jobs) as pool:
        waiting = []
        for entry in sorted(
            played, key=lambda entry: (entry.policy not in ("Newton", "Oracle"), "Spatial" not in entry.env_id)
        ):
            video = config.out / "videos" / f"{folder_name(entry.env_id)}-{entry.policy}.mp4" if config.video else None
            waiting.append(pool.submit(play, entry, config.seed, config.episodes, video))
        for future in waiting:
            yield future.result()
