"""A remembered step is the step."""

import math

import numpy as np
import pytest

from solver import Circle, Robot, Scene, Solver
from solver.cache.memo import TransitionMemo

SCENE = Scene([Circle(center=(44, 104), radius=15)])
CABLES = [0.5 * k for k in range(1, 17)]


@pytest.fixture
def solver():
    return Solver(Robot.prototype(), SCENE)


def pull(stepper, cables=CABLES):
    states = [stepper.rest()]
    for cable in cables:
        states.append(stepper.step(states[-1], cable))
    return states


def test_replay_is_the_same_bits(solver):
    memo = TransitionMemo(solver)
    first, again, alone = pull(memo), pull(memo), pull(solver)
    assert all(a is b for a, b in zip(first, again, strict=True))
    assert all(np.array_equal(a.block, b.block) and a.status is b.status for a, b in zip(first, alone, strict=True))
    assert memo.statistics == (len(CABLES), len(CABLES), len(CABLES), 4096)


def test_key_is_the_content(solver):
    memo = TransitionMemo(solver)
    state = pull(memo)[-1]
    twin = pull(Solver(Robot.prototype(), Scene(list(SCENE))))[-1]
    assert memo.step(twin, 8.5) is memo.step(state, 8.5)
    assert memo.step(state, 8.25) is not memo.step(state, 8.5)


def test_least_recently_used_goes_first(solver):
    memo, rest = TransitionMemo(solver, capacity=2), solver.rest()
    one, two = memo.step(rest, 1.0), memo.step(rest, 2.0)
    assert memo.step(rest, 1.0) is one
    memo.step(rest, 3.0)
    assert memo.step(rest, 1.0) is one
    assert memo.step(rest, 2.0) is not two
    assert memo.statistics == (2, 4, 2, 2)
    memo.clear()
    assert memo.statistics == (0, 0, 0, 2)


@pytest.mark.parametrize("command", [-1.0, math.nan, 1e9])
def test_refused_commands_are_not_remembered(solver, command):
    memo = TransitionMemo(solver)
    for _ in range(2):
        with pytest.raises(ValueError, match="cable_mm is"):
            memo.step(solver.rest(), command)
    assert memo.statistics.size == 0


def test_foreign_states_are_refused_though_their_numbers_are_known(solver):
    memo = TransitionMemo(solver)
    memo.step(solver.rest(), 1.0)
    stranger = Solver(Robot.prototype(max_tension=9.0), SCENE).rest()
    assert stranger.block.tobytes() == solver.rest().block.tobytes()
    with pytest.raises(ValueError, match="of another robot"):
        memo.step(stranger, 1.0)


@pytest.mark.parametrize("capacity", [0, -1, 1.5, "many"])
def test_capacity(solver, capacity):
    with pytest.raises(ValueError, match=r"capacity is .* whole number from 1 to"):
        TransitionMemo(solver, capacity)
