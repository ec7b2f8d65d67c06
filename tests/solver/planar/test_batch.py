"""A batch moves every robot as the solver would, whatever the company and the threads."""

import os
import subprocess
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from solver import Circle, Robot, Scene, Solver, Status
from solver.common.robot import MODELS
from solver.planar.batch import BatchSolver

EVERY_MODEL = pytest.mark.parametrize("model", MODELS)


def circles(generator, count):
    sampled = generator.uniform((38, 75, 10), (75, 150, 16), (count, 3)).tolist()
    return [Circle(center=(x, y), radius=r, spring=0.5 if k % 3 == 0 else None) for k, (x, y, r) in enumerate(sampled)]


@EVERY_MODEL
@pytest.mark.parametrize("threads", [1, 2, 3])
def test_every_robot_moves_as_alone(model, threads):
    robot, generator = replace(Robot.prototype(model="paper"), model=model), np.random.default_rng(4)
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
    batch = BatchSolver(Robot.prototype(model="paper"), 4, 0)
    for i in range(4):
        batch.assign(i, Scene())
    batch.rest(range(4))
    batch.step(np.array([2.0, 3.0]), [1, 3])
    assert batch.blocks[:, 0].tolist() == [0, 2, 0, 3]
    assert batch.equilibrium(3).status is Status.CONVERGED


def test_reaches_is_a_steady_pull():
    generator = np.random.default_rng(0)
    scenes = [Scene([circle]) for circle in circles(generator, 60)]
    batch, forces = BatchSolver(Robot.prototype(model="paper"), 60, 1), generator.uniform(0.02, 0.3, 60)
    for i, scene in enumerate(scenes):
        batch.assign(i, scene)
    found, ends = batch.ramp_reaches_force(range(60), forces, 0.5, 14.0)
    for scene, force, reached, end in zip(scenes, forces, found, ends, strict=True):
        solver = Solver(Robot.prototype(model="paper"), scene)
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
from solver.planar.batch import BatchSolver
batch = BatchSolver(Robot.prototype(model="paper"), 64, 0, threads=2)
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
            BatchSolver(Robot.prototype(model="paper"), *arguments)
    batch = BatchSolver(Robot.prototype(model="paper"), 2, 1)
    with pytest.raises(ValueError, match="scene has 0 obstacles; each of the batch's has 1"):
        batch.assign(0, Scene())
    batch.assign(0, Scene([Circle(center=(44, 104), radius=15)]))
    with pytest.raises(ValueError, match="cable_mm is"):
        batch.step(np.array([1.0, 99.0]))
    with pytest.raises(ValueError, match="robot 1 has no scene"):
        batch.equilibrium(1)


def test_a_probe_tells_where_a_step_would_lead_and_moves_nothing():
    robot, generator = Robot.prototype(model="paper"), np.random.default_rng(5)
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


def crowd(count, segments, threads=1):
    """Robots at rest, all before the same circle, whose step takes a while when they are many and finely divided."""
    batch = BatchSolver(replace(Robot.prototype(model="paper"), segments=segments), count, 1, threads)
    scene = Scene([Circle(center=(44, 104), radius=15)])
    for i in range(count):
        batch.assign(i, scene)
    batch.rest(range(count))
    return batch


@EVERY_MODEL
def test_optimality(model):
    robot, generator = replace(Robot.prototype(model="paper"), model=model), np.random.default_rng(6)
    scenes = [Scene([circle]) for circle in circles(generator, 9)]
    batch, solvers = BatchSolver(robot, 9, 1), [Solver(robot, scene) for scene in scenes]
    for i, scene in enumerate(scenes):
        batch.assign(i, scene)
    batch.rest(range(9))
    assert batch.optimality().max() <= 1e-12
    for _ in range(14):
        batch.step(batch.blocks[:, 0] + 0.5)
        found = batch.optimality()
        assert found.shape == (9, 3)
        assert found.max() <= 1e-8
        alone = [solver.optimality(batch.equilibrium(i)) for i, solver in enumerate(solvers)]
        assert np.array_equal(found, alone)
    assert (batch.statuses == Status.CONVERGED).all()
    assert sum(batch.equilibrium(i).contact.any() for i in range(9)) >= 3


@EVERY_MODEL
def test_optimality_of_what_is_no_equilibrium(model):
    """A robot whose segments are bent a little otherwise, or whose contact pushes harder, than it should."""
    robot, scene = replace(Robot.prototype(model="paper"), model=model), Scene([Circle(center=(44, 104), radius=15)])
    batch, solver = BatchSolver(robot, 3, 1), Solver(robot, scene)
    for i in range(3):
        batch.assign(i, scene)
    batch.rest(range(3))
    for cable_mm in np.arange(1, 9):
        batch.step(np.full(3, float(cable_mm)))
    bent, pushed = batch.layout.coordinates(batch.blocks[1]), batch.layout.multipliers(batch.blocks[2])
    assert pushed.any()
    bent += 0.01 * np.cos(np.arange(robot.segments))
    pushed *= 1.5
    found = batch.optimality()
    assert found[0].max() <= 1e-8
    assert (found[1:, 0] >= 1e-5).all()
    for i in (1, 2):
        assert np.array_equal(solver.optimality(batch.equilibrium(i)), found[i])


