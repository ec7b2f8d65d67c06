"""Benchmark of the kernel: the contact mix, IPOPT on the same steps, and growth with the number of segments.

Times are of single calls of the compiled step, measured in Python with a nanosecond clock. They include the overhead of
the call, which is measured and reported as well.
"""

import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from timeit import timeit
from typing import Generic, Literal, TypeVar

import numpy as np

from agents.files import JsonObject
from solver import (
    BatchSolver,
    Circle,
    Equilibrium,
    ReferenceSolver,
    Robot,
    Scene,
    Solver,
    Status,
    TransitionMemo,
    clearance,
)

Model = Literal["rod", "paper"]
MODELS: tuple[Model, ...] = ("rod", "paper")
SEGMENTS = {
    "rod": (18, 36, 72, 144, 288),
    "paper": (9, 18, 36, 72, 144, 288),
}  # a rod of 9 could let the circle through
STEPS_PER_SCENE = 100
LARGEST_CABLE = 14.0  # [mm]
DRIFT = 0.14  # mean cable increment; positive pulls [mm]


SolverT = TypeVar("SolverT")
EquilibriumT = TypeVar("EquilibriumT")
CommandT = TypeVar("CommandT")


@dataclass(frozen=True, slots=True)
class Timed(Generic[SolverT, EquilibriumT, CommandT]):
    """One timed step of a mix.

    Attributes:
        solver: The solver.
        start: Equilibrium before the step.
        command: The command.
        end: Equilibrium after the step.
        microseconds: Duration [µs].
    """

    solver: SolverT
    start: EquilibriumT
    command: CommandT
    end: EquilibriumT
    microseconds: float


PlanarStep = Timed[Solver, Equilibrium, float]


def random_scene(generator: np.random.Generator, robot: Robot, count: int | None = None) -> Scene:
    """Return one to three circles, or ``count``, in 35–75 × 75–150 mm, r 10–16 mm, clear of the straight robot."""
    while True:
        circles = [
            Circle(center=(generator.uniform(35, 75), generator.uniform(75, 150)), radius=generator.uniform(10, 16))
            for _ in range(count or generator.integers(1, 4))
        ]
        if clearance(robot, Scene(circles), 0.0) > 0:
            return Scene(circles)


def timed_step(solver: Solver, start: Equilibrium, command: float) -> PlanarStep:
    """Return a step and the duration of its compiled call."""
    block = np.empty_like(start.block)
    begin = time.perf_counter_ns()
    status, iterations, _ = solver._kernel.step(start.block, (command, start.length_mm), block)
    elapsed = (time.perf_counter_ns() - begin) / 1e3
    return Timed(
        solver, start, command, Equilibrium(solver.robot, solver.scene, block, Status(status), iterations), elapsed
    )


