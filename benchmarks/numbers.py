"""Write the numbers of README and docs from the result files in ``docs/results``.

``make numbers`` fills the blocks between ``<!-- numbers: name -->`` and ``<!-- /numbers -->``. New results are put into
place first: ``python -m benchmarks.numbers --evaluation runs/evaluation/evaluation.json --bench runs/bench.json``.
"""

import argparse
import json
import math
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from agents.benchmark import report
from agents.benchmark.suite import Entry, Result

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "docs/results"
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
HONEST = ("P", "PI", "MPC", "Harmonic", "PPO", "Distilled")  # policies that see what agents see
IN_SHORT = ("PI", "MPC", "PPO", "Distilled", "Newton", "Oracle")
JUDGED = ("Distilled", "PPO", "MPC", "Harmonic")
MANY = 0.01  # share of steps
QUANTILES = ("mean", "median", "p95", "p99")
ENDS = {
    "CONVERGED": "converged",
    "STALLED": "stalled at the tension limit",
    "SNAPPED": "snapped",
    "BLOCKED": "blocked",
    "GAVE_UP": "given up",
}
Found = Mapping[str, Any]


def load(name: str) -> Any:
    """Return what a result file holds."""
    path = RESULTS / f"{name}.json"
    return json.loads(path.read_text())


def save(name: str, values: object) -> None:
    """Write a result file."""
    (RESULTS / f"{name}.json").write_text(json.dumps(values, indent=1, ensure_ascii=False) + "\n")


def take_evaluation(path: Path) -> None:
    """Keep the summaries of an evaluation, without its episodes."""
    found = json.loads(path.read_text())
    kept = [{key: result[key] for key in ("policy", "env_id", "sensing", "summary")} for result in found["results"]]
    save("evaluation", {**found, "results": [_rounded(result) for result in kept]})


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_rounded(entry) for entry in value]
    return round(value, 6) if isinstance(value, float) else value


# Evaluation


def grouped(evaluation: Found) -> report.Grouped:
    """Return the results of an evaluation by environment."""
    rows = evaluation["results"]
    return report.group([Result(Entry(r["policy"], r["env_id"], r["sensing"]), {}, r["summary"]) for r in rows])


def realistic(evaluation: Found) -> report.Grouped:
    """Return the results with realistic sensing by environment."""
    return {env_id: here for env_id, here in grouped(evaluation).items() if here[0].entry.sensing == "realistic"}


def errors_in_short(evaluation: Found) -> str:
    """Return the table of the README: force errors without intervals, beside the mean set-point."""
    goals = load("set_points")
    lines = [line("[mN]", "set-point", *IN_SHORT), rule(len(IN_SHORT) + 2)]
    for env_id, here in realistic(evaluation).items():
        errors = {result.entry.policy: float(result.summary["rmse_iqm_mn"]) for result in here}
        least = min(errors[policy] for policy in HONEST if policy in errors)
        texts = (_error(errors.get(policy), policy in HONEST and errors.get(policy) == least) for policy in IN_SHORT)
        lines.append(line(f"`{env_id}`", f"{goals[env_id]:.0f}", *texts))
    return "\n".join(lines)


def _error(value: float | None, bold: bool) -> str:
    text = "" if value is None else f"{value:.1f}"
    return f"**{text}**" if bold else text


def judgement(evaluation: Found) -> str:
    """Return who errs least of the policies that see what agents see, and whose intervals lie below those of others."""
    return "\n".join(f"- {_judged(policy, realistic(evaluation))}" for policy in JUDGED)


