"""Count the instructions of steps with and without their derivatives, on two drives of the scenes of PushObstacle.

Needs valgrind. ``python benchmarks/derivatives.py`` prints the ratio of derivatives to steps for each model and drive:
of the slopes in the cable and in all parameters that a step finds as it ends, and of those of its equilibrium alone.
"""

import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np

import ccr_gym  # noqa: F401
from agents.bench.kernel import PlanarStep, Timed
from benchmarks.instructions import build, count, write
from solver import Robot, Scene, Solver

SCENES, STEPS = 10, 200
INCREMENT = 1 / 16  # largest, over the offset of the cable
GAIN = 0.35  # of the proportional controller: increment over the largest one, per EI/L² of error
MODELS = ("rod", "paper")


def scenes() -> list[Scene]:
    """Return scenes of one circle, as CCR/PushObstacle-v1 samples them."""
    env = gymnasium.make("CCR/PushObstacle-v1")
    found = []
    for seed in range(SCENES):
        env.reset(seed=seed)
        found.append(env.get_wrapper_attr("equilibrium").scene)
    return found


def at_random(robot: Robot, scene: Scene, seed: int) -> Iterator[PlanarStep]:
    """Yield steps by random increments."""
    generator, solver = np.random.default_rng(seed), Solver(robot, scene)
    largest, equilibrium = INCREMENT * robot.offset_mm, solver.rest()
    for _ in range(STEPS):
        command = float(np.clip(equilibrium.cable_mm + generator.uniform(-largest, largest), 0, 14))
        after = solver.step(equilibrium, command)
        yield Timed(solver, equilibrium, command, after, 0.0)
        equilibrium = after


def by_force(robot: Robot, scene: Scene, seed: int) -> Iterator[PlanarStep]:
    """Yield steps of a proportional controller, after a search for contact, towards forces that change now and then."""
    generator, solver = np.random.default_rng(seed), Solver(robot, scene)
    largest, equilibrium = INCREMENT * robot.offset_mm, solver.rest()
    unit, wanted = robot.rigidity / robot.length_mm**2, 0.0
    for k in range(STEPS):
        if k % 10 == 0:
            wanted = generator.uniform(0.5, 3) * unit
        error = (wanted - np.linalg.norm(equilibrium.forces.sum(axis=0))) / unit
        part = float(np.clip(GAIN * error, -1, 1)) if equilibrium.contact.any() else 1.0
        command = float(np.clip(equilibrium.cable_mm + part * largest, 0, 14))
        after = solver.step(equilibrium, command)
        yield Timed(solver, equilibrium, command, after, 0.0)
        equilibrium = after


def main() -> None:
    """Count the instructions and print the ratios."""
    if not shutil.which("valgrind"):
        raise SystemExit("valgrind not found; it counts the instructions: apt-get install valgrind")
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        program = build(folder / "build")
        for model in MODELS:
            robot = replace(Robot.prototype(), model=model)
            for drive in (at_random, by_force):
                steps = [step for seed, scene in enumerate(scenes()) for step in drive(robot, scene, seed)]
                touching = np.mean([step.end.contact.any() for step in steps])
                write(steps, path := folder / f"{model}_{drive.__name__}")
                read, step, derivatives, in_all, slopes = (
                    count(program, path, what) for what in ("read", "step", "derivatives", "all", "slopes")
                )
                ratios = [(more - step) / (step - read) for more in (derivatives, in_all, slopes)]
                print(
                    f"{model}, {drive.__name__}, {touching:.0%} in contact: {step - read:,.0f} instructions per step; "
                    "derivatives in the cable {:.2f}, in all parameters {:.2f}, of the equilibrium {:.2f}".format(
                        *ratios
                    )
                )


if __name__ == "__main__":
    main()
