"""Blocks of README and docs about speed."""

from collections.abc import Mapping
from typing import Any

from benchmarks.markdown import digits, listed, table

MODELS = {"rod": "the rod", "paper": "the paper's model"}
QUANTILES = ("mean", "median", "p95", "p99")
ENDS = {
    "CONVERGED": "converged",
    "STALLED": "stalled at the tension limit",
    "SNAPPED": "snapped",
    "BLOCKED": "blocked",
    "GAVE_UP": "given up",
}
Found = Mapping[str, Any]
PLAYED = ("environment", "environment, realistic, by force")  # whose whole steps are counted


def kernel_table(bench: Found) -> str:
    """Return the table of the kernel's speed."""
    plane, space, sqp = bench["kernel"], bench["kernel_in_space"], bench["peers"]["sqpmethod"]
    batch = plane["batch_256"]
    obstacles = {count: ratio for count, ratio in plane["obstacles_ratio"].items() if count != "2"}
    names = " and ".join(str(int(count) - 1) for count in obstacles)
    rows: dict[str, str] = {}
    for model, name in MODELS.items():
        if model in plane:
            rows |= _mix_rows(name, plane[model])
    rows |= {
        "the paper's model: CasADi's SQP method, exact Hessian, on a path in contact": (
            f"{digits(sqp['solve_ms'])} ms a solve, {digits(sqp['step_ms'])} ms with its initial guess"
        ),
        f"the paper's model: {names} obstacles out of reach beside one in contact": (
            f"{listed(obstacles, 3)} × the step"
        ),
        "the paper's model: obstacle on a spring": f"{digits(plane['spring_ratio'], 3)} × the step",
        "the paper's model: a robot's step in a batch of 256, one thread, two threads": (
            f"{digits(batch['one_thread_us'])} µs, {digits(batch['two_threads_us'])} µs"
        ),
        "the paper's model: a step from Python against its replay from `TransitionMemo`": (
            f"{digits(plane['memo_ratio'], 1)} ×"
        ),
        "the rod beside the paper's model, on a path in contact": f"{digits(plane['rod_ratio'], 3)} × the step",
    }
    for model, name in MODELS.items():
        if model in space:
            rows |= {
                f"{name} in space: step, 18 segments, 1–3 spheres and cylinders, {_mix(space[model])}": _times(
                    space[model]
                ),
                f"{name} in space: {_segments(space[model])}": _growth(space[model]),
            }
    return table(("kernel", "measured"), rows.items())


def _mix_rows(name: str, found: Found) -> dict[str, str]:
    """Return the rows of a model on the mix of random steps in the plane."""
    return {
        f"{name}: step, 18 segments, 1–3 obstacles, {_mix(found)}": _times(found),
        f"{name}: of which inside the kernel": f"mean {digits(found['kernel_mean_us'])} µs",
        f"{name}: CasADi/IPOPT, warm started, on some of these steps in contact": (
            f"median {digits(found['ipopt_median_ms'])} ms, {digits(found['ipopt_ratio'])} × the same steps here"
        ),
        f"{name}: {_segments(found)}": _growth(found),
    }


def _mix(found: Found) -> str:
    steps = f"{found['steps']:,}".replace(",", " ")
    return f"{found['in_contact']:.0%} of {steps} random steps in contact".replace("%", " %")


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
        "`CCR/PushObstacle-v1` in a vector of 64, Python and all: ideal at random, realistic by force": PLAYED,
    }
    return table(
        ("model", "instructions a step"),
        ((name, ", ".join(digits(counts[key], 3) for key in keys)) for name, keys in rows.items()),
    )


def cache_table(found: Found) -> str:
    """Return the table of what the caches save."""
    names = {
        "replays": "five replays of recorded episodes, each from a reset",
        "search": "in contact, a tree of depth 3 with 5 actions, grown anew from every equilibrium",
        "walk": "random steps",
    }
    rows = [
        (name, f"{100 * found[key]['hit_rate']:.0f} %", f"{digits(found[key]['ratio'], 3)} ×")
        for key, name in names.items()
    ]
    return table(("steps", "remembered", "CPU time without the memo, over that with it"), rows)


def starts_line(found: Found) -> str:
    """Return what compiled shapes cost at a start."""
    first, damaged = digits(found["starts"]["first"]), digits(found["starts"]["damaged"])
    return (
        f"The first solver of a process among a shape that is not in the store takes {first} times the CPU time of one "
        f"that finds it there; where the entry is damaged it is built again, in {damaged} times that time."
    )


def statuses_line(bench: Found) -> str:
    """Return how the random steps in the plane ended."""
    kernel = bench["kernel"]
    return " ".join(_ends(name, kernel[model]["statuses"]) for model, name in MODELS.items() if model in kernel)


def _ends(name: str, found: Found) -> str:
    others = " or ".join(end for status, end in ENDS.items() if not found.get(status))
    seen = ", ".join(f"{found[status]:,} {end}".replace(",", " ") for status, end in ENDS.items() if found.get(status))
    total = f"{sum(found.values()):,}".replace(",", " ")
    none = f"; none was {others}" if others else ""
    return f"Of {total} random steps of {name} in the plane with one to three obstacles, {seen}{none}."


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


def speed_in_short(bench: Found, demo: Found) -> str:
    """Return the three numbers of the README."""
    kernel, envs = bench["kernel"], bench["environments"]
    many, ratio = envs["vector_steps_per_s"]["256 × 2"], envs["vector_256_ratio"]["2"]
    measured = {name: kernel[model] for model, name in MODELS.items() if model in kernel}
    times = " and ".join(f"**{digits(found['mean_us'])} µs** ({name})" for name, found in measured.items())
    ratios = " and ".join(digits(found["ipopt_ratio"]) for found in measured.values())
    return "\n".join(
        (
            f"- {times} a step of the solver in the plane: 18 segments among one to three obstacles, mean of random "
            f"steps. On those in contact CasADi with IPOPT takes {ratios} times as long in the median.",
            f"- **{digits(many)} steps/s** of `CCR/PushObstacle-v1` (the rod) in a vector of 256 on two threads: "
            f"{digits(ratio)} times as many as 256 `Pendulum-v1` in `SyncVectorEnv`.",
            f"- **{_duration(demo['seconds'])}** for `make demo` on two cores after installation, "
            f"{digits(demo['steps'])} training steps and the evaluation included.",
        )
    )


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