def _judged(policy: str, by_id: report.Grouped) -> str:
    found = {env_id: {r.entry.policy: r.summary for r in here} for env_id, here in by_id.items()}
    played = {env_id: here for env_id, here in found.items() if policy in here}
    best = [env_id for env_id, here in played.items() if policy == _nearest(here)]
    parts = [
        f"below that of {rival} on {_ids(key for key, here in played.items() if _is_below(here[policy], here[rival]))}"
        for rival in ("PI", "MPC")
        if rival != policy
    ]
    least = f"**{policy}**, played on {len(played)} environments, has the least force error on {_ids(best)}"
    return f"{least}; its interval lies {', '.join(parts)}."


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
    plane, space = (max(few[key] for key in few if ("Spatial" in key[1]) == where) for where in (False, True))
    many = [f"{policy} on `{env_id}` ({share:.0%})" for (policy, env_id), share in shares.items() if share > MANY]
    text = f"At most {plane:.2%} of the steps in the plane and {space:.2%} in space snap, stall or are blocked"
    return f"{text}; above 1% are {' and '.join(many) or 'none'}.".replace("%", " %")


# Speed


def digits(value: float, count: int | None = None) -> str:
    """Return a number with some significant digits, by default two below a hundred, in groups of three."""
    count = count or (2 if abs(value) < 100 else 3)
    places = count - 1 - math.floor(math.log10(abs(value)))
    return f"{round(value, places):,.{max(places, 0)}f}".replace(",", " ")


def listed(values: Mapping[str, float], count: int | None = None) -> str:
    """Return numbers with some significant digits, separated by commas."""
    return ", ".join(digits(value, count) for value in values.values())


def kernel_table(bench: Found) -> str:
    """Return the table of the kernel's speed."""
    plane, space, sqp = bench["kernel"], bench["kernel_in_space"]["paper"], bench["peers"]["sqpmethod"]
    batch = plane["batch_256"]
    mix = "{:.0%} of {:,} random steps in contact".format
    obstacles = {count: ratio for count, ratio in plane["obstacles_ratio"].items() if count != "2"}
    names = " and ".join(str(int(count) - 1) for count in obstacles)
    rows = {
        f"step, 18 segments, 1–3 obstacles, {mix(plane['in_contact'], plane['steps'])}": _times(plane),
        "of which inside the kernel": f"mean {digits(plane['kernel_mean_us'])} µs",
        "CasADi/IPOPT on some of these steps in contact, warm started": (
            f"median {digits(plane['ipopt_median_ms'])} ms, {digits(plane['ipopt_ratio'])} ×"
        ),
        "CasADi's SQP method, exact Hessian, on a path in contact": (
            f"{digits(sqp['solve_ms'])} ms a solve, {digits(sqp['step_ms'])} ms with its initial guess"
        ),
        _segments(plane): _growth(plane),
        f"{names} obstacles out of reach beside one in contact": f"{listed(obstacles, 3)} × the step",
        "obstacle on a spring; the rod's model": (
            f"{digits(plane['spring_ratio'], 3)} ×; {digits(plane['rod_ratio'], 3)} × the step"
        ),
        "a robot's step in a batch of 256, one thread, two threads": (
            f"{digits(batch['one_thread_us'])} µs, {digits(batch['two_threads_us'])} µs"
        ),
        "a step from Python against its replay from `TransitionMemo`": f"{digits(plane['memo_ratio'], 1)} ×",
        f"in space, 18 segments, 1–3 spheres and cylinders, {mix(space['in_contact'], space['steps'])}": _times(space),
        f"in space, {_segments(space)}": _growth(space),
    }
    return table(("kernel", "measured"), ((name.replace("%", " %").replace(",0", " 0"), v) for name, v in rows.items()))


def _times(found: Found) -> str:
    mean, median, most, last = (digits(found[f"{name}_us"]) for name in QUANTILES)
    return f"mean {mean} µs, median {median}, p95 {most}, p99 {last}"


def _segments(found: Found) -> str:
    return f"{', '.join(found['segments_mean_us'])} segments"


def _growth(found: Found) -> str:
    return f"{listed(found['segments_mean_us'])} µs: n^{found['growth_exponent']:.2f}"


