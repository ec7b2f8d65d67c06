"""Count the instructions of the kernel on fixed replays of the contact mixes, which do not depend on the load.

Needs valgrind. ``python benchmarks/instructions.py`` compares with ``instructions.json``; ``--update`` writes it anew.
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

import numpy as np

from agents.bench import space
from agents.bench.kernel import PlanarStep, contact_mix
from solver import Robot
from solver.common.obstacle import SHAPES

HERE = Path(__file__).parent
RECORDED = HERE / "instructions.json"
STEPS = 2000


def planar(model: str) -> list[PlanarStep]:
    """The contact mix of the plane with one model of the robot."""
    return list(contact_mix(STEPS, robot=replace(Robot.prototype(), model=model)))


Steps = Sequence[PlanarStep | space.SpatialStep]
MIXES: dict[str, Callable[[], Steps]] = {
    "paper": lambda: planar("paper"),
    "rod": lambda: planar("rod"),
    "space": lambda: list(space.contact_mix(STEPS)),
}


def write(steps: Steps, path: Path) -> None:
    """The recording that replay.cpp reads: numbers all, counts among them."""
    robot = steps[0].solver.robot
    in_space = not isinstance(robot, Robot)
    sliding = not in_space and robot.model == "rod"
    numbers = [robot.length_mm, robot.offset_mm, robot.rigidity, robot.max_tension]
    groups = [(solver, list(group)) for solver, group in groupby(steps, key=lambda step: step.solver)]
    parts: list[object] = [3 if in_space else 2, sliding, robot.segments, *numbers, len(groups)]
    for solver, group in groups:
        parts.append(len(solver.scene))
        for obstacle in solver.scene:
            parts += [SHAPES[obstacle.kind].value, len(obstacle.parameters), obstacle.parameters]
        parts.append(len(group))
        for step in group:
            parts += [step.command, step.start.length_mm, step.start.block]
    np.concatenate([np.ravel(part) for part in parts]).astype(np.float64).tofile(path)


def build(folder: Path) -> Path:
    """The replay, compiled as the kernel is."""
    places = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    cmake = shutil.which("cmake", path=places)
    if cmake is None:
        raise SystemExit("cmake is not there; install it (pip install cmake) to build the replay")
    configure = [cmake, "-S", HERE, "-B", folder, f"-DPython_EXECUTABLE={sys.executable}"]
    for command in (configure, [cmake, "--build", folder, "--parallel"]):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return folder / "replay"


def count(program: Path, recording: Path) -> float:
    """Instructions of a step."""
    command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={recording}.out", program, recording]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    refs = re.search(r"refs:\s+([\d,]+)", done.stderr)
    assert refs is not None
    return int(refs[1].replace(",", "")) / int(done.stdout)


def main() -> None:
    """Count, compare, and write where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--update", action="store_true")
    arguments = parser.parse_args()
    if not shutil.which("valgrind"):
        raise SystemExit("valgrind is not there; install it to count instructions")
    found = {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        program = build(folder / "build")
        for name, mix in MIXES.items():
            write(mix(), folder / name)
            found[name] = round(count(program, folder / name))
    before = json.loads(RECORDED.read_text()) if RECORDED.exists() else {}
    for name, instructions in found.items():
        recorded = before.get(name)
        change = f", {instructions / recorded - 1:+.1%} against {recorded:,} recorded" if recorded else ""
        print(f"{name}: {instructions:,} instructions a step, reading the recording included{change}")
    if arguments.update:
        RECORDED.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
