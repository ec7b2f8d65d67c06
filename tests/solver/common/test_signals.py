"""What a handler of a signal raises while CasADi works reaches the caller, and the interrupted object goes on."""

import gc
import os
import signal
import threading
import time

import numpy as np
import pytest

from solver import (
    Circle,
    Custom,
    Family,
    ReferenceBatch,
    ReferenceSolver,
    Robot,
    Scene,
    Solver,
    free_nodes,
    held_signals,
    sensitivity,
)
from solver.planar.formulation import node_derivatives
from solver.spatial import SpatialReferenceSolver, SpatialRobot, Sphere

SCENE = Scene([Circle(center=(40, 100), radius=15)])
PAPER, ROD = (Robot(model=model, length_mm=180, segments=6, offset_mm=8, between=2) for model in ("paper", "rod"))
IN_SPACE = Scene([Sphere(center=(40, 0, 100), radius=15)])
OVAL = Family.trace(lambda point, sizes: (point[0] / sizes[0]) ** 2 + point[1] ** 2 / 400 - 1, sizes=1)
TRIALS, LATEST = 12, 0.03  # of the signal after a call begins [s]


def stepping(solver, command):
    """Return a call whose result is compared, in which CasADi works most of the time."""
    return lambda: solver.step(solver.rest(), command).block


def batch_stepping():
    batch = ReferenceBatch(PAPER, 1, 1)
    batch.assign(0, SCENE)

    def call():
        batch.rest([0])
        batch.step(np.array([4.0]))
        return batch.blocks[0].copy()

    return call


def constructing():
    solvers = []  # no finalizer runs

    def call():
        solvers.append(ReferenceSolver(ROD, SCENE))
        return solvers[-1].rest().block

    return call


def in_space(model):
    robot = SpatialRobot(model=model, length_mm=180, segments=6, offset_mm=8, between=2)
    solver = SpatialReferenceSolver(robot, IN_SPACE)
    return stepping(solver, np.linspace(1.0, 0.0, len(solver.rest().cables_mm)))


def of_an_equilibrium(function):
    solver = Solver(PAPER, SCENE)
    pulled = solver.step(solver.rest(), 7.0)
    return lambda: function(pulled)


def derivatives_of_a_new_scene():
    node_derivatives.cache_clear()
    return of_an_equilibrium(lambda pulled: pulled.residuals())()


CALLS = {
    "paper": lambda: stepping(ReferenceSolver(PAPER, SCENE), 4.0),
    "rod": lambda: stepping(ReferenceSolver(ROD, SCENE), 4.0),
    "paper in space": lambda: in_space("paper"),
    "rod in space": lambda: in_space("rod"),
    "batch": batch_stepping,
    "construction": constructing,
    "derivatives": lambda: derivatives_of_a_new_scene,
    "residuals": lambda: of_an_equilibrium(lambda pulled: pulled.residuals()),
    "sensitivity": lambda: of_an_equilibrium(lambda pulled: sensitivity(pulled).nodes),
    "free": lambda: lambda: free_nodes(ROD, 4.0),
    "gaps of an expression": lambda: (
        lambda: Custom(family=OVAL, sizes=(25,), center=(60, 110), axis=(1, 0), reach=30).gap(np.zeros((500, 2)))
    ),
}


class RaisedError(Exception):
    """Raised by the handler of a signal."""


@pytest.mark.parametrize("name", CALLS)
def test_what_a_handler_raises_amid_a_call_is_not_lost(name):
    call, arrived = CALLS[name](), []
    wanted = call()

    def handle(number, frame):
        arrived.append(number)
        raise RaisedError

    before = signal.signal(signal.SIGALRM, handle)
    random = np.random.default_rng(0)
    gc.collect()
    gc.disable()  # what is raised amid a finalizer, Python itself ignores
    try:
        for _ in range(TRIALS):
            arrived.clear()
            with pytest.raises(RaisedError):  # noqa: PT012 - in whichever call it arrives
                signal.setitimer(signal.ITIMER_REAL, random.uniform(1e-3, LATEST))
                while not arrived:
                    call()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
        gc.enable()
    assert np.array_equal(call(), wanted)


def test_ctrl_c_ends_a_step_of_the_reference_solver():
    solver = ReferenceSolver(PAPER, SCENE)
    threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):  # noqa: PT012 - in whichever step it arrives
        for _ in range(500):
            solver.step(solver.rest(), 4.0)


def test_held_signals_come_once_each_when_the_block_ends_and_handlers_are_back():
    arrived, handle = [], lambda number, frame: arrived.append(number)
    before = {number: signal.signal(number, handle) for number in (signal.SIGUSR1, signal.SIGUSR2)}
    try:
        with held_signals(), held_signals():
            for number in (signal.SIGUSR1, signal.SIGUSR2, signal.SIGUSR1):
                os.kill(os.getpid(), number)
                time.sleep(0.01)
            assert arrived == []
        assert arrived == [signal.SIGUSR1, signal.SIGUSR2]
        assert signal.getsignal(signal.SIGUSR1) is handle
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def test_an_interrupt_wins_over_an_error_of_the_block():
    def fail():
        with held_signals():
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.01)
            raise ValueError("of the block")

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_another_thread_holds_nothing():
    held = []

    def hold():
        with held_signals():
            held.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=hold)
    thread.start()
    thread.join()
    assert held == [signal.default_int_handler]
