"""Instructions of the kernel on fixed replays of the contact mix, counted by valgrind: they do not depend on the load.

``python benchmarks/instructions.py`` compares with ``instructions.json``; ``--update`` writes it anew.
"""

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import numpy as np

from agents.bench.kernel import Timed, contact_mix
from solver import Robot

HERE = Path(__file__).parent
NATIVE, RECORDED = HERE.parent / "solver" / "native", HERE / "instructions.json"
MATH = ["-fno-math-errno", "-fno-trapping-math", "-fno-signed-zeros", "-ffp-contract=off"]
FLAGS = ["-std=c++20", "-O3", *MATH, "-Wno-psabi"]
STEPS = 2000


def write(steps: list[Timed], path: Path) -> None:
    """The recording that replay.cpp reads: numbers all, counts among them."""
    robot = steps[0].solver.robot
    numbers = [robot.cable == "sliding", robot.segments, robot.offset_mm, robot.rigidity, robot.max_tension]
    groups = [(solver, list(group)) for solver, group in groupby(steps, key=lambda step: step.solver)]
    parts: list[object] = [*numbers, robot.length_mm, len(groups)]
    for solver, group in groups:
        parts += [len(solver.scene), *(o.parameters for o in solver.scene), len(group)]
        for step in group:
            parts += [step.command, step.start.length_mm, step.start.block]
    np.concatenate([np.ravel(part) for part in parts]).astype(np.float64).tofile(path)


def build(folder: Path) -> Path:
    """The replay, compiled as the kernel is."""
    laws, program = folder / "laws", folder / "replay"
    laws.mkdir()
    subprocess.run([sys.executable, NATIVE.parent / "codegen.py", laws], check=True)
    sources = [
        HERE / "replay.cpp",
        *(path for path in NATIVE.glob("*.cpp") if path.stem not in ("binding", "segment_wide")),
    ]
    subprocess.run(["c++", *FLAGS, f"-I{NATIVE}", f"-I{laws}", *sources, "-o", program], check=True)
    return program


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
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program = build(folder)
        for cable in ("uniform", "sliding"):
            write(list(contact_mix(STEPS, robot=replace(Robot.prototype(), cable=cable))), folder / cable)
            found[cable] = round(count(program, folder / cable))
    before = json.loads(RECORDED.read_text()) if RECORDED.exists() else {}
    for cable, instructions in found.items():
        recorded = before.get(cable)
        change = f", {instructions / recorded - 1:+.1%} against {recorded:,} recorded" if recorded else ""
        print(f"{cable} cable: {instructions:,} instructions a step, reading the recording included{change}")
    if arguments.update:
        RECORDED.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
