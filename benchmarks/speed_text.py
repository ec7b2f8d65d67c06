"""Blocks of README and docs about speed."""

from collections.abc import Mapping
from typing import Any

from benchmarks.markdown import digits, listed, table

QUANTILES = ("mean", "median", "p95", "p99")
ENDS = {
    "CONVERGED": "converged",
    "STALLED": "stalled at the tension limit",
    "SNAPPED": "snapped",
    "BLOCKED": "blocked",
    "GAVE_UP": "given up",
}
Found = Mapping[str, Any]


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


def speed_in_short(bench: Found, demo: Found) -> str:
    """Return the three numbers of the README."""
    kernel, envs = bench["kernel"], bench["environments"]
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