def environments_table(bench: Found) -> str:
    """Return the table of the environments' speed."""
    envs, learning = bench["environments"], bench["learning"]
    many, ratio = envs["vector_steps_per_s"], envs["vector_256_ratio"]
    rows = (
        (
            "one environment through `gymnasium.make`",
            envs["single_steps_per_s"],
            f"{digits(envs['single_ratio'])} × `Pendulum-v1`",
        ),
        ("vector of 256, one thread", many["256 × 1"], f"{digits(ratio['1'])} × 256 `Pendulum-v1` in `SyncVectorEnv`"),
        ("vector of 256, two threads", many["256 × 2"], f"{digits(ratio['2'])} × the same"),
        ("vector of 1024, two threads", many["1024 × 2"], ""),
        (
            "PPO, on the bare observation",
            learning["ppo_frames_per_s"],
            f"{digits(learning['ppo_ratio'])} × PPO on an environment in which nothing happens",
        ),
    )
    head = ("`CCR/PushObstacle-v1`, resets included", "steps/s", "beside")
    return table(head, ((name, digits(rate, 3), beside) for name, rate, beside in rows))


def instructions_table(counts: Found) -> str:
    """Return the table of the instructions of a step."""
    cables = ("space rod, 2 cables", "space rod, 3 cables", "space rod")
    rows = {
        "plane, paper's model and rod": ("paper", "rod"),
        "space, paper's model": ("space",),
        "space, rod with two, three, four cables": cables,
    }
    return table(
        ("model", "instructions a step"),
        ((name, ", ".join(digits(counts[key], 3) for key in keys)) for name, keys in rows.items()),
    )


def statuses_line(bench: Found) -> str:
    """Return how the random steps in the plane ended."""
    found = bench["kernel"]["statuses"]
    others = " or ".join(name for status, name in ENDS.items() if not found.get(status))
    seen = ", ".join(
        f"{found[status]:,} {name}".replace(",", " ") for status, name in ENDS.items() if found.get(status)
    )
    total = f"{sum(found.values()):,}".replace(",", " ")
    none = f"; none was {others}" if others else ""
    return f"Of {total} random steps in the plane with one to three obstacles, {seen}{none}."


def mujoco_line(bench: Found) -> str:
    """Return the speed of a MuJoCo chain beside ours."""
    peers = bench["peers"]
    chains = [peers[name] for name in peers if name.startswith("mujoco ")]
    fastest = max(chain["steps_per_s"] for chain in chains)
    errors = [100 * chain["error_median"] for chain in chains]
    ours = digits(peers["ours_steps_per_s"])
    return (
        "A chain of 18 hinges driven by a tendon, tuned on the very path it was measured on, made "
        f"{digits(fastest)} steps a second to {ours} here; its contact force differed by "
        f"{digits(min(errors))}–{digits(max(errors))} %."
    )


def ppo_line(found: Found) -> str:
    """Return how fast the single-file PPO learns."""
    errors = ", ".join(f"{100 * error:.1f}" for error in found["median_errors"])
    low, high = found["seconds"]
    return (
        "With ideal sensing `examples/ppo.py --env-id CCR/PushObstacle-Paper-v1` takes "
        f"{digits(found['steps'])} steps and ends at a median force error of {errors} % on unseen scenes for "
        f"{len(found['median_errors'])} seeds, in {low}–{high} s each, imports and evaluation included."
    )


def speed_in_short(bench: Found) -> str:
    """Return the three numbers of the README."""
    kernel, envs, demo = bench["kernel"], bench["environments"], load("demo")
    many, ratio = envs["vector_steps_per_s"]["256 × 2"], envs["vector_256_ratio"]["2"]
    return "\n".join(
        (
            f"- **{digits(kernel['mean_us'])} µs** a step of the solver with 18 segments among one to three obstacles: "
            f"{digits(kernel['ipopt_ratio'])} times faster than CasADi with IPOPT on the same steps.",
            f"- **{digits(many)} steps/s** in a vector of 256 environments on two threads: {digits(ratio)} times as "
            "many as 256 `Pendulum-v1` in `SyncVectorEnv`.",
            f"- **{_duration(demo['seconds'])}** for `make demo` on two cores after installation, "
            f"{digits(demo['steps'])} training steps and the evaluation included.",
        )
    )


