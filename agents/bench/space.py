"""Benchmark of the kernel in space: a random mix of contacts, and growth with the number of segments."""

import math
import time
from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np

from agents.bench.kernel import Timed
from agents.files import JsonObject
from solver import Scene, Status
from solver.spatial import Cylinder, SpatialEquilibrium, SpatialRobot, SpatialSolver, Sphere

STEPS_PER_SCENE = 200
GOAL_STEPS = 50  # steps that drift towards the same goal
LARGEST_CABLE = 11.0  # [mm]
PUSHED = Sphere(center=(40, 18, 104), radius=15)
DIRECTION = np.array([1.0, 0.4])  # of the cables, towards it
PATH = np.concatenate([np.arange(0.25, 8.01, 0.25), np.arange(7.75, -0.01, -0.25)])
SpatialStep = Timed[SpatialSolver, SpatialEquilibrium, np.ndarray]


def random_obstacle(generator: np.random.Generator) -> Sphere | Cylinder:
    """Return a sphere or a cylinder of 30 mm, 35–75 mm off the axis, 75–150 mm high, r 10–16 mm."""
    azimuth, radius = generator.uniform(0, 2 * math.pi), generator.uniform(10, 16)
    outward = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    center = generator.uniform(35, 75) * outward + [0.0, 0.0, generator.uniform(75, 150)]
    axis = generator.normal(size=3)
    half = 15 * axis / np.linalg.norm(axis)
    if generator.random() < 0.5:
        return Sphere(center=tuple(center.tolist()), radius=radius)
    start, end = (tuple((center + side * half).tolist()) for side in (-1, 1))
    return Cylinder(start=start, end=end, radius=radius, edge=2.0)


def random_solver(generator: np.random.Generator, robot: SpatialRobot) -> SpatialSolver:
    """Return a solver of the robot among one to three of these, clear of them at rest."""
    while True:
        try:
            return SpatialSolver(robot, Scene(random_obstacle(generator) for _ in range(generator.integers(1, 4))))
        except ValueError:
            continue


def timed_step(solver: SpatialSolver, start: SpatialEquilibrium, cables: np.ndarray) -> SpatialStep:
    """Return a step and the duration of its compiled call."""
    block, command = np.empty_like(start.block), [*cables.tolist(), solver.robot.length_mm]
    begin = time.perf_counter_ns()
    status, iterations, _ = solver._kernel.step(start.block, command, block)
    elapsed = (time.perf_counter_ns() - begin) / 1e3
    end = SpatialEquilibrium(solver.robot, solver.scene, block, Status(status), iterations)
    return Timed(solver, start, cables, end, elapsed)


def contact_mix(steps: int, seed: int = 0) -> Iterator[SpatialStep]:
    """Yield steps of random increments of ±0.3 mm with a drift towards an obstacle or, one time in five, anywhere."""
    generator, robot = np.random.default_rng(seed), SpatialRobot.prototype()
    for _ in range(steps // STEPS_PER_SCENE):
        solver = random_solver(generator, robot)
        now, goal = solver.rest(), np.zeros(2)
        for k in range(STEPS_PER_SCENE):
            if k % GOAL_STEPS == 0:
                goal = _goal(generator, solver)
            drift = 0.06 * (goal - now.cables_mm) + generator.uniform(-0.3, 0.3, 2)
            step = timed_step(solver, now, np.clip(now.cables_mm + drift, -LARGEST_CABLE, LARGEST_CABLE))
            yield step
            now = step.end


def summary(mix: Iterable[SpatialStep]) -> JsonObject:
    """Return durations and events of a mix."""
    times, statuses, touching, crossings = [], Counter[str](), 0, 0
    for step in mix:
        times.append(step.microseconds)
        statuses[step.end.status.name] += 1
        touching += bool(step.end.contact.any())
        crossings += bool((step.command * step.start.cables_mm < 0).any())
    return {
        "steps": len(times),
        "in_contact": touching / len(times),
        "sign_changes": crossings,
        "statuses": dict(statuses),
        "mean_us": float(np.mean(times)),
        **{f"{name}_us": float(np.percentile(times, q)) for name, q in (("median", 50), ("p95", 95), ("p99", 99))},
    }


def _goal(generator: np.random.Generator, solver: SpatialSolver) -> np.ndarray:
    """Return displacements that bend the robot towards an obstacle, or anywhere."""
    x, y, _ = solver.scene.obstacles[generator.integers(len(solver.scene))].extent.center
    towards = np.array([x, y]) / math.hypot(x, y) * generator.uniform(4, 10)
    anywhere = generator.uniform(-8, 8, 2)
    return towards if generator.random() < 0.8 else anywhere


def growth(counts: tuple[int, ...], repeats: int = 20) -> dict[int, float]:
    """Return the mean over a path of each step's median duration, by number of segments [µs]."""
    return {n: float(np.median([path_times(n) for _ in range(repeats)], axis=0).mean()) for n in counts}


def path_times(segments: int) -> list[float]:
    """Return the durations of the steps of a path to 8 mm and back [µs]."""
    solver = SpatialSolver(SpatialRobot.prototype(segments=segments), Scene([PUSHED]))
    now, times = solver.rest(), []
    for pull in PATH:
        step = timed_step(solver, now, pull * DIRECTION)
        now = step.end
        times.append(step.microseconds)
    return times


def measure(steps: int) -> JsonObject:
    """Return all measurements by name."""
    means = growth((9, 18, 36, 72, 144))
    return {
        **summary(contact_mix(steps)),
        "segments_mean_us": {str(n): mean for n, mean in means.items()},
        "growth_exponent": float(np.polyfit(np.log(list(means)), np.log(list(means.values())), 1)[0]),
    }
