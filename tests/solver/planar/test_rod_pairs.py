"""Opposing cables of the rod that pull against each other."""

import math

import numpy as np
import pytest

from solver import Cable, Circle, Robot, Scene, Solver, Status

PAIR = (Cable(), Cable(angle=math.pi))
ROBOT = Robot.prototype(model="rod", cables=PAIR)
AWAY = Scene([Circle(center=(-80, 60), radius=10)])


def follow(robot, *commands):
    solver = Solver(robot, AWAY)
    states = [solver.rest()]
    for command in commands:
        states.append(solver.step(states[-1], *command))
    return solver, states


@pytest.mark.parametrize("command", [(1.0, 0.0), (0.5, 0.5), (3.0, -1.0)])
def test_a_pair_that_is_too_tight_stalls_at_the_tension_limit(command):
    solver, states = follow(ROBOT, (command,), (command,))
    for state in states[1:]:
        assert state.status is Status.STALLED
        assert state.tensions.max() == pytest.approx(15, rel=1e-6)
        assert state.tensions.min() > 1  # both pull
        assert max(solver.optimality(state)) < 1e-10
    assert states[2].cables_mm == pytest.approx(states[1].cables_mm, abs=1e-9)


def test_a_bent_pair_stalls_where_its_slack_ends_and_lets_go_again():
    _, (_, bent, tight, free) = follow(ROBOT, ((4.0, -4.0),), ((6.0, -3.5),), ((4.0, -4.0),))
    assert tight.status is Status.STALLED
    assert tight.tensions.max() == pytest.approx(15, rel=1e-6)
    assert np.diff(tight.nodes[:, 2]) == pytest.approx(np.full(18, tight.nodes[-1, 2] / 18), abs=1e-7)
    assert free.status is Status.CONVERGED
    assert free.nodes == pytest.approx(bent.nodes, abs=1e-9)
    assert free.tensions == pytest.approx(bent.tensions, rel=1e-8, abs=1e-9)


def test_cables_of_two_sections_stall_together():
    cables = tuple(Cable(angle=angle, end=end) for end in (9, 18) for angle in (0, math.pi))
    _, (_, stalled) = follow(Robot.prototype(model="rod", cables=cables), ((1.0, 1.0, 1.0, 1.0),))
    assert stalled.status is Status.STALLED
    assert stalled.tensions.max() == pytest.approx(15, rel=1e-6)


def test_a_pair_stalls_while_the_base_draws_it_in():
    robot = Robot.prototype(model="rod", cables=PAIR, length_range_mm=(100, 180), length_mm=108)
    solver, (_, _, stalled) = follow(robot, ((0.64, -0.26),), ((0.74, -0.25), 105.0))
    assert stalled.status is Status.STALLED
    assert stalled.tensions.max() == pytest.approx(15, rel=1e-6)
    assert max(solver.optimality(stalled)) < 1e-10


def test_a_pair_of_all_too_strong_motors_buckles_the_robot():
    solver, (_, _, buckled, free) = follow(
        Robot.prototype(model="rod", cables=PAIR, max_tension=math.inf), ((4.0, -4.0),), ((6.0, -3.5),), ((4.0, -4.0),)
    )
    assert buckled.status is Status.SNAPPED
    assert buckled.cables_mm == pytest.approx([6.0, -3.5])
    assert buckled.tensions == pytest.approx(np.full(2, 6 * 5000 / 10**2), rel=0.05)  # 6 EI/l0² each
    assert max(solver.optimality(buckled)) < 1e-9
    assert free.status <= Status.SNAPPED


@pytest.mark.parametrize(
    ("preset", "command"), [("snake_arm", (20.0, -25.0, 5.0, 5.0)), ("neuroendoscope", (0.6, -0.8, 0.2, 0.2))]
)
def test_a_locked_pair_does_not_keep_others_from_being_pulled(preset, command):
    """Only the pair of the tip stalls, however small the steps are."""
    solver = Solver(Robot.preset(preset), Scene())
    small = solver.rest()
    once = solver.step(small, command)
    for part in np.linspace(0.05, 1, 20):
        small = solver.step(small, part * np.array(command))
    assert once.status is small.status is Status.STALLED
    assert small.cables_mm[:2] == pytest.approx(command[:2])
    assert small.nodes == pytest.approx(once.nodes, abs=1e-6 * solver.robot.length_mm)
