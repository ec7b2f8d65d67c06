"""Ctrl-C ends a long call within a second, also amid the step of one robot, and leaves what it did not reach.

The signals come from another process: a step holds the interpreter's lock, so that no other thread could send one.
"""

import multiprocessing
import os
import signal
import time
from contextlib import contextmanager

import numpy as np
import pytest

from solver import BatchSolver, Circle, Robot, Scene, Solver
from solver.spatial import SpatialBatchSolver, SpatialRobot, Sphere

LONG = Robot(length_mm=180, segments=4096, offset_mm=8, between=15, model="rod")
CROWD = Scene(
    [
        Circle(center=(44, 104), radius=15),
        Circle(center=(60, 160), radius=10),
        Circle(center=(-20, 60), radius=12),
        Circle(center=(90, 120), radius=8),
    ]
)


def send(number, at):
    time.sleep(max(0.0, at - time.monotonic()))
    os.kill(os.getppid(), number)


@contextmanager
def signalled(number, after=0.5):
    """Send this process a signal some time later [s]; give the time at which it is sent."""
    at = time.monotonic() + after
    sender = multiprocessing.get_context("fork").Process(target=send, args=(number, at))
    sender.start()
    try:
        yield at
    finally:
        sender.join()


def lateness(call):
    """Return how long after Ctrl-C a call ended [s]."""
    with signalled(signal.SIGINT) as sent:
        with pytest.raises(KeyboardInterrupt):
            call()
        return time.monotonic() - sent


@pytest.mark.parametrize("use", [Solver.step, Solver.trace])
def test_ctrl_c_ends_a_long_step(use):
    solver = Solver(LONG, CROWD)
    assert lateness(lambda: use(solver, solver.rest(), 25.0)) < 1
    again, other = solver.step(solver.rest(), 0.2), Solver(LONG, CROWD)
    assert np.array_equal(again.block, other.step(other.rest(), 0.2).block)


@pytest.mark.parametrize(("count", "threads"), [(1, 1), (20, 1), (20, 2)])
def test_ctrl_c_amid_a_step_of_a_batch_leaves_the_robot_where_it_was(count, threads):
    batch = BatchSolver(LONG, count, len(CROWD), threads=threads)
    for robot in range(count):
        batch.assign(robot, CROWD)
    batch.rest(range(count))
    before = batch.blocks.copy(), batch.statuses.copy(), batch.iterations.copy(), batch.factorizations.copy()
    assert lateness(lambda: batch.step(np.full(count, 25.0))) < 1
    for was, now in zip(before, (batch.blocks, batch.statuses, batch.iterations, batch.factorizations), strict=True):
        assert np.array_equal(was, now)
    batch.step(np.full(count, 0.2))
    solver = Solver(LONG, CROWD)
    assert np.array_equal(batch.blocks, np.tile(solver.step(solver.rest(), 0.2).block, (count, 1)))


def test_ctrl_c_ends_a_long_pull():
    batch = SpatialBatchSolver(SpatialRobot.prototype(model="paper", segments=90), 1, 1)
    batch.assign(0, Scene([Sphere(center=(25, 25, 104), radius=15)]))
    direction = np.array([[1.0, 0.0]])
    assert lateness(lambda: batch.ramp_reaches_force([0], np.array([10.0]), 1e-4, 9.0, direction)) < 1


def test_the_handler_of_a_signal_may_step_the_same_solver():
    """Of a step that is under way, it must not touch the scratch memory."""
    solver, between = Solver(LONG, CROWD), []
    before = signal.signal(signal.SIGUSR1, lambda *_: between.append(solver.step(solver.rest(), 0.2)))
    try:
        with signalled(signal.SIGUSR1, 0.2):
            disturbed = solver.step(solver.rest(), 6.0)
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert len(between) == 1
    assert np.array_equal(disturbed.block, solver.step(solver.rest(), 6.0).block)
    assert np.array_equal(between[0].block, solver.step(solver.rest(), 0.2).block)
