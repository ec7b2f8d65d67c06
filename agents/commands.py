"""What the ``ccr-gym`` command does."""

from typing import Annotated, Any

import tyro

from agents.config import (
    BenchConfig,
    EvaluateConfig,
    ReproduceConfig,
    RetrainConfig,
    SweepConfig,
    TrainConfig,
)

Command = (
    Annotated[TrainConfig, tyro.conf.subcommand("train")]
    | Annotated[EvaluateConfig, tyro.conf.subcommand("evaluate")]
    | Annotated[RetrainConfig, tyro.conf.subcommand("retrain")]
    | Annotated[SweepConfig, tyro.conf.subcommand("sweep")]
    | Annotated[BenchConfig, tyro.conf.subcommand("bench")]
    | Annotated[ReproduceConfig, tyro.conf.subcommand("reproduce")]
)


def train(config: TrainConfig) -> None:
    """Train a policy on an environment, or go on with a run that was interrupted."""
    from agents.learning.training import is_finished
    from agents.learning.training import train as run

    if is_finished(config):
        print(f"{config.run} is finished already; --restart trains it anew")
        return
    folder = run(config)
    print(f"Trained {config.learner.name} for {config.learner.steps} steps on {config.env_id}; saved to {folder}")


def evaluate(config: EvaluateConfig) -> None:
    """Evaluate policies on test scenes they were never trained or tuned on."""
    from rich.progress import track

    from agents.benchmark import report, suite

    played = suite.entries(config)
    (config.out / "videos").mkdir(parents=True, exist_ok=True)
    results = list(track(suite.play_all(config, played), "evaluate", len(played)))
    report.write(sorted(results, key=lambda result: played.index(result.entry)), config)
    print("Force error: root mean square after the search, interquartile mean with its 95 % interval.")
    print(f"closed: share of the way from {report.RIVAL} to {report.BOUND}; * where the intervals are disjoint.")
    print(f"Written: {config.out}/evaluation.json, evaluation.md, figures and videos")


def retrain(config: RetrainConfig) -> None:
    """Train every learned baseline on every environment, as the shipped policies were."""
    from agents.learning.retrain import retrain as run

    run(config)


def sweep(config: SweepConfig) -> None:
    """Search settings of a controller or a learner on training scenes, with Optuna."""
    from agents.benchmark.sweep import sweep as run

    study = run(config)
    print(f"Best of {len(study.trials)}: {study.best_value:.3f} mN with {study.best_params}")


def bench(config: BenchConfig) -> None:
    """Measure the kernel, the environments and a learner on them, beside peers in the same run."""
    from agents.bench.report import bench as run

    run(config)


def reproduce(config: ReproduceConfig) -> None:
    """Regenerate the paper's figures and table, and check its claims in numbers."""
    from agents.paper.reproduce import reproduce as run

    for claim in run(config.out):
        print(f"{'holds' if claim.holds else 'DOES NOT HOLD'}: {claim.sentence}\n    {claim.found}")
    print(f"Written: {config.out}/paper.json, {config.out}/paper.png")


def run() -> None:
    """Read the command line and do what it says."""
    command: Any = tyro.cli(
        Command, prog="ccr-gym", config=(tyro.conf.OmitSubcommandPrefixes, tyro.conf.OmitArgPrefixes)
    )
    COMMANDS[type(command)](command)


COMMANDS: dict[type, Any] = {
    TrainConfig: train,
    EvaluateConfig: evaluate,
    RetrainConfig: retrain,
    SweepConfig: sweep,
    BenchConfig: bench,
    ReproduceConfig: reproduce,
}