# Demo


def demo_line(demo: Found) -> str:
    """Return what ``make demo`` takes and ends with."""
    rmse, low, high = demo["errors_mn"]["PPO"]
    others = ", ".join(f"{name} at {demo['errors_mn'][name][0]:.2f}" for name in ("PI", "MPC"))
    return (
        f"`make demo` took {_duration(demo['seconds'])} on two cores after installation, {digits(demo['steps'])} "
        f"training steps included, and ended with PPO at a force error of {rmse:.2f} mN [{low:.2f}, {high:.2f}], "
        f"{others}, on {demo['episodes']} scenes."
    )


def _duration(seconds: float) -> str:
    return f"{seconds // 60:.0f} min {seconds % 60:02.0f} s"


# Pages


def line(*cells: object) -> str:
    """Return a row of a table in Markdown."""
    return "| " + " | ".join(map(str, cells)) + " |"


def rule(columns: int) -> str:
    """Return the line below the head of a table."""
    return "| --- " * columns + "|"


def table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """Return a table in Markdown."""
    return "\n".join([line(*head), rule(len(head)), *(line(*row) for row in rows)])


def blocks() -> dict[str, str]:
    """Return the text of every block by its name."""
    return {name: make(load(file)) for name, (file, make) in BLOCKS.items()}


def fill(text: str, blocks: Mapping[str, str]) -> str:
    """Return a text with blocks between their marks.

    Raises:
        ValueError: If a mark names a block that is not there.
    """

    def filled(found: re.Match[str]) -> str:
        if found[1] not in blocks:
            raise ValueError(f"the mark {found[1]!r} names no block; blocks are {', '.join(blocks)}")
        return f"<!-- numbers: {found[1]} -->\n{blocks[found[1]]}\n<!-- /numbers -->"

    return re.sub(r"<!-- numbers: (.+?) -->\n.*?<!-- /numbers -->", filled, text, flags=re.DOTALL)


def write() -> None:
    """Fill the blocks of all pages."""
    found = blocks()
    for page in PAGES:
        before = page.read_text()
        if (after := fill(before, found)) != before:
            page.write_text(after)
            print(f"{page.relative_to(ROOT)}: written")


BLOCKS: dict[str, tuple[str, Callable[[Any], str]]] = {  # file in docs/results, and what makes the text of it
    "errors in short": ("evaluation", errors_in_short),
    "errors": ("evaluation", lambda found: report.matrix(grouped(found)).strip()),
    "policies": ("evaluation", lambda found: report.markdown(grouped(found)).strip()),
    "judgement": ("evaluation", judgement),
    "events": ("evaluation", events),
    "speed in short": ("bench", speed_in_short),
    "kernel": ("bench", kernel_table),
    "environments": ("bench", environments_table),
    "statuses": ("bench", statuses_line),
    "mujoco": ("bench", mujoco_line),
    "instructions": ("../../benchmarks/instructions", instructions_table),
    "single-file ppo": ("examples_ppo", ppo_line),
    "demo": ("demo", demo_line),
}


def main() -> None:
    """Take new results, and write the pages."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--evaluation", type=Path, help="evaluation.json of ccr-gym evaluate")
    parser.add_argument("--bench", type=Path, help="bench.json of ccr-gym bench")
    args = parser.parse_args()
    if args.evaluation:
        take_evaluation(args.evaluation)
    if args.bench:
        save("bench", _rounded(json.loads(args.bench.read_text())))
    write()


if __name__ == "__main__":
    main()
