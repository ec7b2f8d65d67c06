"""Training of all learned baselines, several runs side by side."""

import shutil
from concurrent.futures import as_completed
from dataclasses import replace

from rich.progress import track

from agents.benchmark.suite import folder_name
from agents.config import RetrainConfig, TrainConfig
from agents.files import replacing
from agents.learning.actor import ACTOR, SUFFIX
from agents.learning.training import is_finished, train
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
    """Train what is not trained yet, and put the actors where evaluation finds shipped ones, in ``out``.

    Raises:
        UserError: If a run is there with other settings; all are left as they are.
    """
    asked = runs(config)
    missing = [run for run in asked if not is_finished(run)]
    with workers(config.jobs) as pool:
        waiting = [pool.submit(train, run, False) for run in missing]
        for future in track(as_completed(waiting), "retrain", len(waiting)):
            future.result()
    for run in asked:
        with replacing(run.run.with_suffix(SUFFIX)) as partial:
            shutil.copyfile(run.run / ACTOR, partial)
