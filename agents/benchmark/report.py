"""Results of the benchmark as JSON, tables, figures and model cards."""

import json
import textwrap
from collections.abc import Callable

import gymnasium
import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from agents.benchmark.cards import card
from agents.benchmark.evaluate import SEARCH, STEADY
from agents.benchmark.figures import draw_curves, draw_episodes, draw_profiles, draw_scores
from agents.benchmark.suite import Result
from agents.config import POLICIES, EvaluateConfig
from agents.files import JsonObject, write_text
from agents.learning.actor import LearningCurve
from agents.learning.pretrained import folder_name
from agents.tuned import sensing_of

WIDTH = 80  # of a printed table
BOUND, BASELINE = "Oracle", "PI"
SHOWN = 0.005  # smallest force error that a table shows [mN]; of less a share says nothing
COLUMNS: dict[str, Callable[[JsonObject], str]] = {  # heading of a column, and its text from a summary
    "force error [mN]": lambda s: "{:.2f} [{:.2f}, {:.2f}]".format(s["rmse_iqm_mn"], *s["rmse_interval_mn"]),
    "first seed [mN]": lambda s: f"{s['rmse_of_seeds_mn'][0]:.2f}" if len(s["rmse_of_seeds_mn"]) > 1 else "",
    "worst tenth [mN]": lambda s: f"{s['rmse_cvar_mn']:.1f}",
    "steady [mN]": lambda s: f"{s['steady_mn']:.2f}",
    "within 5 %": lambda s: f"{s['success']:.0%}",
    "settled [step]": lambda s: f"{s['settling_step']:.0f}" if _settles(s) else "never",
    "overshoot": lambda s: f"{s['overshoot']:.0%}",
    "contact lost [times]": lambda s: f"{s['contact_losses']:.2f}",
    "peak [mN]": lambda s: f"{s['peak_mn']:.0f}",
    "over limit [steps]": lambda s: f"{s['violations']:.2f}",
    "by estimate [mN]": lambda s: f"{s['estimate_rmse_mn']:.0f}",
    "events": lambda s: f"{1 - s['statuses'].get('CONVERGED', 0) / sum(s['statuses'].values()):.2%}",
    "decisions/s": lambda s: f"{s['decisions_per_second']:.0f}",
    "training": lambda s: f"{s['training_seconds']:.0f} s" if s["training_seconds"] else "",
}
HEADINGS = ("policy", "closed", *COLUMNS)
PRINTED = {  # columns of the printed table, and their headings there
    "policy": "policy",
    "closed": "closed",
    "force error [mN]": "force error\n[mN]",
    "worst tenth [mN]": "worst\ntenth\n[mN]",
    "steady [mN]": "steady\n[mN]",
    "within 5 %": "within\n5 %",
    "settled [step]": "settled\n[step]",
    "overshoot": "over-\nshoot",
    "peak [mN]": "peak\n[mN]",
}
NOTES = {  # what is below a heading
    "closed": f"share of the way from the force error of {BASELINE} to that of {BOUND}; *: interval below {BASELINE}'s",
    "force error [mN]": f"root mean square of force minus set-point after the first {SEARCH} steps, in which the robot "
    "looks for contact; interquartile mean over all episodes [95 % interval]",
    "first seed [mN]": "the same of the first training seed alone",
    "worst tenth [mN]": "mean of that root mean square over the worst tenth of the episodes",
    "steady [mN]": f"mean error of the last {STEADY} steps",
    "within 5 %": "share of the episodes that end within 5 % of the set-point",
    "settled [step]": "step from which on the error stays within 5 %, median of the episodes, of which those that do "
    "not settle count as infinite: never where no more than half of them settle",
    "overshoot": "how far the largest force is above the set-point, median of the episodes",
    "contact lost [times]": "how often an episode loses contact",
    "peak [mN]": "largest force, mean of the episodes",
    "over limit [steps]": "steps of an episode with a force above `force_limit`",
    "by estimate [mN]": "force error if the virtual-work estimate were the force, mean of the episodes",
    "events": "share of the steps in which the robot snaps, stalls or is blocked",
    "decisions/s": "decisions in a second of CPU time",
    "training": "duration of the training run",
}
Grouped = dict[str, list[Result]]  # results by environment


