"""Benchmark of the kernel: the contact mix, beside IPOPT on the same steps, and growth with the number of segments.

Times are of single calls of the compiled step, taken from Python with a nanosecond clock; they include the overhead of
the call, which is measured and printed beside them. Run: ``python benchmarks/kernel.py [--steps N] [--json PATH]``.
"""

import argparse
import json
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solver import Circle, Equilibrium, Robot, Scene, Solver, Status
from solver.forces import clearance
from solver.reference import ReferenceSolver

STEPS_PER_SCENE = 100
LARGEST_CABLE = 14.0  # [mm]
DRIFT = 0.14  # mean cable increment, towards pulling [mm]


@dataclass(frozen=True, slots=True)
class Timed:
    """One step of the mix: where it started, what was commanded, how it ended, and its time [µs]."""

    solver: Solver
    start: Equilibrium
    command: float
    end: Equilibrium
    microseconds: float


def random_scene(generator: np.random.Generator, robot: Robot) -> Scene:
    """One to three circles in 35–75 × 75–150 mm, r 10–16 mm, clear of the straight robot."""
    while True:
        circles = [
            Circle(center=(generator.uniform(35, 75), generator.uniform(75, 150)), radius=generator.uniform(10, 16))
            for _ in range(generator.integers(1, 4))
        ]
        if clearance(robot, Scene(circles), 0.0) > 0:
            return Scene(circles)


def timed_step(solver: Solver, start: Equilibrium, command: float) -> Timed:
    """Step, with the time of the compiled call alone."""
    block = np.empty_like(start.block)
    begin = time.perf_counter_ns()
    status, iterations = solver._kernel.step(start.block, command, block)
    elapsed = (time.perf_counter_ns() - begin) / 1e3
    return Timed(
        solver, start, command, Equilibrium(solver.robot, solver.scene, block, Status(status), iterations), elapsed
    )


def contact_mix(steps: int, seed: int = 0) -> Iterator[Timed]:
    """Random increments of ±0.5 mm with a drift towards pulling, 100 steps a scene."""
    generator, robot = np.random.default_rng(seed), Robot.prototype()
    for _ in range(steps // STEPS_PER_SCENE):
        solver = Solver(robot, random_scene(generator, robot))
        now = solver.rest()
        for _ in range(STEPS_PER_SCENE):
            command = now.cable_mm + generator.uniform(-0.5, 0.5) + DRIFT
            step = timed_step(solver, now, float(np.clip(command, 0.0, LARGEST_CABLE)))
            yield step
            now = step.end


def call_overhead() -> float:
    """Median time of a call that does next to nothing: a free robot of two segments, to where it already is [µs]."""
    solver = Solver(Robot.prototype(segments=2), Scene())
    return float(np.median([timed_step(solver, solver.rest(), 0.0).microseconds for _ in range(10_000)]))


def reference_times(steps: list[Timed]) -> tuple[np.ndarray, np.ndarray]:
    """Times of the kernel and of IPOPT on the same steps [µs]."""
    kernel, reference = [], []
    for step in steps:
        rival = ReferenceSolver(step.solver.robot, step.solver.scene)
        rival.step(step.start, step.command)  # builds what is built once
        begin = time.perf_counter_ns()
        rival.step(step.start, step.command)
        reference.append((time.perf_counter_ns() - begin) / 1e3)
        kernel.append(step.microseconds)
    return np.array(kernel), np.array(reference)


def growth(counts: tuple[int, ...], repeats: int = 20) -> dict[int, float]:
    """Mean over the steps of a path of each step's median time, by number of segments [µs].

    The path is the paper's Fig. 4a circle, pulled to 8 mm and back.
    """
    commands = np.concatenate([np.arange(0.25, 8.01, 0.25), np.arange(7.75, -0.01, -0.25)])
    return {n: float(np.median([path_times(n, commands) for _ in range(repeats)], axis=0).mean()) for n in counts}


def path_times(segments: int, commands: np.ndarray) -> list[float]:
    """Times of the steps of one path [µs]."""
    solver = Solver(Robot.prototype(segments=segments), Scene([Circle(center=(44, 104), radius=15)]))
    now, times = solver.rest(), []
    for command in commands:
        step = timed_step(solver, now, float(command))
        now = step.end
        times.append(step.microseconds)
    return times


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=200_000)
    parser.add_argument("--rivals", type=int, default=200, help="steps compared with IPOPT")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()

    times, statuses, touching, sample = np.empty(arguments.steps), Counter[str](), 0, []
    for i, step in enumerate(contact_mix(arguments.steps)):
        times[i] = step.microseconds
        statuses[step.end.status.name] += 1
        in_touch = bool(step.end.contact.any())
        touching += in_touch
        if in_touch and step.end.status is Status.CONVERGED and i * arguments.rivals // arguments.steps >= len(sample):
            sample.append(step)
    in_contact, overhead = touching / arguments.steps, call_overhead()
    print(f"contact mix: {len(times)} steps, 18 segments, {in_contact:.0%} in contact; {dict(statuses)}")
    quantiles = {name: float(np.percentile(times, q)) for name, q in (("median", 50), ("p95", 95), ("p99", 99))}
    print(f"  mean {times.mean():.2f} µs, " + ", ".join(f"{name} {value:.1f}" for name, value in quantiles.items()))
    print(f"  of it the call from Python {overhead:.2f} µs; inside the kernel: mean {times.mean() - overhead:.2f} µs")

    kernel, reference = reference_times(sample)
    ratio = float(np.median(reference / kernel))
    print(f"CasADi/IPOPT on {len(kernel)} of these steps in contact: median {np.median(reference) / 1e3:.2f} ms")
    print(f"  ratio to the kernel: median {ratio:.0f}, of the means {reference.mean() / kernel.mean():.0f}")

    means = growth((9, 18, 36, 72, 144, 288))
    exponent = float(np.polyfit(np.log(list(means)), np.log(list(means.values())), 1)[0])
    print("segments: " + ", ".join(f"{n}: {mean:.1f} µs" for n, mean in means.items()) + f"; growth n^{exponent:.2f}")

    if arguments.json:
        report = {
            "steps": len(times),
            "in_contact": in_contact,
            "statuses": statuses,
            "mean_us": float(times.mean()),
            **{f"{name}_us": value for name, value in quantiles.items()},
            "call_overhead_us": overhead,
            "kernel_mean_us": float(times.mean()) - overhead,
            "ipopt_median_ms": float(np.median(reference)) / 1e3,
            "ipopt_ratio": ratio,
            "segments_mean_us": means,
            "growth_exponent": exponent,
        }
        arguments.json.write_text(json.dumps(report, indent=2) + "\n")


if __name__ == "__main__":
    main()
