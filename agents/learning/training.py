"""Training runs: a folder that receives configuration, checkpoints, log and finally the actor."""

import contextlib
from pathlib import Path

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback, EvalCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

from agents.config import CURVE_POINTS, VALIDATION_EPISODES, VALIDATION_SEED, TrainConfig, check_parallel
from agents.errors import UserError
from agents.files import LOCK, PARTIAL, locked
from agents.learning.actor import ACTOR, LearnedPolicy, LearningCurve, TrainingRecord, export
from agents.learning.checkpoint import CHECKPOINT, TrainingRun, learner_state, restore_learner
from agents.learning.distillation import distill
from agents.learning.learners import make_envs, make_learner, normalized_envs, play_on
from agents.learning.log import LOG, own_files, recording
from agents.learning.network import Network
from agents.tuned import DistilledSettings

CONFIG = "config.json"
LEAST_INTERVAL = 64  # steps of all environments between two validations


def train(config: TrainConfig, progress: bool = True) -> Path:
    """Train a policy, or resume its run from the last checkpoint; return the run folder.

    A finished run is left as it is, unless it is to be restarted.

    Args:
        config: Configuration of the run.
        progress: Whether to show a progress bar.

    Raises:
        UserError: If the folder holds anything but a run, a run with other settings or a damaged one; if another
            process is training in it; if it cannot be written; if this machine has not enough cores for the threads.
    """
    torch.set_num_threads(1)  # the fastest for networks this small
    if is_finished(config):
        return config.run
    _check_threads(config.threads)
    config.run.mkdir(parents=True, exist_ok=True)
    with locked(config.run):
        if is_finished(config):  # by another process, in the meantime
            return config.run
        run = _start(config)
        try:
            network, statistics = _learn(run, progress)
        except OSError as error:  # from the log; all other writers name their file
            raise UserError(f"{config.run / LOG} cannot be written: {error.strerror or error}") from error
        curve = LearningCurve(tuple(run.progress.curve_steps), tuple(run.progress.curve_returns))
        export(config.run / ACTOR, network, statistics, TrainingRecord(config, curve, run.seconds))
        delete(config.run, CHECKPOINT, PARTIAL + CHECKPOINT)
    return config.run


def _check_threads(threads: int) -> None:
    """Refuse more threads than this machine takes: not when a configuration is made, which may be of another one."""
    try:
        check_parallel("threads", threads)
    except ValueError as error:
        raise UserError(str(error)) from error


def _start(config: TrainConfig) -> TrainingRun:
    """Return the run to resume, or a new one after writing its configuration."""
    log = own_files(config.run)
    if config.restart:
        delete(config.run, ACTOR, PARTIAL + ACTOR, CHECKPOINT, *log)
    run = TrainingRun(config)
    if run.state is None:
        delete(config.run, *log)
        config.save(config.run / CONFIG)
    return run


class Validation(EvalCallback):
    """Measures the mean return on scenes of the training split kept out of training, at even intervals.

    Args:
        run: The run, whose progress receives the learning curve.
    """

    def __init__(self, run: TrainingRun) -> None:
        settings = run.config.learner
        envs = normalized_envs(make_envs(run.config, VALIDATION_EPISODES, VALIDATION_SEED), run.config)
        envs.training = False
        every = max(settings.steps // (CURVE_POINTS * settings.envs), LEAST_INTERVAL)
        super().__init__(envs, n_eval_episodes=VALIDATION_EPISODES, eval_freq=every, verbose=0, warn=False)
        self._run, self.n_calls = run, run.progress.steps // settings.envs

    def _on_step(self) -> bool:
        continues = super()._on_step()
        if self.n_calls % self.eval_freq == 0:
            self._run.progress.add_validation(self.num_timesteps, self.last_mean_reward)
        return continues


class Checkpoints(BaseCallback):
    """Saves the learner each time it has learned from a rollout.

    Args:
        run: The run.
    """

    def __init__(self, run: TrainingRun) -> None:
        super().__init__()
        self._run = run

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:  # at the end of a rollout its update is still to come
        self._run.save_if_due(self.num_timesteps, lambda: learner_state(self.model))


def is_finished(config: TrainConfig) -> bool:
    """Return whether the run's folder holds its result, and the run is not to be restarted.

    Raises:
        UserError: If it holds a run with other settings, or other files, or if its result is damaged.
    """
    path = config.run / CONFIG
    if path.is_file():
        if not TrainConfig.load(path).matches(config) and not config.restart:
            raise UserError(f"{config.run} holds a run with other settings; choose another folder, or use --restart")
    elif config.run.is_dir():
        _refuse_other_files(config.run)
    if config.restart or not (config.run / ACTOR).is_file():
        return False
    LearnedPolicy(config.run)
    return True


def _refuse_other_files(folder: Path) -> None:
    own = (LOCK, PARTIAL + CONFIG)  # of a run that was killed before it wrote its configuration
    if foreign := sorted(path.name for path in folder.iterdir() if path.name not in own):
        raise UserError(f"{folder} holds {foreign[0]} but no {CONFIG}; choose a new or empty folder for the run")


def delete(folder: Path, *names: str) -> None:
    """Delete files of a run from its folder, and the log folder if it is then empty.

    Raises:
        UserError: If one of them is a folder; nothing is deleted then.
    """
    for name in names:
        if (folder / name).is_dir():
            raise UserError(f"{folder / name} is a folder, where the run keeps a file; move it away")
    for name in names:
        (folder / name).unlink(missing_ok=True)
    with contextlib.suppress(OSError):  # it does not exist, or holds other files
        (folder / LOG).rmdir()


def _learn(run: TrainingRun, progress: bool) -> tuple[Network, RunningMeanStd]:
    """Train to the end of a run; return the network and the statistics that its rows are normalised by."""
    config = run.config
    if isinstance(config.learner, DistilledSettings):
        return distill(run, config.learner, progress)
    envs = normalized_envs(make_envs(config, config.learner.envs, run.seed), config)
    model = make_learner(envs, config)
    if run.state:
        with run.rejecting_damage():
            restore_learner(model, run.progress.steps, run.state)
        model.set_random_seed(run.seed)  # the learner was made with the seed of the configuration
        _play_on(model, envs)
    with recording(config.run) as log:
        model.set_logger(configure(str(log), ["tensorboard"]))
    remaining = config.learner.steps - model.num_timesteps
    model.learn(remaining, [Validation(run), Checkpoints(run)], progress_bar=progress, reset_num_timesteps=False)
    assert isinstance(envs.obs_rms, RunningMeanStd)
    envs.close()
    return Network.of(model.policy, config.learner), envs.obs_rms


def _play_on(model: BaseAlgorithm, envs: VecNormalize) -> None:
    """Let a restored learner go on amid the episodes, by what it knows."""
    envs.training = False
    model._last_obs, model._last_episode_starts = play_on(model, envs, model.num_timesteps // envs.num_envs)  # type: ignore[assignment]
    model._last_original_obs = envs.get_original_obs()
    envs.training = True