def test_a_batch_in_use_by_another_thread_says_so_and_nothing_of_it_changes():
    batch, twin = crowd(300, 150), crowd(300, 150)
    running = threading.Thread(target=batch.step, args=(np.full(300, 9.0),))
    running.start()
    while not batch.commands[:, 0].all():  # which the step writes first
        time.sleep(0.001)
    time.sleep(0.05)
    uses = [
        lambda: batch.step(np.full(300, 2.0)),
        lambda: batch.assign(7, Scene([Circle(center=(50, 104), radius=15)])),
        lambda: batch.rest([299]),
        lambda: batch.move(299),
        lambda: batch.probe(batch.commands),
        lambda: batch.equilibrium(299),
        batch.optimality,
        lambda: batch.ramp_reaches_force([299], np.array([0.1]), 0.5, 9.0),
    ]
    for use in uses:
        with pytest.raises(RuntimeError, match="in use by another thread; give each thread a batch of its own"):
            use()
    assert running.is_alive()
    running.join()
    twin.step(np.full(300, 9.0))
    assert np.array_equal(batch.blocks, twin.blocks)
    assert np.array_equal(batch.commands, twin.commands)
    batch.step(np.full(300, 9.5))  # and it is free again
    assert batch.blocks[299, 0] == 9.5


INTERRUPTED = """
import signal, threading, time
import numpy as np
from solver import Circle, Robot, Scene
from solver.planar.batch import BatchSolver

robot = Robot(model="paper", length_mm=180, segments=200, offset_mm=8)
scene = Scene([Circle(center=(44, 104), radius=15)])
count = 4000
batch = BatchSolver(robot, count, 1, threads=THREADS)
for i in range(count):
    batch.assign(i, scene)
batch.rest(range(count))
before = batch.blocks.copy()

def interrupt():
    while not (batch.blocks[20, 0] == 9.0).all():
        time.sleep(0.001)
    global sent
    sent = time.monotonic()
    signal.raise_signal(signal.SIGINT)

threading.Thread(target=interrupt).start()
try:
    batch.step(np.full(count, 9.0))
except KeyboardInterrupt:
    late = time.monotonic() - sent
else:
    raise SystemExit("the step was not interrupted")
assert late < 1, late
moved = batch.blocks[:, 0] == 9.0
assert 20 < moved.sum() < count, moved.sum()
assert np.array_equal(batch.blocks[~moved], before[~moved])
assert np.array_equal(batch.blocks[moved], np.tile(batch.blocks[20], (moved.sum(), 1)))
last = int(np.flatnonzero(~moved)[-1])
batch.step(np.array([9.0]), [last])
assert np.array_equal(batch.blocks[last], batch.blocks[20])
"""


@pytest.mark.parametrize("threads", [1, 2])
def test_ctrl_c_ends_a_long_step_between_two_robots(threads):
    program = INTERRUPTED.replace("THREADS", str(threads))
    subprocess.run([sys.executable, "-c", program], check=True, timeout=120)


def test_robots_whose_rest_was_cut_short_do_not_move_until_they_rest(monkeypatch):
    def interrupted(robots):
        raise KeyboardInterrupt

    batch = crowd(3, 18)
    batch.step(np.full(3, 9.0))
    with monkeypatch.context() as patch:
        patch.setattr(batch, "_rest", interrupted)
        with pytest.raises(KeyboardInterrupt):
            batch.rest([1])
    for use in (lambda: batch.move(1), lambda: batch.equilibrium(1), lambda: batch.step(np.full(3, 9.5))):
        with pytest.raises(
            ValueError, match=r"its rest was interrupted or refused; call rest\(\[1\]\) before it moves"
        ):
            use()
    batch.rest([1])
    batch.step(np.full(3, 9.0))
    assert batch.blocks[:, 0].tolist() == [9.0, 9.0, 9.0]


def test_a_block_that_no_robot_can_have_stays_as_it_is():
    batch = BatchSolver(Robot.prototype(model="paper"), 1, 0)
    batch.assign(0, Scene())
    batch.rest([0])
    batch.blocks[:] = 1e300
    batch.blocks[0, batch.layout.length.at] = 180.0
    written = batch.blocks.copy()
    batch.step(np.array([4.0]))
    assert batch.statuses[0] == Status.GAVE_UP
    assert np.array_equal(batch.blocks, written)
