"""Training of all learned baselines, several runs side by side."""

import shutil
from concurrent.futures import as_completed
from dataclasses import replace

from rich.progress import track

from agents.actor import ACTOR
from agents.config import RetrainConfig, TrainConfig
from agents.suite import folder_name
from agents.training import refuse_another, train
from agents.tuned import LEARNERS
from agents.workers import workers


def runs(config: RetrainConfig) -> list[TrainConfig]:
    """The runs that are asked for."""
    return [
        TrainConfig(
            run=config.out / learner / folder_name(env_id) / str(seed),
            env_id=env_id,
            seed=1000 * seed,
            threads=1,
            learner=replace(settings, steps=max(1, round(config.share * settings.steps))),
        )
        for seed in range(config.seeds)
        for learner in config.learners
        for env_id in config.env_ids
        for settings in [LEARNERS[learner]()]
    ]


def retrain(config: RetrainConfig) -> None:
    """Train what is not trained yet, and put the actors where :mod:`agents.suite` finds shipped ones, in ``out``.

    Raises:
        ValueError: If a run is there with other settings; all are left as they are.
    """
    asked = runs(config)
    for run in asked:
        refuse_another(run)
    missing = [run for run in asked if not (run.run / ACTOR).is_file()]
    with workers(config.jobs) as pool:
        waiting = [pool.submit(train, run, False) for run in missing]
        for future in track(as_completed(waiting), "retrain", len(waiting)):
            future.result()
    for run in asked:
        shutil.copy(run.run / ACTOR, run.run.with_suffix(".pt"))
