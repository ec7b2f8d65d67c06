"""Insertion of both models, and the slack cable of the rod."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Circle, HalfPlane, Robot, Scene, Solver, Status
from solver.common.robot import MODELS

LENGTHS = {"length_mm": 120, "length_range_mm": (60, 200)}
EVERY_MODEL = pytest.mark.parametrize("model", MODELS)


def robot_with(model, **changes):
    return replace(Robot.prototype(model="paper"), **LENGTHS, model=model, **changes)


def inserted(solver, *commands):
    equilibrium = solver.rest()
    for cable, length in commands:
        equilibrium = solver.step(equilibrium, cable, length)
    return equilibrium


@EVERY_MODEL
def test_free_robot_grows_and_shrinks(model):
    solver = Solver(robot_with(model), Scene())
    long, short = inserted(solver, (6.0, 180)), inserted(solver, (6.0, 180), (6.0, 90))
    assert long.length_mm == 180
    assert short.length_mm == 90
    assert short.energy_scale == pytest.approx(2 * long.energy_scale)
    assert np.array_equal(solver.step(short, 0.0, 120).block, solver.rest().block)


@EVERY_MODEL
def test_inserted_past_a_circle(model):
    solver = Solver(robot_with(model), Scene([Circle(center=(42, 120), radius=12)]))
    states = [solver.step(solver.rest(), 6.0, 120)]
    for length in range(122, 190, 2):
        states.append(solver.step(states[-1], 6.0, length))
    assert all(state.status in (Status.CONVERGED, Status.SNAPPED) for state in states)
    assert any(state.contact.any() for state in states)
    for state in states:
        assert max(state.residuals()) < 1e-8


def test_cable_goes_slack_where_the_wall_bends_the_robot_more():
    """A wall ahead that leans to the cable's side shortens the cable's way by itself."""
    wall = HalfPlane(point=(0, 150), normal=(0.3, -1))
    solver = Solver(robot_with("rod"), Scene([wall]))
    slack = inserted(solver, (0.0, 148), (0.0, 180))
    assert slack.status is Status.CONVERGED
    assert slack.tension == 0
    assert slack.slack_mm > 1
    tip = slack.nodes[-1, :2]
    assert wall.gap(tip) == pytest.approx(0, abs=1e-9)
    assert solver.step(slack, slack.slack_mm - 0.01).tension == 0
    assert solver.step(slack, slack.slack_mm + 0.01).tension > 0


def test_cable_holds_where_the_wall_bends_the_robot_the_other_way():
    solver = Solver(robot_with("rod", max_tension=3.0), Scene([HalfPlane(point=(0, 150), normal=(-0.3, -1))]))
    stalled = inserted(solver, (0.0, 148), (0.0, 180))
    assert stalled.status is Status.STALLED
    assert stalled.tension == pytest.approx(3.0, rel=1e-6)
    assert stalled.tension <= 3.0
    assert 148 < stalled.length_mm < 180
    assert solver.step(stalled, 0.0, 148).status is Status.CONVERGED


@EVERY_MODEL
def test_straight_robot_is_blocked_head_on(model):
    """Nothing tells it which way to give."""
    solver = Solver(robot_with(model), Scene([HalfPlane(point=(0, 150), normal=(0, -1))]))
    blocked = inserted(solver, (0.0, 155))
    assert blocked.status is Status.BLOCKED
    assert blocked.length_mm == pytest.approx(150, abs=1e-3)
    assert np.array_equal(solver.step(blocked, 0.0, 120).block, solver.rest().block)


def test_buckled_robot_is_pulled_back_straight():
    solver = Solver(robot_with("rod"), Scene([HalfPlane(point=(0, 150), normal=(0, -1))]))
    buckled = inserted(solver, (3.0, 120), (3.0, 180), (0.0, 180))
    assert buckled.nodes[-1, 0] > 50
    assert np.array_equal(solver.step(buckled, 0.0, 120).block, solver.rest().block)


def test_length_out_of_range_is_refused():
    solver = Solver(robot_with("paper"), Scene())
    for length in (59.9, 200.1, np.nan):
        with pytest.raises(ValueError, match=r"length_mm is .*; it must be from 60 to 200"):
            solver.step(solver.rest(), 1.0, length)
    fixed = Solver(Robot.prototype(model="paper"), Scene())
    with pytest.raises(ValueError, match="it must be from 180 to 180"):
        fixed.step(fixed.rest(), 1.0, 181)


def test_long_insertion_is_not_taken_for_blocked():
    robot = Robot(model="paper", length_mm=100, segments=18, offset_mm=8, length_range_mm=(100, 2000))
    solver = Solver(robot, Scene())
    assert solver.step(solver.rest(), 5.0, 2000).status is Status.CONVERGED
