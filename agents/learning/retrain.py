"""Training of all learned baselines, with several runs in parallel."""

import shutil
from concurrent.futures import as_completed
from dataclasses import replace

from agents.config import RetrainConfig, TrainConfig
from agents.files import replacing
from agents.learning.actor import ACTOR
from agents.learning.pretrained import SUFFIX, folder_name
from agents.learning.training import is_finished, train
from agents.progress import followed
from agents.tuned import learner_settings, sensing_of
from agents.workers import worker_pool


def runs(config: RetrainConfig) -> list[TrainConfig]:
    """Return the configurations of all runs."""
    return [
        TrainConfig(
            run=config.out / learner / folder_name(env_id) / str(seed),
            env_id=env_id,
            sensing=sensing_of(env_id),
            seed=1000 * seed,
            threads=1,
            learner=replace(settings, steps=max(1, round(config.share * settings.steps))),
        )
        for seed in range(config.seeds)
        for learner in config.learners
        for env_id in config.env_ids
        for settings in [learner_settings(learner, sensing_of(env_id))]
    ]


def retrain(config: RetrainConfig) -> None:
    """Train what is not finished yet, and copy the policies to where ``evaluate --pretrained`` looks for them.

    Raises:
        UserError: If a folder holds a run with other settings; nothing is changed then.
    """
    configs = runs(config)
    missing = [run for run in configs if not is_finished(run)]
    with worker_pool(config.jobs) as pool:
        futures = [pool.submit(train, run, False) for run in missing]
        for future in followed(as_completed(futures), "retrain", len(futures)):
            future.result()
    for run in configs:
        with replacing(run.run.with_suffix(SUFFIX)) as partial:
            shutil.copyfile(run.run / ACTOR, partial)
