"""Training: a run folder with configuration, checkpoint, log and, at the end, the actor."""

import contextlib
from pathlib import Path

import torch
from stable_baselines3.common.callbacks import BaseCallback, EvalCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.running_mean_std import RunningMeanStd

from agents.config import CURVE_POINTS, VALIDATION_EPISODES, VALIDATION_SEED, TrainConfig
from agents.errors import UserError
from agents.files import LOCK, PARTIAL, locked
from agents.learning.actor import ACTOR, Curve, Network, Training, export
from agents.learning.checkpoint import CHECKPOINT, Run, learner_state, restore_learner
from agents.learning.distillation import distill
from agents.learning.learners import environments, learner, scaled
from agents.tuned import DistilledSettings

CONFIG, LOG = "config.json", "log_1"
EVENTS = f"{LOG}/events.out.tfevents.*"
LEAST_APART = 64  # steps of all environments between points of the curve


def train(config: TrainConfig, progress: bool = True) -> Path:
    """Train, or go on from the last checkpoint of the same run, and save; returns the run folder.

    A finished run is left as it is, unless it is to begin again.

    Raises:
        UserError: If the folder holds something else, a run with other settings or a damaged one; if another process is
            training in it; if it cannot be written.
    """
    torch.set_num_threads(1)  # faster than more for networks this small
    if is_finished(config):
        return config.run
    config.run.mkdir(parents=True, exist_ok=True)
    with locked(config.run):
        if is_finished(config):  # by now
            return config.run
        if config.restart:
            delete(config.run, ACTOR, PARTIAL + ACTOR, CHECKPOINT)
        run = Run(config)
        if run.state is None:
            delete(config.run, EVENTS)
            config.save(config.run / CONFIG)
        try:
            network, scaling = _learn(run, progress)
        except OSError as error:  # of the log: all else tells its file
            raise UserError(f"{config.run / LOG} cannot be written: {error.strerror or error}") from error
        curve = Curve(tuple(run.progress.curve_steps), tuple(run.progress.curve_returns))
        export(config.run / ACTOR, network, scaling, Training(config, curve, run.seconds))
        delete(config.run, CHECKPOINT, PARTIAL + CHECKPOINT)
    return config.run


class Validation(EvalCallback):
    """Mean returns on training scenes of other seeds, at even distances.

    Args:
        run: The run; the curve is written to its progress.
    """

    def __init__(self, run: Run) -> None:
        settings = run.config.learner
        envs = scaled(environments(run.config, VALIDATION_EPISODES, VALIDATION_SEED), run.config)
        envs.training = False
        every = max(settings.steps // (CURVE_POINTS * settings.envs), LEAST_APART)
        super().__init__(envs, n_eval_episodes=VALIDATION_EPISODES, eval_freq=every, verbose=0, warn=False)
        self._run, self.n_calls = run, run.progress.steps // settings.envs

    def _on_step(self) -> bool:
        going_on = super()._on_step()
        if self.n_calls % self.eval_freq == 0:
            self._run.progress.validated(self.num_timesteps, self.last_mean_reward)
        return going_on


class Checkpoints(BaseCallback):
    """Keeps the learner, each time after it has learnt from a rollout.

    Args:
        run: The run.
    """

    def __init__(self, run: Run) -> None:
        super().__init__()
        self._run = run

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:  # where a rollout ends, its update is still to come
        self._run.keep(self.num_timesteps, lambda: learner_state(self.model))


def is_finished(config: TrainConfig) -> bool:
    """Whether the folder of a run holds what it would make, and it is not to begin again.

    Raises:
        UserError: If it holds a run with other settings, or files of something else.
    """
    path = config.run / CONFIG
    if path.is_file():
        if not TrainConfig.load(path).matches(config) and not config.restart:
            raise UserError(f"{config.run} holds a run with other settings; give another folder, or --restart")
    elif config.run.is_dir():
        own = (LOCK, PARTIAL + CONFIG)  # of a run that ended before it began
        if foreign := sorted(path.name for path in config.run.iterdir() if path.name not in own):
            raise UserError(f"{config.run} holds {foreign[0]} but no {CONFIG}: give a new or an empty folder for a run")
    return (config.run / ACTOR).is_file() and not config.restart


def delete(folder: Path, *names: str) -> None:
    """Delete some of what a run wrote into its folder, and its log folder if that leaves it empty."""
    for name in names:
        for path in folder.glob(name):
            path.unlink()
    with contextlib.suppress(OSError):  # not there, or other files are
        (folder / LOG).rmdir()


def _learn(run: Run, progress: bool) -> tuple[Network, RunningMeanStd]:
    """Learn from where a run is to its end; the network, and what its rows are scaled by."""
    config, log = run.config, run.config.run / LOG
    if isinstance(config.learner, DistilledSettings):
        return distill(run, config.learner, log, progress)
    envs = scaled(environments(config, config.learner.envs, run.seed), config)
    model = learner(envs, config)
    if run.state:
        with run.refusing_damage():
            restore_learner(model, run.progress.steps, run.state)
        model.set_random_seed(run.seed)  # it was made with that of the run
    model.set_logger(configure(str(log), ["tensorboard"]))
    remaining = config.learner.steps - model.num_timesteps
    model.learn(remaining, [Validation(run), Checkpoints(run)], progress_bar=progress, reset_num_timesteps=False)
    assert isinstance(envs.obs_rms, RunningMeanStd)
    envs.close()
    return Network.of(model.policy, config.learner), envs.obs_rms
