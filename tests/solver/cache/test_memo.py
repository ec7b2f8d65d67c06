"""A remembered step is the step."""

import math

import numpy as np
import pytest

from solver import Circle, ReferenceSolver, Robot, Scene, Solver, TransitionMemo
from solver.spatial import SpatialReferenceSolver, SpatialRobot, SpatialSolver, Sphere

CABLES = [0.5 * k for k in range(1, 17)]
SCENES = {
    "plane": Scene([Circle(center=(44, 104), radius=15)]),
    "space": Scene([Sphere(center=(44, 0, 104), radius=15)]),
}


def make_solver(space, **robot):
    if space == "plane":
        return Solver(Robot.prototype(**robot), Scene(list(SCENES[space])))
    return SpatialSolver(SpatialRobot.prototype(**robot), Scene(list(SCENES[space])))


@pytest.fixture(params=SCENES)
def space(request):
    return request.param


@pytest.fixture
def solver(space):
    return make_solver(space)


@pytest.fixture
def command(space):
    """A cable displacement as the solver takes it."""
    return (lambda cable: cable) if space == "plane" else (lambda cable: (cable, 0.25 * cable))


@pytest.fixture
def pull(command):
    def follow(stepper):
        states = [stepper.rest()]
        for cable in CABLES:
            states.append(stepper.step(states[-1], command(cable)))
        return states

    return follow


def test_replay_is_the_same_bits(solver, pull):
    memo = TransitionMemo(solver)
    first, again, alone = pull(memo), pull(memo), pull(solver)
    assert all(a is b for a, b in zip(first, again, strict=True))
    assert all(np.array_equal(a.block, b.block) and a.status is b.status for a, b in zip(first, alone, strict=True))
    assert memo.statistics == (len(CABLES), len(CABLES), len(CABLES), 4096)
    assert first[-1].contact.any()


def test_key_is_the_content(solver, space, pull, command):
    memo = TransitionMemo(solver)
    state = pull(memo)[-1]
    twin = pull(make_solver(space))[-1]
    assert memo.step(twin, command(8.5)) is memo.step(state, command(8.5))
    assert memo.step(state, command(8.25)) is not memo.step(state, command(8.5))


def test_arguments_by_name():
    memo = TransitionMemo(make_solver("plane"))
    assert memo.step(memo.rest(), cable_mm=1.0) is memo.step(memo.rest(), 1.0, length_mm=180.0)
    memo = TransitionMemo(make_solver("space"))
    assert memo.step(memo.rest(), cables_mm=(1, 0)) is memo.step(memo.rest(), np.array([1.0, 0.0]))


def test_least_recently_used_goes_first(solver, command):
    memo, rest = TransitionMemo(solver, capacity=2), solver.rest()
    one, two = memo.step(rest, command(1.0)), memo.step(rest, command(2.0))
    assert memo.step(rest, command(1.0)) is one
    memo.step(rest, command(3.0))
    assert memo.step(rest, command(1.0)) is one
    assert memo.step(rest, command(2.0)) is not two
    assert memo.statistics == (2, 4, 2, 2)
    memo.clear()
    assert memo.statistics == (0, 0, 0, 2)


@pytest.mark.parametrize("cable", [math.nan, 1e9, "3"])
def test_refused_commands_are_not_remembered(solver, command, cable):
    memo = TransitionMemo(solver)
    for _ in range(2):
        with pytest.raises(ValueError, match=r"cables?_mm is"):
            memo.step(solver.rest(), (cable, 0.0) if isinstance(solver, SpatialSolver) else cable)
    assert memo.statistics.size == 0


def test_foreign_states_are_refused_though_their_numbers_are_known(solver, space, command):
    memo = TransitionMemo(solver)
    memo.step(solver.rest(), command(1.0))
    stranger = make_solver(space, max_tension=9.0).rest()
    assert stranger.block.tobytes() == solver.rest().block.tobytes()
    with pytest.raises(ValueError, match="of another robot"):
        memo.step(stranger, command(1.0))


@pytest.mark.parametrize("capacity", [0, -1, 1.5, "many"])
def test_capacity(solver, capacity):
    with pytest.raises(ValueError, match=r"capacity is .* whole number from 1 to"):
        TransitionMemo(solver, capacity)


def test_only_solvers_are_wrapped():
    for stranger in (None, 3, Scene(), Robot.prototype(model="paper")):
        with pytest.raises(TypeError, match=r"it must be a solver: it needs rest\(\), step\(\), check_command\(\)"):
            TransitionMemo(stranger)


@pytest.mark.parametrize("make", [ReferenceSolver, SpatialReferenceSolver])
def test_reference_solvers_are_solvers(make):
    """The reference solvers can be wrapped like the others."""
    robot = Robot.prototype(model="paper") if make is ReferenceSolver else SpatialRobot.prototype(model="paper")
    memo = TransitionMemo(make(robot, Scene()))
    assert memo.rest().status == 0
