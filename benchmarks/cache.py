"""Measure what the caches of the solver save: the memo of steps in three uses, and the store of compiled shapes.

``python -m benchmarks.cache`` takes medians of rounds in which each use goes without the memo and with it by turns,
compares the bits, and writes ``docs/results/cache.json``. Times are CPU times, of compilers too.
"""

import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import tyro

from benchmarks import pages
from benchmarks.derivatives import INCREMENT, at_random, scenes
from solver import Equilibrium, Robot, Solver, TransitionMemo

REPLAYS = 5  # of each recorded episode
DEPTH, ACTIONS, MOVES = 3, (-1.0, -0.5, 0.0, 0.5, 1.0), 10  # of the search, actions over the largest increment
FORCES, KEPT = (0.5, 3.0), 5  # range of what it is for [EI/L²], and for how many moves
LARGEST = 14.0  # displacement of the cable [mm]

START = """
import json
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage

from solver import Custom, Family, Robot, Scene, Solver
from solver.cache.compile import store


def cpu_time():
    used = [getrusage(who) for who in (RUSAGE_SELF, RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in used)


oval = Family.trace(lambda point, sizes: (point[0] / sizes[0]) ** 4 + (point[1] / sizes[1]) ** 2 - 1, sizes=2)
scene = Scene([Custom(family=oval, sizes=(15, 9), center=(44, 104), axis=(1, 2), reach=20)])
begin = cpu_time()
Solver(Robot.prototype(between=1), scene)
print(json.dumps([cpu_time() - begin, *store().statistics[:3]]))
"""  # in a process of its own: the CPU time of the first solver, compilers included, and what the store did

Stepper = Solver | TransitionMemo[Equilibrium, Any]
Use = Callable[[Stepper, Sequence[float]], list[Equilibrium]]


@dataclass(frozen=True)
class Args:
    """Measure the caches, and write the numbers of the docs."""

    rounds: int = 5
    """Rounds, without and with the memo by turns."""
    starts: int = 5
    """Rounds of three starts with a compiled shape."""
    write: bool = True
    """Whether to write the result, or to print only."""


def follow(stepper: Stepper, commands: Sequence[float]) -> list[Equilibrium]:
    """Return the equilibria of steps from rest."""
    now, found = stepper.rest(), []
    for command in commands:
        now = stepper.step(now, command)
        found.append(now)
    return found


def replay(stepper: Stepper, commands: Sequence[float]) -> list[Equilibrium]:
    """Play a recorded episode again and again, each time from a reset."""
    return [state for _ in range(REPLAYS) for state in follow(stepper, commands)]


def search(stepper: Stepper, commands: Sequence[float]) -> list[Equilibrium]:
    """Pull to contact, then move by the action that begins the best branch of a tree, grown anew each time."""
    robot, now, tried = stepper.robot, stepper.rest(), []
    assert isinstance(robot, Robot)
    unit, largest = robot.rigidity / robot.length_mm**2, INCREMENT * robot.offset_mm
    generator, wanted = np.random.default_rng(len(commands)), 0.0

    def best(state: Equilibrium, depth: int) -> tuple[float, float]:
        """Return the least error of the force at the end of the branches below a state, and how that one begins."""
        if depth == 0:
            return abs(math.hypot(*state.forces[0].tolist()) / unit - wanted), 0.0
        errors = []
        for action in ACTIONS:
            command = min(max(state.cable_mm + action * largest, 0.0), LARGEST)
            tried.append(stepper.step(state, command))
            errors.append((best(tried[-1], depth - 1)[0], command))
        return min(errors)

    while not now.contact.any() and now.cable_mm < LARGEST:
        now = stepper.step(now, now.cable_mm + largest)
    for move in range(MOVES):
        if move % KEPT == 0:
            wanted = generator.uniform(*FORCES)
        now = stepper.step(now, best(now, DEPTH)[1])
        tried.append(now)
    return tried


USES: dict[str, Use] = {"replays": replay, "search": search, "walk": follow}


def measure(use: Use, rounds: int) -> dict[str, float]:
    """Return hit rate, steps, and the median ratio of the times without and with the memo.

    Raises:
        SystemExit: If the bits differ.
    """
    robot, ratios, hits, steps = Robot.prototype(), [], 0, 0
    solvers = [Solver(robot, scene) for scene in scenes()]
    walks = [
        [float(step.command) for step in at_random(robot, solver.scene, seed)] for seed, solver in enumerate(solvers)
    ]
    for round_ in range(rounds):
        times = [0.0, 0.0]  # without the memo, and with it
        for solver, walk in zip(solvers, walks, strict=True):
            memo = TransitionMemo(solver)
            blocks = [b"", b""]
            for kind in (0, 1) if round_ % 2 else (1, 0):
                begin = process_time()
                states = use(memo if kind else solver, walk)
                times[kind] += process_time() - begin
                blocks[kind] = b"".join(state.block.tobytes() for state in states)
            if blocks[0] != blocks[1]:
                sys.exit("the memo changes the bits of a step")
            hits, steps = hits + memo.statistics.hits, steps + memo.statistics.hits + memo.statistics.misses
        ratios.append(times[0] / times[1])
    return {"hit_rate": hits / steps, "steps": steps // rounds, "ratio": float(np.median(ratios))}


def starts(rounds: int) -> dict[str, float]:
    """Return the times of a first start and of one after damage over that of one that finds the compiled shape.

    Raises:
        SystemExit: If the store did something else.
    """
    times: list[list[float]] = []
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            times.append([])
            for expected in ([0, 1, 0], [1, 0, 0], [0, 0, 1]):  # hits, builds and rebuilds
                if expected[2]:
                    for entry in Path(folder).iterdir():
                        entry.write_bytes(entry.read_bytes()[:-1])
                command, environment = [sys.executable, "-c", START], os.environ | {"CCR_GYM_CACHE": folder}
                done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
                seconds, *did = json.loads(done.stdout)
                if did != expected:
                    sys.exit(f"a start should have counted hits, builds and rebuilds {expected}, and counted {did}")
                times[-1].append(seconds)
    first, second, damaged = np.array(times).T
    return {"first": float(np.median(first / second)), "damaged": float(np.median(damaged / second))}


def show(name: str, numbers: dict[str, float]) -> None:
    """Print what was measured of something."""
    print(name, ", ".join(f"{key} {value:.4g}" for key, value in numbers.items()), flush=True)


def main(args: Args) -> None:
    """Measure, print and write."""
    found: dict[str, Any] = {}
    for name, use in USES.items():
        found[name] = measure(use, args.rounds)
        show(name, found[name])
    found["starts"] = starts(args.starts)
    show("starts", found["starts"])
    if args.write:
        pages.save("cache", pages.rounded(found))
        pages.write()


if __name__ == "__main__":
    main(tyro.cli(Args))
