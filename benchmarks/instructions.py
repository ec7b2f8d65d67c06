"""Count the instructions of the kernel on fixed replays of the contact mixes; unlike times, they are reproducible.

Whole steps of environments are counted in a vector of them, from Python, as the difference of two runs.

Needs valgrind. ``python benchmarks/instructions.py`` compares with ``instructions.json``; ``--update`` rewrites it.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import gymnasium
import numpy as np

import ccr_gym  # noqa: F401 - registers the environments
from agents.bench import space
from agents.bench.kernel import PlanarStep, contact_mix
from solver import Robot
from solver.common.obstacle import SHAPES

HERE, ROOT = Path(__file__).parent, Path(__file__).parents[1]
RECORDED = HERE / "instructions.json"
STEPS = 2000
ENVS, SHORT, LONG = 64, 20, 60  # environments of a vector, and steps of both runs
PLAYED = {"environment": ("ideal", 0.0), "environment, realistic, by force": ("realistic", 2.0)}  # sensing, gain


def planar(model: str) -> list[PlanarStep]:
    """Return the planar contact mix with one model of the robot."""
    return list(contact_mix(STEPS, robot=replace(Robot.prototype(), model=model)))


def in_space(cables: int) -> list[space.SpatialStep]:
    """Return the contact mix in space with the rod and a number of even cables."""
    return list(space.contact_mix(STEPS, robot=space.rod(cables)))


Steps = Sequence[PlanarStep | space.SpatialStep]
MIXES: dict[str, Callable[[], Steps]] = {
    "paper": lambda: planar("paper"),
    "rod": lambda: planar("rod"),
    "space": lambda: list(space.contact_mix(STEPS)),
    "space rod, 2 cables": lambda: in_space(2),
    "space rod, 3 cables": lambda: in_space(3),
    "space rod": lambda: in_space(4),
}


def write(steps: Steps, path: Path) -> None:
    """Write the recording that replay.cpp reads, counts included, as one array of numbers."""
    robot = steps[0].solver.robot
    in_space = not isinstance(robot, Robot)
    angles = [cable.angle for cable in robot.cables] if robot.model == "rod" else []
    numbers = [robot.length_mm, robot.offset_mm, robot.rigidity, robot.max_tension]
    groups = [(solver, list(group)) for solver, group in groupby(steps, key=lambda step: step.solver)]
    parts: list[object] = [3 if in_space else 2, len(angles), angles, robot.segments, *numbers, len(groups)]
    for solver, group in groups:
        parts.append(len(solver.scene))
        for obstacle in solver.scene:
            parts += [SHAPES[obstacle.kind].value, len(obstacle.parameters), obstacle.parameters]
        parts += [len(group[0].start.block), len(group)]
        for step in group:
            parts += [step.command, step.start.length_mm, step.start.block]
    np.concatenate([np.ravel(part) for part in parts]).astype(np.float64).tofile(path)


def build(folder: Path) -> Path:
    """Build the replay with the compiler flags of the kernel; return the path of the program."""
    search_path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    cmake = shutil.which("cmake", path=search_path)
    if cmake is None:
        raise SystemExit("cmake not found; the replay is built with it: pip install cmake")
    configure = [cmake, "-S", HERE, "-B", folder, f"-DPython_EXECUTABLE={sys.executable}"]
    for command in (configure, [cmake, "--build", folder, "--parallel"]):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return folder / "replay"


def count(program: Path, recording: Path, what: str = "step") -> float:
    """Return the instructions per step of what the program does with a recording."""
    command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={recording}.out", program, recording, what]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return instructions_in(done.stderr) / int(done.stdout)


def play(sensing: str, gain: float, steps: int) -> None:
    """Play steps of a vector of environments: at random, or proportional to the missing force."""
    envs = gymnasium.make_vec("CCR/PushObstacle-v1", ENVS, "vector_entry_point", sensing=sensing)
    info, generator = envs.reset(seed=0)[1], np.random.default_rng(0)
    for _ in range(steps):
        missing = info["desired_force"] - np.linalg.norm(info["force_true"], axis=1)
        actions = generator.uniform(-1, 1, ENVS) if gain == 0 else gain * missing / info["desired_force"]
        info = envs.step(np.clip(actions, -1, 1)[:, None])[-1]


def count_environment(sensing: str, gain: float) -> float:
    """Return the instructions per step of an environment in a vector, Python's included."""
    found = []
    for steps in (SHORT, LONG):
        played = [sys.executable, "-m", "benchmarks.instructions", "--play", sensing, str(gain), str(steps)]
        command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", *played]
        fixed = {**os.environ, "PYTHONHASHSEED": "0", "OMP_NUM_THREADS": "1"}
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT, env=fixed)
        found.append(instructions_in(done.stderr))
    return (found[1] - found[0]) / (LONG - SHORT) / ENVS


def instructions_in(output: str) -> int:
    """Return the number of instructions that callgrind reports."""
    refs = re.search(r"refs:\s+([\d,]+)", output)
    assert refs is not None
    return int(refs[1].replace(",", ""))


def main() -> None:
    """Count the instructions, compare them with those on record, and update the record if asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--play", nargs=3, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.play:
        sensing, gain, steps = arguments.play
        return play(sensing, float(gain), int(steps))
    if not shutil.which("valgrind"):
        raise SystemExit("valgrind not found; it counts the instructions: apt-get install valgrind")
    found = {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        program = build(folder / "build")
        for name, mix in MIXES.items():
            write(mix(), folder / name)
            found[name] = round(count(program, folder / name))
    found |= {name: round(count_environment(*how)) for name, how in PLAYED.items()}
    before = json.loads(RECORDED.read_text()) if RECORDED.exists() else {}
    for name, instructions in found.items():
        recorded = before.get(name)
        change = f", {instructions / recorded - 1:+.1%} against {recorded:,} recorded" if recorded else ""
        print(f"{name}: {instructions:,} instructions per step{change}")
    if arguments.update:
        RECORDED.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
