"""Cases in the plane that went wrong once, with the values that small steps or a scaled robot give."""

import time
from dataclasses import replace

import numpy as np
import pytest

from solver import Circle, Custom, Ellipse, Family, Polygon, Robot, Scene, Solver, Status

TRIANGLE = ((30, 80), (50, 80), (40, 100))


def walk(solver, commands):
    """States from rest on."""
    states = [solver.rest()]
    for cable in commands:
        states.append(solver.step(states[-1], float(cable)))
    return states


def cost(solver, cable_mm, repeats=20):
    """Least processor time of a step from rest [s]."""
    times = []
    for _ in range(repeats):
        began = time.thread_time()
        solver.step(solver.rest(), cable_mm)
        times.append(time.thread_time() - began)
    return min(times)


# An obstacle hardly wider than the points are apart does not pass between two of them.


@pytest.mark.parametrize("steps", [1, 3, 400])
def test_a_circle_does_not_pass_between_the_points_on_the_way_to_a_far_command(steps):
    solver = Solver(Robot.prototype(model="paper"), Scene([Circle(center=(30.6, 160.8), radius=5.25)]))
    end = walk(solver, np.linspace(0, 11.3, steps + 1)[1:])[-1]
    assert end.status is Status.STALLED
    assert end.cable_mm == pytest.approx(9.81159, abs=1e-4)
    assert end.nodes[-1, :2] == pytest.approx((30.3016, 174.0182), abs=1e-3)
    assert end.contact.sum() == 2


