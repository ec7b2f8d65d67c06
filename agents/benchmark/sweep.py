"""Tuning of controllers and learners on training scenes, with Optuna."""

from dataclasses import replace

import optuna
from sqlalchemy.exc import SQLAlchemyError

from agents.benchmark.evaluate import scores
from agents.benchmark.statistics import iqm
from agents.config import VALIDATION_SEED, SweepConfig, TrainConfig
from agents.controllers.force import ForceController
from agents.controllers.harmonic import HarmonicController
from agents.controllers.mpc import PredictiveController
from agents.controllers.newton import NewtonController
from agents.errors import UserError
from agents.learning import training
from agents.learning.actor import LearnedPolicy
from agents.learning.pretrained import folder_name
from agents.policy import Policy
from agents.tuned import (
    LEARNERS,
    DistilledSettings,
    LearnerSettings,
    MPCSettings,
    PPOSettings,
    RecurrentPPOSettings,
    SACSettings,
    sensing_of,
)

PREDICTIVE = {"MPC": PredictiveController, "Harmonic": HarmonicController}


def sweep(config: SweepConfig) -> optuna.Study:
    """Add trials to a study, which the output folder keeps; the best trial has the smallest force error.

    Raises:
        UserError: If the study cannot be read or written.
    """
    config.out.mkdir(parents=True, exist_ok=True)
    name = f"{config.what}-{folder_name(config.env_id)}"
    path = config.out / f"{name}.db"
    try:
        study = optuna.create_study(study_name=name, storage=f"sqlite:///{path}", load_if_exists=True)
        study.sampler = optuna.samplers.TPESampler(seed=len(study.trials))
        study.optimize(lambda trial: _score(trial, config), config.trials, show_progress_bar=True)
    except (SQLAlchemyError, optuna.exceptions.StorageInternalError) as error:
        cause = error.__cause__ or error
        raise UserError(f"{path} is not a study that can be resumed: {cause.args[0]}") from error
    return study


def _score(trial: optuna.Trial, config: SweepConfig) -> float:
    """Return the interquartile mean of the force error on training scenes [mN]."""
    kwargs = {"sensing": sensing_of(config.env_id), "split": "train"}
    errors = scores(_policy(trial, config), config.env_id, VALIDATION_SEED, config.episodes, **kwargs)
    return float(iqm(errors))


def _policy(trial: optuna.Trial, config: SweepConfig) -> Policy:
    if config.what in LEARNERS:
        return _learned(trial, config)
    if config.what in PREDICTIVE:
        return PREDICTIVE[config.what](_mpc(trial))
    if config.what == "Newton":
        return NewtonController(gain=trial.suggest_float("gain", 0.2, 1.0))
    proportional = trial.suggest_float("proportional", 0.0, 4.0) if config.what == "PI" else 0.0
    return ForceController(proportional, trial.suggest_float("integral", 0.05, 4.0, log=True), name=config.what)


def _mpc(trial: optuna.Trial) -> MPCSettings:
    return MPCSettings(
        effort=trial.suggest_float("effort", 0.001, 10.0, log=True),
        slope=trial.suggest_float("slope", 0.1, 40.0, log=True),
        least_slope=trial.suggest_float("least_slope", 0.1, 10.0, log=True),
        trust=trial.suggest_float("trust", 1e-6, 0.01, log=True),
        stiffening=trial.suggest_float("stiffening", 0.1, 10.0, log=True),
        width=trial.suggest_float("width", 0.005, 0.25, log=True),
    )


def _learned(trial: optuna.Trial, config: SweepConfig) -> Policy:
    """Return a policy that was trained with the settings of a trial."""
    settings = _settings(trial, replace(LEARNERS[config.what](), steps=config.steps))
    run = config.out / f"{config.what}-{folder_name(config.env_id)}-{trial.number}"
    trained = TrainConfig(run=run, env_id=config.env_id, sensing=sensing_of(config.env_id), learner=settings)
    return LearnedPolicy(training.train(trained, progress=False))


def _settings(trial: optuna.Trial, base: LearnerSettings) -> LearnerSettings:
    base = replace(
        base,
        learning_rate=trial.suggest_float("learning_rate", 1e-4, 3e-3, log=True),
        batch_size=trial.suggest_categorical("batch_size", [256, 512, 1024, 2048]),
        width=trial.suggest_categorical("width", [32, 64, 128]),
    )
    if isinstance(base, DistilledSettings):
        return replace(
            base,
            gradient_steps=trial.suggest_categorical("gradient_steps", [200, 400, 800]),
            huber=trial.suggest_float("huber", 0.02, 1.0, log=True),
        )
    base = replace(base, gamma=1 - trial.suggest_float("1 - gamma", 0.01, 0.2, log=True))
    if isinstance(base, SACSettings):
        return replace(
            base,
            tau=trial.suggest_float("tau", 0.003, 0.05, log=True),
            gradient_steps=trial.suggest_categorical("gradient_steps", [2, 4, 8, 16]),
        )
    return _on_policy(trial, base)


def _on_policy(trial: optuna.Trial, base: PPOSettings | RecurrentPPOSettings) -> PPOSettings | RecurrentPPOSettings:
    base = replace(
        base,
        rollout=trial.suggest_categorical("rollout", [32, 64, 128]),
        epochs=trial.suggest_int("epochs", 4, 12),
        gae_lambda=trial.suggest_float("gae_lambda", 0.8, 0.98),
        log_std_init=trial.suggest_float("log_std_init", -1.5, 0.0),
    )
    if isinstance(base, RecurrentPPOSettings):
        return replace(base, hidden=trial.suggest_categorical("hidden", [16, 32, 64]))
    return base