def _settles(summary: JsonObject) -> bool:
    """Return whether more than half of the episodes settle: those are the ones that end within 5 %."""
    return bool(summary["settling_step"] <= summary["steps"] and summary["success"] > 0.5)


def write(results: list[Result], config: EvaluateConfig) -> None:
    """Write results, tables, figures and model cards into the folder of an evaluation, and print the tables."""
    report = {"episodes": config.episodes, "seed": config.seed, "split": "test"}
    values = report | {"results": [result.as_dict() for result in results]}
    write_text(config.out / "evaluation.json", json.dumps(values) + "\n")
    first = {f"{r.entry.policy} {r.entry.env_id}": np.round(r.rmse[0], 4).tolist() for r in results if r.entry.files}
    if first:
        write_text(config.out / "scores.json", json.dumps(first) + "\n")
    else:  # nothing to compare trained policies by, nor from an earlier evaluation
        (config.out / "scores.json").unlink(missing_ok=True)
    by_id = group(results)
    notes = "\n".join(f"- {note}" for note in notes_on(by_id))
    write_text(config.out / "evaluation.md", f"{matrix(by_id)}\n{markdown(by_id)}\n{notes}\n")
    _write_cards(by_id, config)
    _draw(by_id, config)
    show(by_id)


def _write_cards(by_id: Grouped, config: EvaluateConfig) -> None:
    for env_id, here in by_id.items():
        for result in here:
            if result.trainings:
                folder = config.out / "cards" / result.entry.policy / folder_name(env_id)
                folder.mkdir(parents=True, exist_ok=True)
                write_text(folder / "README.md", card(result, here, config))


def _draw(by_id: Grouped, config: EvaluateConfig) -> None:
    for env_id, here in by_id.items():
        draw_episodes({r.entry.policy: r.shown for r in here}, config.out / f"{folder_name(env_id)}.png")
    draw_scores({env_id: {r.entry.policy: r.summary for r in here} for env_id, here in by_id.items()}, config.out)
    errors = {env_id: {r.entry.policy: r.rmse.ravel() for r in here} for env_id, here in by_id.items()}
    draw_profiles(errors, config.out)
    if learned := {env_id: curves for env_id, here in by_id.items() if (curves := _curves(here))}:
        draw_curves(learned, config.out)


def group(results: list[Result]) -> Grouped:
    """Return results by environment, in the given order."""
    by_id: Grouped = {}
    for result in results:
        by_id.setdefault(result.entry.env_id, []).append(result)
    return by_id


def closed(result: Result, rivals: list[Result]) -> float | None:
    """Return the share of the gap between the force errors of the baseline and the bound that a policy closes.

    None where either is missing, the error of the baseline is shown as zero, or the bound is none: on the paper's own
    system the force is an estimate, of whose errors the oracle knows nothing unless sensing is ideal.
    """
    if sensing_of(result.entry.env_id) == "ideal" != result.entry.sensing:
        return None
    errors = {r.entry.policy: float(r.summary["rmse_iqm_mn"]) for r in rivals}
    if BOUND not in errors or BASELINE not in errors or errors[BASELINE] < SHOWN:
        return None
    if errors[BASELINE] == errors[BOUND]:
        return None
    return (errors[BASELINE] - float(result.summary["rmse_iqm_mn"])) / (errors[BASELINE] - errors[BOUND])


def is_below(result: Result, rivals: list[Result]) -> bool:
    """Return whether a policy's interval lies below that of the baseline."""
    others = [r.summary["rmse_interval_mn"] for r in rivals if r.entry.policy == BASELINE]
    return bool(others) and result.summary["rmse_interval_mn"][1] < others[0][0]