@pytest.mark.parametrize("increment", [0.05, 0.5])
def test_a_circle_at_the_tip_is_rolled_over_and_not_passed_through(increment):
    solver = Solver(Robot.prototype(model="paper"), Scene([Circle(center=(14.2, 173.9), radius=5.5)]))
    states = walk(solver, np.arange(1, round(9 / increment) + 1) * increment)
    halfway = states[len(states) // 2]
    assert halfway.cable_mm == pytest.approx(4.5)
    assert halfway.nodes[-1, :2] == pytest.approx((2.08268, 177.60482), abs=1e-4)
    assert halfway.tension == pytest.approx(2.30879, abs=1e-4)
    assert Status.SNAPPED in {state.status for state in states}
    assert states[-1].cable_mm == pytest.approx(9)
    assert states[-1].nodes[-1, :2] == pytest.approx((91.03820, 144.37545), abs=1e-4)
    assert not states[-1].contact.any()


# A step costs the same whatever the radius of a corner.


def triangle(radius, model="paper"):
    """The prototype before a triangle with corners of a radius [mm]; None where that is refused."""
    try:
        return Solver(
            Robot.prototype(model=model, between=2 if model == "rod" else 0),
            Scene([Polygon(corners=TRIANGLE, radius=radius)]),
        )
    except ValueError:
        return None


def trace(solver):
    """Shapes accepted on the way of a step from rest to 12 mm."""
    return solver.trace(solver.rest(), 12.0).nodes


MODELS = pytest.mark.parametrize("model", ["paper", "rod"])


@MODELS
def test_a_sharp_corner_costs_no_more_than_a_round_one(model):
    solvers = [triangle(10.0**-power, model) for power in range(1, 16)]
    assert None in solvers
    round_one, sharp_one = solvers[0], solvers[solvers.index(None) - 1]
    assert sharp_one.step(sharp_one.rest(), 12.0).status is Status.CONVERGED
    assert len(trace(sharp_one)) <= 3 * len(trace(round_one))
    assert cost(sharp_one, 12.0) <= 3 * cost(round_one, 12.0)


@MODELS
@pytest.mark.parametrize("radius", [1e-3, 1e-4])
def test_a_corner_costs_no_more_than_a_round_one(radius, model):
    assert cost(triangle(radius, model), 12.0) <= 3 * cost(triangle(0.1, model), 12.0)


@MODELS
def test_the_end_of_a_long_ellipse_costs_no_more_than_that_of_a_short_one(model):
    short, long = (Scene([Ellipse(center=(55, 90), radii=(half, 10), axis=(0, 1))]) for half in (1e2, 1e4))
    short_one, long_one = (
        cost(Solver(Robot.prototype(model=model), scene), 12.0, repeats=8) for scene in (short, long)
    )
    assert long_one <= 3 * short_one


# Which of two neighbouring points meets a narrow obstacle does not depend on the size of the steps.

NARROW = {
    "a circle as wide as the spacing": (
        Scene([Circle(center=(67.08390469177479, 107.55520394444945), radius=5.023)]),
        11.951,
    ),
    "a circle before the tip": (
        Scene([Circle(center=(84.39787994466772, 141.13877312057804), radius=5.546074491884627)]),
        8.378,
    ),
    "a circle near the cable": (Scene([Circle(center=(105.30622805819056, 118.08786592472427), radius=5.623)]), 11.735),
    "a circle inside a triangle": (
        Scene(
            [
                Polygon(corners=((50.13, 107.127), (33.146, 112.835), (39.128, 88.592)), radius=0.10507),
                Circle(center=(40.838, 98.444), radius=5.518),
            ]
        ),
        6.77,
    ),
}


@pytest.mark.parametrize(("scene", "cable"), NARROW.values(), ids=NARROW)
def test_large_steps_end_where_small_ones_do(scene, cable):
    solver = Solver(Robot.prototype(model="paper"), scene)
    small = walk(solver, np.linspace(0, cable, 401)[1:])
    assert {state.status for state in small} == {Status.CONVERGED}
    for steps in (1, 2, 5, 12, 25, 50):
        end = walk(solver, np.linspace(0, cable, steps + 1)[1:])[-1]
        assert end.nodes == pytest.approx(small[-1].nodes, abs=1e-6)


# No tolerance is a number of millimetres.


@pytest.mark.parametrize("increment", [0.25, 2.0])
@pytest.mark.parametrize("s", [0.02, 0.18, 1.0, 10.0])
def test_a_snake_arm_slips_off_its_circle_whatever_its_size(s, increment):
    robot = Robot(
        model="paper", length_mm=1000 * s, segments=40, offset_mm=40 * s, rigidity=1e6 * s * s, max_tension=200
    )
    solver = Solver(robot, Scene([Circle(center=(279 * s, 890 * s), radius=78 * s)]))
    states = walk(solver, s * increment * np.arange(1, round(56 / increment) + 1))
    assert {state.status for state in states} == {Status.CONVERGED, Status.SNAPPED}
    assert states[-1].cable_mm / s == pytest.approx(56)
    assert states[-1].tension == pytest.approx(35.007148, abs=1e-4)
    assert states[-1].nodes[-1, :2] / s == pytest.approx((592.93092, 703.90134), abs=1e-3)


# The tension never exceeds its limit, at any point of a step.


@pytest.mark.parametrize("increment", [0.02, 0.1, 0.5, 1.5, 9.5])
def test_a_motor_stalls_before_the_peak_of_the_tension_and_not_behind_it(increment):
    """Between 9.0 and 9.5 mm the tension rises to 7.790 N and falls again to 7.715 N."""
    robot = replace(Robot.prototype(model="paper"), model="rod", max_tension=7.78, between=1)
    braced = Circle(center=(38.489, 73.892), radius=8.132), Circle(center=(65.664, 156.712), radius=12.853)
    solver = Solver(robot, Scene(braced))
    commands = np.minimum(np.arange(1, np.ceil(9.5 / increment) + 1) * increment, 9.5)
    end = walk(solver, commands)[-1]
    assert end.status is Status.STALLED
    assert end.tension == pytest.approx(7.78, rel=1e-6)
    assert end.tension <= 7.78
    assert end.cable_mm == pytest.approx(9.08929, abs=1e-3)


# Neighbouring disks do not pass through each other, and what is called converged is.


def test_disks_of_a_strongly_bent_robot_meet_and_the_certificate_holds():
    robot = Robot(length_mm=180, segments=18, offset_mm=25, model="rod")
    solver = Solver(robot, Scene([Circle(center=(70, 71), radius=14), Circle(center=(60, 117), radius=11)]))
    states = walk(solver, np.arange(1, 69))
    assert states[60].cable_mm == pytest.approx(60)
    assert states[60].tension == pytest.approx(6.286, abs=1e-3)
    for state in states:
        turns = np.abs(np.diff(state.nodes[:, 2]))
        assert turns.max() <= robot.segment_mm / robot.offset_mm * (1 + 1e-9)
        assert abs(state.slack_mm) <= 1e-9 * robot.length_mm
        residuals = state.residuals()
        assert residuals.stationarity * robot.length_mm <= 1e-7
        assert residuals.gaps / robot.length_mm <= 1e-9
        assert residuals.complementarity <= 1e-7
        assert residuals.sign == 0


# An obstacle is refused where the sweep, which takes depths from an inscribed polygon, sees no core in it.


def test_obstacles_just_above_the_least_size_are_refused_or_not_passed_through():
    disc = Family.trace(lambda point, sizes: point[0] ** 2 + point[1] ** 2 - sizes[0] ** 2, sizes=1)
    taken = []
    for radius in 5 + np.array([1e-3, 2.6e-3, 2.8e-3, 3e-3, 5e-3]):
        place = {"center": (12.4, 144.3)}
        circle = Solver(Robot.prototype(model="paper"), Scene([Circle(radius=radius, **place)]))
        right = circle.step(circle.rest(), 14.0)
        assert right.status is Status.STALLED
        for shape in (
            Ellipse(radii=(radius, radius), **place),
            Custom(family=disc, sizes=(radius,), reach=6, **place),
        ):
            try:
                solver = Solver(Robot.prototype(model="paper"), Scene([shape]))
            except ValueError:
                continue
            end = solver.step(solver.rest(), 14.0)
            taken.append(shape)
            assert end.status is Status.STALLED
            assert end.cable_mm == pytest.approx(right.cable_mm, abs=1e-2)
    assert 2 <= len(taken) <= 8
