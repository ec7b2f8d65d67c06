"""Blocks of README and docs about policies and the estimator."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from agents.benchmark import report
from agents.benchmark.suite import Entry, Result
from benchmarks.markdown import line, rule

HONEST = ("P", "PI", "MPC", "Harmonic", "PPO", "Distilled")  # policies that see what agents see
IN_SHORT = ("PI", "MPC", "PPO", "Distilled", "Oracle")
JUDGED = ("Distilled", "PPO", "MPC", "Harmonic")
MANY, LEAST = 0.01, 0.0001  # shares of steps: named one by one above, and the least that two digits show
HEADROOM = ("P", "PI", "MPC", "Harmonic", "Newton", "Oracle")
NAMES = {
    "latency": "latency",
    "half_backlash": "half of the play [a]",
    "loss": "loss η",
    "rigidity": "rigidity r",
    "force": "force",
}
Found = Mapping[str, Any]


def grouped(evaluation: Found) -> report.Grouped:
    """Return the results of an evaluation by environment."""
    rows = evaluation["results"]
    return report.group([Result(Entry(r["policy"], r["env_id"], r["sensing"]), {}, r["summary"]) for r in rows])


def realistic(evaluation: Found) -> report.Grouped:
    """Return the results with realistic sensing by environment."""
    return {env_id: here for env_id, here in grouped(evaluation).items() if here[0].entry.sensing == "realistic"}


def errors_in_short(evaluation: Found, headroom: Sequence[Found]) -> str:
    """Return the table of the README: force errors without intervals, beside the mean set-point."""
    goals = {row["id"]: row["set_point"] for row in headroom}
    found = {
        env_id: {r.entry.policy: float(r.summary["rmse_iqm_mn"]) for r in here}
        for env_id, here in realistic(evaluation).items()
    }
    shown = [policy for policy in IN_SHORT if any(policy in errors for errors in found.values())]
    lines = [line("[mN]", "set-point", *shown), rule(len(shown) + 2)]
    for env_id, errors in found.items():
        least = min(errors[policy] for policy in shown if policy in HONEST and policy in errors)
        texts = (_error(errors.get(policy), policy in HONEST and errors.get(policy) == least) for policy in shown)
        lines.append(line(f"`{env_id}`", f"{goals[env_id]:.0f}", *texts))
    return "\n".join(lines)


def _error(value: float | None, bold: bool) -> str:
    text = "" if value is None else f"{value:.1f}"
    return f"**{text}**" if bold else text


def judgement(evaluation: Found) -> str:
    """Return who errs least of the policies that see what agents see, and whose intervals lie below those of others."""
    by_id = {env_id: {r.entry.policy: r.summary for r in here} for env_id, here in realistic(evaluation).items()}
    judged = [policy for policy in JUDGED if any(policy in here for here in by_id.values())]
    return "\n".join(f"- {_judged(policy, by_id)}" for policy in judged)


def _judged(policy: str, by_id: Mapping[str, Found]) -> str:
    played = {env_id: here for env_id, here in by_id.items() if policy in here}
    best = _ids(env_id for env_id, here in played.items() if policy == _nearest(here))
    text = (
        f"**{policy}**, played on {len(played)} environments with realistic sensing, errs least of all but Newton and "
        f"the oracle on {best}"
    )
    below = {
        rival: [env_id for env_id, here in beside.items() if _is_below(here[policy], here[rival])]
        for rival in ("PI", "MPC")
        if (beside := {env_id: here for env_id, here in played.items() if rival in here}) and rival != policy
    }
    parts = [f"below that of {rival} on {_ids(env_ids)}" for rival, env_ids in below.items()]
    return f"{text}; its interval lies {', '.join(parts)}." if parts else f"{text}."


def _nearest(here: Found) -> str:
    return min((policy for policy in HONEST if policy in here), key=lambda policy: here[policy]["rmse_iqm_mn"])


def _is_below(one: Found, other: Found) -> bool:
    return bool(one["rmse_interval_mn"][1] < other["rmse_interval_mn"][0])


def _ids(env_ids: Iterable[str]) -> str:
    names = [f"`{env_id.split('/')[1].removesuffix('-v1')}`" for env_id in env_ids]
    return ", ".join(names[:-1]) + (" and " if len(names) > 1 else "") + names[-1] if names else "none"


def events(evaluation: Found) -> str:
    """Return the largest shares of steps that snap, stall or are blocked, and where they are above a percent."""
    shares = {
        (r["policy"], r["env_id"]): 1 - statuses.get("CONVERGED", 0) / sum(statuses.values())
        for r in evaluation["results"]
        for statuses in [r["summary"]["statuses"]]
    }
    few = {key: share for key, share in shares.items() if share <= MANY}
    most = (max(few[key] for key in few if ("Spatial" in key[1]) == where) for where in (False, True))
    plane, space = (f"at most {max(share, LEAST):.2%}" if share else "none" for share in most)
    many = [f"{policy} on `{env_id}` ({share:.0%})" for (policy, env_id), share in shares.items() if share > MANY]
    text = f"Of the steps in the plane {plane}, of those in space {space} snap, stall or are blocked"
    exceptions = f", but for {' and '.join(many)}" if many else ""
    return f"{text}{exceptions}.".replace("%", " %")


def headroom_table(rows: Sequence[Found]) -> str:
    """Return the tables of headroom, one for each sensing, with the least error of an honest controller in bold."""
    return "\n\n".join(_headroom_of(sensing, here) for sensing, here in _by("sensing", rows).items())


def _headroom_of(sensing: str, rows: Sequence[Found]) -> str:
    lines = [f'`sensing="{sensing}"`:', ""]
    lines += [line("id", "set-point", *HEADROOM, "best, of the set-point", "room"), rule(len(HEADROOM) + 4)]
    for row in rows:
        errors = (_with_interval(row, policy) for policy in HEADROOM)
        name, share = f"`{row['id'][4:-3]}`", f"{row['best'] / row['set_point']:.1%}".replace("%", " %")
        lines.append(line(name, f"{row['set_point']:.0f}", *errors, share, "yes" if row["room"] else "no"))
    return "\n".join(lines)


def _with_interval(row: Found, policy: str) -> str:
    if policy not in row["errors"]:
        return ""
    error, low, high = row["errors"][policy]
    text = f"{error:.1f} [{low:.1f}, {high:.1f}]"
    return f"**{text}**" if policy in HONEST and error == row["best"] else text


def _by(name: str, rows: Sequence[Found]) -> dict[str, list[Found]]:
    """Return rows by one of their entries."""
    found: dict[str, list[Found]] = {}
    for row in rows:
        found.setdefault(row[name], []).append(row)
    return found


def knowledge_table(rows: Sequence[Found]) -> str:
    """Return the table of what the estimator knows at the end of episodes, and of each environment one to unfold."""
    last = {(row["id"], row["sensing"]): row for row in rows}  # steps ascend
    head = ("sensing", "step", *NAMES.values())
    lines = [line("id", *head), rule(len(head) + 1)]
    lines += [line(f"`{row['id']}`", *_known(row)) for row in last.values()]
    for env_id, here in _by("id", rows).items():
        lines += ["", f"<details><summary>{env_id}, step by step</summary>", "", line(*head), rule(len(head))]
        lines += [*(line(*_known(row)) for row in here), "", "</details>"]
    return "\n".join(lines)


def _known(row: Found) -> list[str]:
    """Return the cells of a row: sensing, step, and median errors with their coverage."""
    forms = {
        "latency": "{:.0%} wrong",
        "half_backlash": "{:.4f}",
        "loss": "{:.4f}",
        "rigidity": "{:.1%}",
        "force": "{:.1%}",
    }
    found = (f"{forms[name].format(row[name][0])} ({100 * row[name][1]:.0f})" if name in row else "" for name in NAMES)
    return [row["sensing"], str(row["step"]), *(text.replace("%", " %") for text in found)]


def cost_table(rows: Sequence[Found]) -> str:
    """Return the table of what wrong flags cost."""
    lines = [line("id", "sensing", "error of MPC falls by [mN]"), "| --- | --- | --- |"]
    shown = ("{fall:.2f} [{low:.2f}, {high:.2f}]".format(**row) for row in rows)
    lines += [line(f"`{row['id']}`", row["sensing"], text) for row, text in zip(rows, shown, strict=True)]
    return "\n".join(lines)


def probe_line(found: Found) -> str:
    """Return what a reversal of the cable tells a robot without a force sensor."""
    plain, probed = found["no reversal"], found["one reversal"]
    text = (
        "In 200 test scenes of `PushObstacle` without a force sensor (`examples/probe.py`) the median error of the "
        "loss is {early_loss:.3f} after the first eight steps. Over the last 16 steps it is {loss:.3f} without a "
        "reversal before contact, as regulating the force makes the cable turn round, too, and "
    ).format(**plain)
    text += f"{probed['loss']:.3f} with one; the error of the force is {plain['force']:.1%} and {probed['force']:.1%} "
    return (text + "of the set-point.").replace("%", " %")
