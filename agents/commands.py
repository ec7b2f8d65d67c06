"""The commands of ``ccr-gym``; each imports what it needs when it runs."""

import contextlib
import io
import sys
from collections.abc import Sequence
from typing import Annotated, get_args

import tyro

from agents.command_line import learner_first, one_line
from agents.config import (
    BenchConfig,
    EstimateConfig,
    EvaluateConfig,
    PlayConfig,
    ReproduceConfig,
    RetrainConfig,
    SweepConfig,
    TrainConfig,
)
from agents.errors import UserError
from agents.tuned import played_steps, round_steps
from ccr_gym import __version__

ABOUT = "Train, evaluate and compare policies; --version prints the version."

Command = (
    Annotated[TrainConfig, tyro.conf.subcommand("train")]
    | Annotated[EvaluateConfig, tyro.conf.subcommand("evaluate")]
    | Annotated[RetrainConfig, tyro.conf.subcommand("retrain")]
    | Annotated[SweepConfig, tyro.conf.subcommand("sweep")]
    | Annotated[BenchConfig, tyro.conf.subcommand("bench")]
    | Annotated[ReproduceConfig, tyro.conf.subcommand("reproduce")]
    | Annotated[EstimateConfig, tyro.conf.subcommand("estimate")]
    | Annotated[PlayConfig, tyro.conf.subcommand("play")]
)
NAMES = tuple(kind.__metadata__[0].name for kind in get_args(Command))


def run() -> None:
    """Parse the command line and run the command."""
    match parse():
        case TrainConfig() as config:
            train(config)
        case EvaluateConfig() as config:
            evaluate(config)
        case RetrainConfig() as config:
            retrain(config)
        case SweepConfig() as config:
            sweep(config)
        case BenchConfig() as config:
            bench(config)
        case ReproduceConfig() as config:
            reproduce(config)
        case EstimateConfig() as config:
            estimate(config)
        case PlayConfig() as config:
            play(config)


def parse(arguments: Sequence[str] | None = None) -> Command:
    """Return the command and its settings from arguments, by default those of the process.

    Raises:
        SystemExit: If it asks for help or for the version, after printing it.
        UserError: If the arguments have an error.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given[:1] == ["--version"]:
        print(f"ccr-gym {__version__}")
        raise SystemExit
    if given and not given[0].startswith("-") and given[0] not in NAMES:
        raise UserError(f"there is no command {given[0]!r}; it must be one of {', '.join(NAMES)}; see ccr-gym --help")
    settings = (tyro.conf.OmitSubcommandPrefixes, tyro.conf.OmitArgPrefixes, tyro.conf.CascadeSubcommandArgs)
    written = io.StringIO()
    try:
        with contextlib.redirect_stderr(written):
            command: Command = tyro.cli(
                Command, prog="ccr-gym", args=learner_first(given), description=ABOUT, config=settings
            )
    except SystemExit as stop:
        if stop.code in (0, None):
            raise
        raise UserError(one_line(written.getvalue(), given)) from None
    return command


def train(config: TrainConfig) -> None:
    """Train a policy, or resume an interrupted run."""
    from agents.learning import training

    if training.is_finished(config):
        print(f"{config.run} is already finished; --restart trains it again from the beginning")
        return
    steps = played_steps(config.learner)
    if steps != config.learner.steps:
        rounds = f"whole rounds of {round_steps(config.learner):,}"
        print(f"Training plays {steps:,} steps, {rounds}, where --steps asks for {config.learner.steps:,}", flush=True)
    folder = training.train(config)
    print(f"Trained {config.learner.name} for {steps:,} steps on {config.env_id}; saved to {folder}")


def evaluate(config: EvaluateConfig) -> None:
    """Evaluate policies on test scenes."""
    from agents.benchmark import report, suite
    from agents.files import check_writable
    from agents.progress import followed

    entries = suite.entries(config)
    check_writable(*(config.out / name for name in ("evaluation.json", "scores.json", "evaluation.md")))
    if config.video:
        (config.out / "videos").mkdir(exist_ok=True)
    results = list(followed(suite.play_all(config, entries), "evaluate", len(entries)))
    if config.video:
        list(followed(suite.film_all(config, results), "film", len(results)))
    report.write(sorted(results, key=lambda result: entries.index(result.entry)), config)
    print(f"Written: {config.out}/evaluation.json, evaluation.md (more columns), figures{' and videos' * config.video}")


def retrain(config: RetrainConfig) -> None:
    """Train the learned baselines on every environment."""
    from agents.learning import retrain

    retrain.retrain(config)


def sweep(config: SweepConfig) -> None:
    """Tune a controller or a learner."""
    from agents.benchmark import sweep

    study = sweep.sweep(config)
    print(f"Best of {len(study.trials)} trials: {study.best_value:.3f} mN with {study.best_params}")


def bench(config: BenchConfig) -> None:
    """Measure the speed of kernel, environments and learning."""
    from agents.bench import report

    report.bench(config)


def reproduce(config: ReproduceConfig) -> None:
    """Put the paper's claims to the test, and reproduce its figures and table."""
    from agents.paper import reproduce

    reproduce.reproduce(config.out)
    print(f"Written: {config.out}/paper.md, with its figures, and {config.out}/paper.json")


def estimate(config: EstimateConfig) -> None:
    """Estimate shape, contacts and contact force from the log of a real robot."""
    from agents.replay.run import run

    found = run(config)
    known, scales, largest = found.known[-1], found.scales, int(found.force_n.argmax())
    end = {
        name: " (at the end of its range)" if name in found.warnings else "" for name in ("rigidity", "loss", "play")
    }
    print(f"Rigidity: {known.rigidity:.3g} ± {known.rigidity_std:.2g} times that of {config.robot}{end['rigidity']}")
    print(f"Loss of tension to friction: {known.loss:.3f} ± {known.loss_std:.2g}{end['loss']}")
    backlash, deviation = (2 * scales.travel_mm * value for value in (known.half_backlash, known.half_backlash_std))
    print(f"Play between motor and cable: {backlash:.3g} ± {deviation:.2g} mm{end['play']}")
    line, force, spread = found.log.rows[largest], found.force_n[largest], found.force_std_n[largest]
    at = f"{force:.3g} ± {spread:.2g} N, in line {line} of {config.log}" if force > 0 else "no contact"
    print(f"Largest contact force: {at}")
    for warning in found.warnings.values():
        print(f"ccr-gym: warning: {warning}", file=sys.stderr)
    print(f"Written: {config.out}/estimate.csv, shape.csv, estimate.json and estimate.png")


def play(config: PlayConfig) -> None:
    """Serve a page to play with a robot in the browser."""
    try:
        import viser  # noqa: F401 - looked for before anything slow is imported
    except ModuleNotFoundError as error:
        raise UserError('play needs its extra: pip install "ccr-gym[play]"') from error
    from agents.play import serve

    serve.play(config)