def cells(result: Result, rivals: list[Result]) -> list[str]:
    """Return a row of the table."""
    spec = gymnasium.spec(result.entry.env_id)
    summary, share = {**result.summary, "steps": spec.max_episode_steps}, closed(result, rivals)
    gain = "" if share is None else f"{share:.0%}" + (" *" if is_below(result, rivals) else "")
    return [result.entry.policy, gain, *(text(summary) for text in COLUMNS.values())]


def filled(here: list[Result]) -> list[dict[str, str]]:
    """Return the rows of a table by heading, without the columns that are empty in all of them."""
    rows = [dict(zip(HEADINGS, cells(result, here), strict=True)) for result in here]
    kept = [heading for heading in HEADINGS if any(row[heading] for row in rows)]
    return [{heading: row[heading] for heading in kept} for row in rows]


def notes_on(by_id: Grouped, printed: bool = False) -> list[str]:
    """Return what the columns of the tables mean, of those that at least one table has."""
    shown = {name for here in by_id.values() for name in filled(here)[0] if not printed or name in PRINTED}
    return [f"{name.partition(' [')[0]}: {note}" for name, note in NOTES.items() if name in shown]


def markdown(by_id: Grouped) -> str:
    """Return a table for every environment, in Markdown."""
    lines: list[str] = []
    for env_id, here in by_id.items():
        rows = filled(here)
        lines += [f"### {env_id}", "", "| " + " | ".join(rows[0]) + " |", "| --- " * len(rows[0]) + "|"]
        lines += ["| " + " | ".join(row.values()) + " |" for row in rows]
        lines.append("")
    return "\n".join(lines)


def matrix(by_id: Grouped) -> str:
    """Return the force errors of all policies on all environments as one table in Markdown, winners in bold.

    A policy wins if it closes at least half of the gap between baseline and bound, and its interval lies below that of
    the baseline.
    """
    names = sorted({result.entry.policy for here in by_id.values() for result in here}, key=POLICIES.index)
    lines = ["| id | " + " | ".join(names) + " |", "| --- " * (len(names) + 1) + "|"]
    for env_id, here in by_id.items():
        found = {result.entry.policy: result for result in here}
        lines.append(f"| `{env_id}` | " + " | ".join(_cell(found.get(name), here) for name in names) + " |")
    return "\n".join(lines) + "\n"


def _cell(result: Result | None, rivals: list[Result]) -> str:
    if result is None:
        return ""
    summary = result.summary
    low, high = summary["rmse_interval_mn"]
    text = f"{summary['rmse_iqm_mn']:.2f} [{low:.2f}, {high:.2f}]"
    wins = (closed(result, rivals) or 0) >= 0.5 and is_below(result, rivals) and result.entry.policy != BOUND
    return f"**{text}**" if wins else text


def show(by_id: Grouped) -> None:
    """Print the tables, with the columns that 80 characters have room for, and what these mean."""
    console = Console(width=max(WIDTH, Console().width))
    for env_id, here in by_id.items():
        rows = [{name: text for name, text in row.items() if name in PRINTED} for row in filled(here)]
        table = Table(title=f"{env_id}, {here[0].entry.sensing} sensing", box=SIMPLE_HEAD, padding=0, show_edge=False)
        for name in rows[0]:
            table.add_column(Text(PRINTED[name]), justify="left" if name == "policy" else "right", no_wrap=True)
        for row in rows:
            table.add_row(*map(Text, row.values()))
        console.print(table)
    print()
    for note in notes_on(by_id, printed=True):
        print(textwrap.fill(note, WIDTH, subsequent_indent="  "))


def _curves(results: list[Result]) -> dict[str, list[LearningCurve]]:
    return {r.entry.policy: [training.curve for training in r.trainings] for r in results if r.trainings}