def contact_mix(steps: int, robot: Robot, seed: int = 0) -> Iterator[PlanarStep]:
    """Yield steps of random increments of ±0.5 mm with a drift towards pulling, 100 steps per scene."""
    generator = np.random.default_rng(seed)
    for _ in range(steps // STEPS_PER_SCENE):
        solver = Solver(robot, random_scene(generator, robot))
        now = solver.rest()
        for _ in range(STEPS_PER_SCENE):
            command = now.cable_mm + generator.uniform(-0.5, 0.5) + DRIFT
            step = timed_step(solver, now, float(np.clip(command, 0.0, LARGEST_CABLE)))
            yield step
            now = step.end


def call_overhead() -> float:
    """Return the median duration of a call that does next to nothing: a free robot of two segments that stays [µs]."""
    solver = Solver(Robot.prototype(model="paper", segments=2), Scene())
    return float(np.median([timed_step(solver, solver.rest(), 0.0).microseconds for _ in range(10_000)]))


def reference_times(steps: list[PlanarStep]) -> tuple[np.ndarray, np.ndarray]:
    """Return the durations of the kernel and of IPOPT on the same steps [µs]."""
    kernel, reference = [], []
    for step in steps:
        rival = ReferenceSolver(step.solver.robot, step.solver.scene)
        rival.step(step.start, step.command)  # the first call builds the problem
        begin = time.perf_counter_ns()
        rival.step(step.start, step.command)
        reference.append((time.perf_counter_ns() - begin) / 1e3)
        kernel.append(step.microseconds)
    return np.array(kernel), np.array(reference)


PUSHED = Circle(center=(44, 104), radius=15)  # of the paper's Fig. 4a
SPRUNG = Circle(center=(44, 104), radius=15, spring=1.0)
PATH = np.concatenate([np.arange(0.25, 8.01, 0.25), np.arange(7.75, -0.01, -0.25)])


def growth(model: Model, repeats: int = 20) -> dict[int, float]:
    """Return the mean over a path of each step's median duration, by number of segments [µs]."""
    solvers = {n: Solver(Robot.prototype(model=model, segments=n), Scene([PUSHED])) for n in SEGMENTS[model]}
    return {
        n: float(np.median([path_times(solver) for _ in range(repeats)], axis=0).mean())
        for n, solver in solvers.items()
    }


FAR = [Circle(center=(60 + 12 * k, -30 - 5 * k), radius=6) for k in range(31)]


def cost(obstacles: list[Circle], model: Model = "paper", repeats: int = 40) -> float:
    """Return the duration of a path relative to that of the paper's model with one obstacle; medians of paired runs."""
    reference = Solver(Robot.prototype(model="paper"), Scene([PUSHED]))
    other = Solver(replace(Robot.prototype(model="paper"), model=model), Scene(obstacles))
    times = np.array([(path_times(reference), path_times(other)) for _ in range(repeats)])
    mean_reference, mean_other = np.median(times, axis=0).mean(axis=1)
    return float(mean_other / mean_reference)


def cold_ratio(repeats: int = 40) -> float:
    """Return the duration from rest to 8 mm, in steps of 0.25 mm, relative to that of the last step alone."""
    solver = Solver(Robot.prototype(model="paper"), Scene([PUSHED]))
    upwards = len(PATH) // 2
    times = np.median([path_times(solver)[:upwards] for _ in range(repeats)], axis=0)
    return float(times.sum() / times[-1])


def memo_ratio(repeats: int = 21) -> float:
    """Return the duration of a warm step relative to that of its replay from the memo; medians of paired runs."""
    solver = Solver(Robot.prototype(model="paper"), Scene([PUSHED]))
    memo, now = TransitionMemo(solver), solver.rest()
    for command in PATH[:30]:
        now = solver.step(now, float(command))
    memo.step(now, 7.75)
    steps = [partial(stepper.step, now, 7.75) for stepper in (solver, memo)]
    warm, replay = np.median([[timeit(step, number=1000) for step in steps] for _ in range(repeats)], axis=0)
    return float(warm / replay)


def path_times(solver: Solver) -> list[float]:
    """Return the durations of the steps of the path to 8 mm and back [µs]."""
    now, times = solver.rest(), []
    for command in PATH:
        step = timed_step(solver, now, float(command))
        now = step.end
        times.append(step.microseconds)
    return times


def batch_times(count: int, steps: int = 200) -> tuple[float, float, float]:
    """Return the median duration of a robot's step alone, in a batch on one thread, and on two [µs]."""
    generator, robot = np.random.default_rng(0), Robot.prototype(model="paper")
    scenes = [random_scene(generator, robot, 1) for _ in range(count)]
    solvers = [Solver(robot, scene) for scene in scenes]
    batches = [BatchSolver(robot, count, 1, threads) for threads in (1, 2)]
    for batch in batches:
        for i, scene in enumerate(scenes):
            batch.assign(i, scene)
        batch.rest(range(count))
    times = np.empty((steps, 3))
    records = []
    for k in range(steps):
        drift = generator.uniform(-0.5, 0.5, count) + (DRIFT if k % 100 < 80 else -3 * DRIFT)
        commands = np.clip(batches[0].layout.cables(batches[0].blocks)[:, 0] + drift, 0, LARGEST_CABLE)
        if k % 10 == 0:
            records.append((k, [batches[0].equilibrium(i) for i in range(count)], commands.tolist()))
        for column, batch in enumerate(batches, start=1):
            begin = time.perf_counter_ns()
            batch.step(commands)
            times[k, column] = (time.perf_counter_ns() - begin) / 1e3 / count
    times[:, 0] = np.nan
    for k, starts, commands in records:  # each robot twice, so that its data is in the cache, as in a loop of its own
        pairs = list(zip(solvers, starts, commands, strict=True))
        times[k, 0] = sum(min(timed_step(*pair).microseconds for _ in range(2)) for pair in pairs) / count
    alone, one, two = np.nanmedian(times, axis=0).tolist()
    return alone - call_overhead(), one, two


def mixed(model: Model, steps: int, rivals: int) -> JsonObject:
    """Return the measurements of a model on the contact mix, and its growth with the number of segments."""
    times, statuses, touching = np.empty(steps), Counter[str](), 0
    sample: list[PlanarStep] = []
    for i, step in enumerate(contact_mix(steps, Robot.prototype(model=model))):
        times[i] = step.microseconds
        statuses[step.end.status.name] += 1
        in_touch = bool(step.end.contact.any())
        touching += in_touch
        if in_touch and step.end.status is Status.CONVERGED and i * rivals // steps >= len(sample):
            sample.append(step)
    kernel, reference = reference_times(sample)
    means = growth(model)
    return {
        "steps": steps,
        "in_contact": touching / steps,
        "statuses": dict(statuses),
        "mean_us": float(times.mean()),
        **{f"{name}_us": float(np.percentile(times, q)) for name, q in (("median", 50), ("p95", 95), ("p99", 99))},
        "kernel_mean_us": float(times.mean()) - call_overhead(),
        "ipopt_median_ms": float(np.median(reference)) / 1e3,
        "ipopt_beside_us": float(np.median(kernel)),
        "ipopt_ratio": float(np.median(reference / kernel)),
        "segments_mean_us": {str(n): mean for n, mean in means.items()},
        "growth_exponent": float(np.polyfit(np.log(list(means)), np.log(list(means.values())), 1)[0]),
    }


def measure(steps: int, rivals: int) -> JsonObject:
    """Return all measurements by name: of both models on the contact mix, and ratios of the paper's model."""
    alone, one, two = batch_times(256)
    return {
        **{model: mixed(model, steps, rivals) for model in MODELS},
        "call_overhead_us": call_overhead(),
        "rod_ratio": cost([PUSHED], model="rod"),
        "obstacles_ratio": {str(n): cost([PUSHED, *FAR[: n - 1]]) for n in (2, 11, 32)},
        "spring_ratio": cost([SPRUNG]),
        "cold_ratio": cold_ratio(),
        "memo_ratio": memo_ratio(),
        "batch_256": {
            "alone_us": alone,
            "one_thread_us": one,
            "two_threads_us": two,
            "cost": one / alone,
            "speedup": one / two,
        },
    }
