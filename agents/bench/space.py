"""Benchmark of the kernel in space: a random mix of contacts, and growth with the number of segments."""

import math
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from agents.bench.kernel import Timed
from agents.files import JsonObject
from solver import Cable, Scene, Status
from solver.spatial import Cylinder, SpatialEquilibrium, SpatialRobot, SpatialSolver, Sphere

SEGMENTS = (18, 36, 72, 144)  # the sphere of the path could slip through the edges of fewer
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


def paper(segments: int = 18) -> SpatialRobot:
    """Return the prototype of the paper's model."""
    return SpatialRobot.prototype(model="paper", segments=segments)


def rod(cables: int, segments: int = 18) -> SpatialRobot:
    """Return the prototype as a rod with a number of even cables, with two those of the paper's model."""
    turn = 4 if cables == 2 else cables
    around = tuple(Cable(angle=2 * math.pi * k / turn) for k in range(cables))
    return SpatialRobot.prototype(model="rod", cables=around, segments=segments)


def pulls(robot: SpatialRobot, bend: np.ndarray) -> np.ndarray:
    """Return the displacements of the cables that bend a robot by displacements towards +x and +y [mm]."""
    return bend if robot.model == "paper" else _directions(robot) @ bend


def _bend(robot: SpatialRobot, cables_mm: np.ndarray) -> np.ndarray:
    """Return the bend whose :func:`pulls` are nearest to displacements [mm]."""
    return cables_mm if robot.model == "paper" else np.linalg.lstsq(_directions(robot), cables_mm, rcond=None)[0]


def _directions(robot: SpatialRobot) -> np.ndarray:
    return np.array([(math.cos(cable.angle), math.sin(cable.angle)) for cable in robot.cables])


def contact_mix(steps: int, seed: int = 0, robot: SpatialRobot | None = None) -> Iterator[SpatialStep]:
    """Yield steps of random increments of ±0.3 mm with a drift towards an obstacle or, one time in five, anywhere."""
    generator, robot = np.random.default_rng(seed), robot or paper()
    for _ in range(steps // STEPS_PER_SCENE):
        solver = random_solver(generator, robot)
        now, goal = solver.rest(), np.zeros(2)
        for k in range(STEPS_PER_SCENE):
            if k % GOAL_STEPS == 0:
                goal = _goal(generator, solver)
            bend = _bend(robot, now.cables_mm)
            drift = 0.06 * (goal - bend) + generator.uniform(-0.3, 0.3, 2)
            step = timed_step(solver, now, pulls(robot, np.clip(bend + drift, -LARGEST_CABLE, LARGEST_CABLE)))
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


def growth(robots: Sequence[SpatialRobot], repeats: int = 20) -> list[float]:
    """Return the mean over a path of each step's median duration, for each robot [µs]."""
    return [float(np.median([path_times(robot) for _ in range(repeats)], axis=0).mean()) for robot in robots]


def path_times(robot: SpatialRobot) -> list[float]:
    """Return the durations of the steps of a path to 8 mm and back [µs].

    The cables opposite those that pull are let out farther than these pull: twist lengthens the path of both, and
    exactly paid out they lock the finer a robot is divided, as each segment's chord leaves less slack.
    """
    solver = SpatialSolver(robot, Scene([PUSHED]))
    now, times = solver.rest(), []
    for pull in PATH:
        cables = pulls(robot, pull * DIRECTION)
        step = timed_step(solver, now, cables if robot.model == "paper" else np.where(cables < 0, 1.1 * cables, cables))
        now = step.end
        times.append(step.microseconds)
    return times


def measure(steps: int) -> JsonObject:
    """Return all measurements by name: of the paper's model, and of the rod."""
    return {
        "paper": summary(contact_mix(steps))
        | grown([SpatialRobot.prototype(model="paper", segments=n) for n in SEGMENTS]),
        "rod": summary(contact_mix(steps, robot=rod(4))) | grown([rod(4, n) for n in SEGMENTS]),
        "rod_cables_mean_us": dict(zip("2346", growth([rod(cables) for cables in (2, 3, 4, 6)]), strict=True)),
    }


def grown(robots: Sequence[SpatialRobot]) -> JsonObject:
    """Return durations of robots with growing numbers of segments, and the exponent of their growth."""
    counts, means = [robot.segments for robot in robots], growth(robots)
    return {
        "segments_mean_us": {str(n): mean for n, mean in zip(counts, means, strict=True)},
        "growth_exponent": float(np.polyfit(np.log(counts), np.log(means), 1)[0]),
    }
