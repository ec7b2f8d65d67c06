"""Model cards of trained policies."""

import textwrap
from dataclasses import asdict

from agents.benchmark.suite import Result
from agents.config import EvaluateConfig
from ccr_gym import Sensing

ABOUT = {
    "PPO": "Proximal policy optimisation (Stable-Baselines3); sees the observation and a fixed memory.",
    "RecurrentPPO": "Proximal policy optimisation with an LSTM (sb3-contrib); sees the observation alone.",
    "SAC": "Soft actor-critic (Stable-Baselines3); sees the observation and a fixed memory.",
    "Distilled": "Imitation (DAgger) of a Newton controller that knows the true force, its slope, the play of the "
    "motors and the next set-point; the policy itself sees the observation and a fixed memory.",
}


def card(result: Result, rivals: list[Result], config: EvaluateConfig) -> str:
    """What a trained policy is, how it was made, what it achieves and where it ends."""
    entry, summary = result.entry, result.summary
    learner = result.trainings[0].config.learner
    settings = ", ".join(f"{name} {value:g}" for name, value in asdict(learner).items())
    seeds = ", ".join(str(training.config.seed) for training in result.trainings)
    drawn = ", ".join(f"{name} {low:g} to {high:g}" for name, (low, high) in asdict(Sensing()).items())
    ranges = "ideal" if entry.sensing == "ideal" else f"{drawn} (newton, millimetre, steps)"
    low, high = summary["rmse_interval_mn"]
    others = "; ".join(f"{r.entry.policy} {r.summary['rmse_iqm_mn']:.2f}" for r in rivals if r is not result)
    spent, share, over = summary["training_seconds"], summary["success"], summary["violations"]
    error, worst = summary["rmse_iqm_mn"], summary["rmse_cvar_mn"]
    parts = (
        f"""**Use**: a baseline for force regulation on `{entry.env_id}` with `sensing="{entry.sensing}"` and the
        default robot. `agents.actor.LearnedPolicy(path).act(observation)` takes dictionary observations;
        `reset()` between episodes.""",
        f"""**Training**: scenes of `split="train"`, training seed {seeds}, {spent:.0f} s on one core of the machine it
        was made on. Settings: {settings}.""",
        f"**Sensing it was trained with**: {ranges}.",
        f"""**Result**: force error {error:.2f} mN [{low:.2f}, {high:.2f}]: interquartile mean, with its 95 % interval,
        of the root mean square after the search, over {config.episodes} test scenes, seeds from {config.seed}; of this
        file alone {summary["rmse_of_seeds_mn"][0]:.2f} mN. Worst
        tenth {worst:.1f} mN; {share:.0%} end within 5 % of the set-point; {over:.2f} steps an episode above the force
        limit. Beside it: {others}.""",
        """**Limits**: it knows no other robot, sensing or task, and nothing guarantees that the force stays below the
        limit. Trained and tested in simulation only.""",
        """**File**: weights in half precision, the scaling of the observation, configuration and learning curve; no
        code.""",
    )
    points = [textwrap.fill(" ".join(part.split()), 120, initial_indent="- ", subsequent_indent="  ") for part in parts]
    return "\n".join([f"# {entry.policy} on `{entry.env_id}`", "", ABOUT[entry.policy], "", *points, ""])
