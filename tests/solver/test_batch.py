"""A batch moves every robot as the solver would, whatever the company and the threads."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from solver import Circle, Robot, Scene, Solver, Status
from solver.batch import BatchSolver
from solver.robot import CABLES

EVERY_CABLE = pytest.mark.parametrize("cable", CABLES)


def circles(generator, count):
    drawn = generator.uniform((38, 75, 10), (75, 150, 16), (count, 3)).tolist()
    return [Circle(center=(x, y), radius=r, stiffness=0.5 if k % 3 == 0 else None) for k, (x, y, r) in enumerate(drawn)]


@EVERY_CABLE
@pytest.mark.parametrize("threads", [1, 2, 3])
def test_every_robot_moves_as_alone(cable, threads):
    robot, generator = replace(Robot.prototype(), cable=cable), np.random.default_rng(4)
    scenes = [Scene([circle]) for circle in circles(generator, 37)]
    batch = BatchSolver(robot, len(scenes), 1, threads)
    for i, scene in enumerate(scenes):
        batch.assign(i, scene)
    batch.rest(range(len(scenes)))
    solvers = [Solver(robot, scene) for scene in scenes]
    alone = [solver.rest() for solver in solvers]
    for _ in range(30):
        commands = np.clip(batch.blocks[:, 0] + generator.uniform(-0.4, 0.7, len(scenes)), 0, 14)
        batch.step(commands)
        alone = [solver.step(now, command) for solver, now, command in zip(solvers, alone, commands, strict=True)]
        for i, now in enumerate(alone):
            assert np.array_equal(batch.blocks[i], now.block)
            assert batch.statuses[i] == now.status
    assert sum(now.contact.any() for now in alone) > 10


def test_some_move_and_the_others_stay():
    batch = BatchSolver(Robot.prototype(), 4, 0)
    for i in range(4):
        batch.assign(i, Scene())
    batch.rest(range(4))
    batch.step(np.array([2.0, 3.0]), [1, 3])
    assert batch.blocks[:, 0].tolist() == [0, 2, 0, 3]
    assert batch.equilibrium(3).status is Status.CONVERGED


def test_reaches_is_a_steady_pull():
    generator = np.random.default_rng(0)
    scenes = [Scene([circle]) for circle in circles(generator, 60)]
    batch, forces = BatchSolver(Robot.prototype(), 60, 1), generator.uniform(0.02, 0.3, 60)
    for i, scene in enumerate(scenes):
        batch.assign(i, scene)
    found, ends = batch.reaches(range(60), forces, 0.5, 14.0)
    for scene, force, reached, end in zip(scenes, forces, found, ends, strict=True):
        solver = Solver(Robot.prototype(), scene)
        now, expected = solver.rest(), False
        for command in np.arange(0.5, 14, 0.5):
            now = solver.step(now, command)
            if now.status is not Status.CONVERGED:
                break
            if now.contact.any() and np.linalg.norm(now.forces.sum(axis=0)) >= force:
                expected = True
                break
        assert reached == expected
        assert not expected or end == pytest.approx(now.forces.sum(axis=0), rel=1e-9)
    assert 0 < found.sum() < 60


FORKED = """
import os
import numpy as np
from solver import Robot, Scene
from solver.batch import BatchSolver
batch = BatchSolver(Robot.prototype(), 64, 0, threads=2)
for i in range(64):
    batch.assign(i, Scene())
batch.rest(range(64))
batch.step(np.full(64, 1.0))
child = os.fork()
batch.step(np.full(64, 2.0))
if child == 0:
    os._exit(0 if np.all(batch.blocks[:, 0] == 2) else 1)
assert os.waitpid(child, 0)[1] == 0
assert np.all(batch.blocks[:, 0] == 2)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_forked_process_has_threads_of_its_own():
    subprocess.run([sys.executable, "-W", "ignore", "-c", FORKED], check=True, timeout=60)


def test_what_it_refuses():
    for arguments, message in (((0, 1), "count is 0"), ((2, 1, 0), "threads is 0")):
        with pytest.raises(ValueError, match=message):
            BatchSolver(Robot.prototype(), *arguments)
    batch = BatchSolver(Robot.prototype(), 2, 1)
    with pytest.raises(ValueError, match="as many obstacles as it was made for"):
        batch.assign(0, Scene())
    batch.assign(0, Scene([Circle(center=(44, 104), radius=15)]))
    with pytest.raises(ValueError, match="cable_mm is"):
        batch.step(np.array([1.0, 99.0]))
    with pytest.raises(ValueError, match="robot 1 has not been assigned"):
        batch.equilibrium(1)


def test_a_probe_tells_where_a_step_would_lead_and_moves_nothing():
    robot, generator = Robot.prototype(), np.random.default_rng(5)
    batch = BatchSolver(robot, 9, 1)
    for i, circle in enumerate(circles(generator, 9)):
        batch.assign(i, Scene([circle]))
    batch.rest(range(9))
    for _ in range(20):
        cables = np.clip(batch.blocks[:, 0] + generator.uniform(-0.4, 0.7, 9), 0, 14)
        commands = batch.commands.copy()
        commands[:, 0] = cables
        before = batch.blocks.copy(), batch.statuses.copy(), batch.iterations.copy(), batch.commands.copy()
        probed = batch.probe(commands)
        after = batch.blocks, batch.statuses, batch.iterations, batch.commands
        assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))
        batch.step(cables)
        assert np.array_equal(batch.blocks, probed)
