"""Insertion of both models, and the slack cable of the rod."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Circle, HalfPlane, Polygon, Robot, Scene, Solver, Status
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


def test_straight_rod_is_blocked_head_on():
    """Nothing tells it which way to give."""
    solver = Solver(robot_with("rod"), Scene([HalfPlane(point=(0, 150), normal=(0, -1))]))
    blocked = inserted(solver, (0.0, 155))
    assert blocked.status is Status.BLOCKED
    assert blocked.length_mm == pytest.approx(150, abs=1e-3)
    assert np.array_equal(solver.step(blocked, 0.0, 120).block, solver.rest().block)


def test_slack_robot_of_the_papers_model_gives_way_under_its_pretension():
    solver = Solver(robot_with("paper"), Scene([HalfPlane(point=(0, 150), normal=(0, -1))]))
    bent = inserted(solver, (0.0, 155))
    assert bent.status is Status.CONVERGED
    assert bent.cable_mm == pytest.approx(0.00625 * solver.robot.offset_mm, rel=1e-9)
    assert bent.contact.any()
    assert np.array_equal(solver.step(bent, 0.0, 120).block, solver.rest().block)


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


LEANING = Solver(robot_with("rod", max_tension=3.0), Scene([HalfPlane(point=(0, 150), normal=(-0.3, -1))]))
HOOK = Scene(
    [
        Polygon(
            corners=(
                (57.51723503803011, 137.39315501194704),
                (45.11917989861613, 152.13955544875571),
                (13.620511122285407, 103.38687325177564),
                (46.51415770966395, 103.00524695384452),
                (50.0431976945313, 105.78886072160284),
            ),
            radius=3.128691436001212,
        ),
        Polygon(
            corners=(
                (80.32058648445451, 80.4630650102454),
                (58.924340761514095, 99.65145279038526),
                (32.61100909440414, 85.48181326937757),
            ),
            radius=1.9757435801389605,
        ),
    ]
)
SPIKE = Polygon(
    corners=(
        (30.13910920009754, 70.36151506777406),
        (28.331671109140828, 67.6289157254388),
        (29.996056529327923, 54.28801513716714),
        (38.39112096764678, 49.93479411015187),
    ),
    radius=0.8995823249302476,
)


@pytest.mark.parametrize("steps", [1, 8])
def test_motor_at_its_limit_keeps_its_tension_while_the_base_feeds_the_robot(steps):
    inward = [(3.0, length) for length in np.linspace(145, 155, steps + 1)]
    fed = inserted(LEANING, *inward)
    assert fed.status is Status.STALLED
    assert fed.length_mm == 155
    assert fed.tension == pytest.approx(3.0, rel=1.1e-6)
    assert fed.cable_mm == pytest.approx(inserted(LEANING, *inward[:1], inward[-1]).cable_mm, abs=1e-4)
    assert 0 < fed.cable_mm < 3
    assert max(LEANING.optimality(fed)) < 1e-9
    assert LEANING.step(fed, 3.0, 145).status is Status.CONVERGED


def test_insertion_stalls_where_the_motor_has_let_out_its_cable():
    stalled = inserted(LEANING, (3.0, 145), (3.0, 165))
    assert stalled.status is Status.STALLED
    assert stalled.length_mm == pytest.approx(inserted(LEANING, (0.0, 145), (0.0, 165)).length_mm, rel=1e-6)
    assert stalled.cable_mm == pytest.approx(0, abs=1e-5)
    assert stalled.tension <= 3


def test_robot_with_a_slack_cable_that_is_hooked_on_an_edge_is_blocked():
    """Two neighbouring nodes are on either side of a corner; what they press with grows without bound."""
    solver = Solver(Robot.prototype(length_range_mm=(50, 180)), HOOK)
    way = (8.134959828286334, 90.27077659432766), (1.4054119194250538, 158.57698349255503)
    hooked = inserted(solver, *way, (1.6462053609178031, 82.30950160227808))
    assert hooked.status is Status.BLOCKED
    assert max(solver.optimality(hooked)) < 1e-8
    assert solver.step(hooked, 0.0, 180).status is Status.SNAPPED


def test_cable_that_becomes_taut_at_once_is_let_out_during_an_insertion():
    robot = Robot.prototype(between=2, length_range_mm=(50, 180), touch=("backbone", "cable", "rim"))
    way = (8.458041963895022, 60.88577030932861), (13.968691532921671, 158.2049961850915)
    passed = inserted(Solver(robot, Scene([SPIKE])), *way)
    assert passed.status is Status.SNAPPED
    assert (passed.cable_mm, passed.length_mm) == pytest.approx(way[-1], rel=1e-12)


def test_motor_yields_while_the_base_draws_the_robot_past_a_peak_of_the_tension():
    """Pulled at once, the cable would stall on the way; it arrives after the base has."""
    robot = Robot.prototype(
        length_mm=166.41997150577146, segments=9, length_range_mm=(100, 180), touch=("backbone", "cable", "rim")
    )
    circle = Circle(center=(66.65492141642308, 138.9875896063145), radius=20.842150888808142, spring=28.18725181223074)
    way = (11.171537339649534, 160.3680788378049), (17.213975664383906, 160.22178476711085)
    drawn = inserted(Solver(robot, Scene([circle])), *way)
    assert drawn.status is Status.SNAPPED
    assert (drawn.cable_mm, drawn.length_mm) == pytest.approx(way[-1], rel=1e-12)
