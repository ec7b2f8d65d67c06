"""Model cards of trained policies."""

import textwrap
from dataclasses import asdict

from agents.benchmark.evaluate import SEARCH
from agents.benchmark.suite import Result
from agents.config import EvaluateConfig
from ccr_gym import Sensing

ABOUT = {
    "PPO": "Proximal policy optimisation (Stable-Baselines3); sees the observation and a fixed memory.",
    "RecurrentPPO": "Proximal policy optimisation with an LSTM (sb3-contrib); sees the observation only.",
    "SAC": "Soft actor-critic (Stable-Baselines3); sees the observation and a fixed memory.",
    "Distilled": "Imitation (DAgger) of a Newton controller that sees the true force, its slope, the backlash of the "
    "motors and the next set-point; the policy itself sees the observation and a fixed memory.",
}


def card(result: Result, rivals: list[Result], config: EvaluateConfig) -> str:
    """Return the model card of a policy: what it is, how it was trained, its results and its limits."""
    entry = result.entry
    parts = (
        f"""**Use**: a baseline for force regulation on `{entry.env_id}` with `sensing="{entry.sensing}"` and the
        default robot. `agents.LearnedPolicy(path).act(observation)` takes dictionary observations; call `reset()`
        between episodes.""",
        _training(result),
        f"**Sensing it was trained with**: {_sensing(entry.sensing)}.",
        _result(result, rivals, config),
        """**Limits**: not trained for any other robot, sensing or task; nothing guarantees that the force stays below
        the limit. Trained and tested in simulation only.""",
        """**File**: weights in half precision, normalisation of the observation, configuration and learning curve; no
        code.""",
    )
    points = [textwrap.fill(" ".join(part.split()), 120, initial_indent="- ", subsequent_indent="  ") for part in parts]
    return "\n".join([f"# {entry.policy} on `{entry.env_id}`", "", ABOUT[entry.policy], "", *points, ""])


def _training(result: Result) -> str:
    learner = result.trainings[0].config.learner
    settings = ", ".join(f"{name} {value:g}" for name, value in asdict(learner).items())
    seeds = ", ".join(str(training.config.seed) for training in result.trainings)
    seconds = result.summary["training_seconds"]
    return f"""**Training**: scenes of `split="train"`, training seed {seeds}, trained in {seconds:.0f} s on a
        machine that may have done other work. Settings: {settings}."""


def _sensing(sensing: str) -> str:
    if sensing == "ideal":
        return sensing
    without, fields = sensing == "sensorless", asdict(Sensing())
    told = {name: ends for name, ends in fields.items() if not (without and name.startswith("force_"))}
    ranges = ", ".join(f"{name} {low:g} to {high:g}" for name, (low, high) in told.items())
    units = "forces in EI/L², tensions in EI/(aL), play in a, places in L, angles in rad, latency in steps"
    return f"{'no force sensor; ' if without else ''}{ranges} ({units})"


def _result(result: Result, rivals: list[Result], config: EvaluateConfig) -> str:
    summary = result.summary
    low, high = summary["rmse_interval_mn"]
    others = "; ".join(f"{r.entry.policy} {r.summary['rmse_iqm_mn']:.2f}" for r in rivals if r is not result)
    return f"""**Result**: force error {summary["rmse_iqm_mn"]:.2f} mN [{low:.2f}, {high:.2f}]: interquartile mean, with
        its 95 % interval, of the root mean square after the first {SEARCH} steps, over {config.episodes} test scenes,
        seeds from {config.seed}; for this file alone {summary["rmse_of_seeds_mn"][0]:.2f} mN. Worst tenth
        {summary["rmse_cvar_mn"]:.1f} mN; {summary["success"]:.0%} end within 5 % of the set-point;
        {summary["violations"]:.2f} steps per episode above the force limit. For comparison: {others}."""
