"""Training: a run folder with configuration, checkpoints, learning curve, log and, at the end, the actor."""

import json
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback, EvalCallback
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

from agents.actor import ACTOR, Curve, Network, Training, export
from agents.config import CURVE_POINTS, VALIDATION_EPISODES, VALIDATION_SEED, TrainConfig
from agents.distillation import distill
from agents.learners import KINDS, environments, learner, scaled
from agents.tuned import DistilledSettings

CONFIG, MODEL, NORMALIZER, PROGRESS = "config.json", "model.zip", "normalizer.pkl", "progress.json"
CHECKPOINTS = 20  # in a run
LEAST_APART = 64  # steps of all environments between points of the curve


def train(config: TrainConfig, progress: bool = True) -> Path:
    """Train, or go on from the last checkpoint of the same run, and save; returns the run folder.

    Raises:
        ValueError: If the folder holds a run with other settings, which is left as it is.
    """
    torch.set_num_threads(1)  # faster than more for networks this small
    started = time.perf_counter()
    refuse_another(config)
    config.run.mkdir(parents=True, exist_ok=True)
    last = _last_checkpoint(config)
    if isinstance(config.learner, DistilledSettings):
        network, seen, curve = distill(config, config.learner, progress)
        export(config.run / ACTOR, network, seen, Training(config, curve, time.perf_counter() - started))
        return config.run
    model, spent = _resumed(config, last) if last else (_fresh(config), 0.0)
    keep = Checkpoints(config, lambda: spent + time.perf_counter() - started)
    validate = _validation(config, model.num_timesteps)
    model.learn(
        config.learner.steps - model.num_timesteps,
        callback=[validate, keep],
        progress_bar=progress,
        tb_log_name="log",
        reset_num_timesteps=last is None,
    )
    normalizer = model.get_vec_normalize_env()
    assert normalizer is not None
    assert isinstance(normalizer.obs_rms, RunningMeanStd)
    curve = Curve(tuple(validate.evaluations_timesteps), tuple(map(float, map(np.mean, validate.evaluations_results))))
    network = Network.of(model.policy, config.learner)
    export(config.run / ACTOR, network, normalizer.obs_rms, Training(config, curve, keep.seconds()))
    normalizer.close()
    return config.run


class Checkpoints(BaseCallback):
    """Keeps the last state of the learner and its normaliser in the run folder; a half-written one never counts.

    Args:
        config: Of the run.
        seconds: Tells how long the run has taken.
    """

    def __init__(self, config: TrainConfig, seconds: Callable[[], float]) -> None:
        super().__init__()
        self._config, self.seconds = config, seconds
        self._every = max(config.learner.steps // CHECKPOINTS, 1)
        self._next = 0

    def _on_training_start(self) -> None:
        self._next = self.num_timesteps + self._every

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        if self.num_timesteps >= self._next:
            self._next = self.num_timesteps + self._every
            self.keep()

    def keep(self) -> None:
        """Write a checkpoint, and remove the one before."""
        folder = self._config.run / f"checkpoint-{self.num_timesteps}"
        partial = self._config.run / "partial"
        shutil.rmtree(partial, ignore_errors=True)
        partial.mkdir()
        self.model.save(partial / MODEL)
        normalizer = self.model.get_vec_normalize_env()
        assert normalizer is not None
        normalizer.save(str(partial / NORMALIZER))
        (partial / PROGRESS).write_text(json.dumps({"seconds": self.seconds()}))
        before = list(self._config.run.glob("checkpoint-*"))
        partial.rename(folder)
        for old in before:
            shutil.rmtree(old)


def refuse_another(config: TrainConfig) -> None:
    """Check a run's folder.

    Raises:
        ValueError: If it holds a run with other settings.
    """
    path = config.run / CONFIG
    if path.is_file() and not TrainConfig.load(path).matches(config):
        raise ValueError(f"{config.run} holds a run with other settings; give another folder, or remove it")


def _last_checkpoint(config: TrainConfig) -> Path | None:
    """That of a run that is gone on with; a run that begins writes its configuration."""
    path = config.run / CONFIG
    kept = sorted(config.run.glob("checkpoint-*"), key=lambda folder: int(folder.name.split("-")[1]))
    if kept and path.is_file() and not (config.run / ACTOR).is_file():
        return kept[-1]
    for stale in (*kept, config.run / "log_1"):
        shutil.rmtree(stale, ignore_errors=True)
    (config.run / ACTOR).unlink(missing_ok=True)
    (config.run / "evaluations.npz").unlink(missing_ok=True)
    config.save(path)
    return None


def _fresh(config: TrainConfig) -> BaseAlgorithm:
    return learner(scaled(environments(config, config.learner.envs, config.seed), config), config)


def _resumed(config: TrainConfig, checkpoint: Path) -> tuple[BaseAlgorithm, float]:
    """The learner of a checkpoint, on scenes that were not yet drawn."""
    steps = int(checkpoint.name.split("-")[1])
    seed = int(np.random.SeedSequence([config.seed, steps]).generate_state(1)[0]) % (
        VALIDATION_SEED - config.learner.envs
    )
    envs = VecNormalize.load(str(checkpoint / NORMALIZER), environments(config, config.learner.envs, seed))
    model = KINDS[type(config.learner)].load(checkpoint / MODEL, env=envs, device="cpu")
    model.set_random_seed(seed)  # loading sets that of the run
    model.tensorboard_log = str(config.run)
    return model, float(json.loads((checkpoint / PROGRESS).read_text())["seconds"])


def _validation(config: TrainConfig, steps: int) -> EvalCallback:
    """Mean returns on training scenes of other seeds, at even distances; those before some steps are kept."""
    envs = scaled(environments(config, VALIDATION_EPISODES, VALIDATION_SEED), config)
    envs.training = False
    every = max(config.learner.steps // (CURVE_POINTS * config.learner.envs), LEAST_APART)
    validate = EvalCallback(
        envs, n_eval_episodes=VALIDATION_EPISODES, eval_freq=every, log_path=str(config.run), verbose=0, warn=False
    )
    path = config.run / "evaluations.npz"
    if path.is_file():
        with np.load(path) as before:
            count = int((before["timesteps"] <= steps).sum())
            validate.evaluations_timesteps = before["timesteps"][:count].tolist()
            validate.evaluations_results = before["results"][:count].tolist()
            validate.evaluations_length = before["ep_lengths"][:count].tolist()
    return validate
