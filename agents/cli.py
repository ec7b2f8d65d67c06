"""The ``ccr-gym`` command."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

try:
    import tyro
except ModuleNotFoundError as error:
    raise SystemExit('the ccr-gym command needs its extra: pip install "ccr-gym[agents]"') from error

from agents.config import BenchConfig, EvaluateConfig, ReproduceConfig, TrainConfig

if TYPE_CHECKING:
    from agents.evaluate import Summary

Command = (
    Annotated[TrainConfig, tyro.conf.subcommand("train")]
    | Annotated[EvaluateConfig, tyro.conf.subcommand("evaluate")]
    | Annotated[BenchConfig, tyro.conf.subcommand("bench")]
    | Annotated[ReproduceConfig, tyro.conf.subcommand("reproduce")]
)


def train(config: TrainConfig) -> None:
    """Train PPO on an environment; the defaults solve CCR/PushObstacle-v0."""
    from gymnasium.error import UnregisteredEnv

    from agents import ppo

    try:
        folder = ppo.train(config)
    except UnregisteredEnv as error:
        raise SystemExit(str(error)) from error
    print(f"Trained for {config.steps} steps on {config.env_id}; saved to {folder}")


def evaluate(config: EvaluateConfig) -> None:
    """Evaluate a trained policy beside the classical controllers, on scenes it was never trained on."""
    from agents.evaluate import run_episodes, summarize
    from agents.figures import draw_evaluation
    from agents.policy import ForceController, NewtonController, Policy
    from agents.ppo import PPOPolicy
    from agents.video import record

    try:
        learned = PPOPolicy(config.run)
    except (FileNotFoundError, ValueError) as error:
        raise SystemExit(str(error)) from error
    env_id = learned.config.env_id
    policies: tuple[Policy, ...] = (learned, ForceController.tuned(env_id), NewtonController())
    told = {"sensing": learned.config.sensing, "split": "test"}
    episodes = {p.name: run_episodes(p, env_id, config.seed, config.episodes, **told) for p in policies}
    summaries = [summarize(name, played) for name, played in episodes.items()]
    policies_report = [summary.as_dict() for summary in summaries]
    report = {"env_id": env_id, **told, "episodes": config.episodes, "seed": config.seed, "policies": policies_report}
    (config.run / "evaluation.json").write_text(json.dumps(report, indent=2) + "\n")
    draw_evaluation(episodes, config.run / "evaluation.png")
    video = config.run / "evaluation.mp4"
    video.unlink(missing_ok=True)
    if config.video:
        record(learned, env_id, config.seed, config.video_episodes, video, **told)
    show(
        summaries,
        f"{env_id}, {config.episodes} episodes of test scenes, {learned.config.sensing} sensing",
        sorted(config.run.glob("evaluation.*")),
    )


def show(summaries: "list[Summary]", title: str, written: list[Path]) -> None:
    """Print the table and what else was written."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title)
    for heading in ("policy", "final error", "[mN]", "within 5 %", "settling step", "overshoot", "contact losses"):
        table.add_column(heading, justify="left" if heading == "policy" else "right")
    for row in summaries:
        table.add_row(
            row.policy,
            f"{row.median_error:.2%}",
            f"{row.median_error_mn:.2f}",
            f"{row.success:.0%}",
            f"{row.settling_steps:.0f}",
            f"{row.peak_overshoot:.1%}",
            f"{row.contact_losses:.2f}",
        )
    console = Console()
    console.print(table)
    console.print("Medians over the episodes; contact losses and the share within 5 % are means.")
    console.print("Written: " + ", ".join(map(str, written)), soft_wrap=True)


def bench(config: BenchConfig) -> None:
    """Measure the kernel, the environments and a learner on them, beside peers in the same run."""
    from agents.bench.report import bench as run

    run(config)


def reproduce(config: ReproduceConfig) -> None:
    """Regenerate the paper's figures and table, and check its claims in numbers."""
    from agents.reproduce import reproduce as run

    for claim in run(config.out):
        print(f"{'holds' if claim.holds else 'DOES NOT HOLD'}: {claim.sentence}\n    {claim.found}")
    print(f"Written: {config.out}/paper.json, {config.out}/paper.png")


def main() -> None:
    """Entry point."""
    command: TrainConfig | EvaluateConfig | BenchConfig | ReproduceConfig = tyro.cli(Command, prog="ccr-gym")
    if isinstance(command, TrainConfig):
        train(command)
    elif isinstance(command, EvaluateConfig):
        evaluate(command)
    elif isinstance(command, BenchConfig):
        bench(command)
    else:
        reproduce(command)


if __name__ == "__main__":
    main()
