"""Disks that meet where the cable slides: the law of their gap, its multipliers, and the certificate with them."""

import itertools
import math

import casadi as ca
import numpy as np
import pytest

from solver import Circle, ReferenceSolver, Robot, Scene, Solver, Status, sensitivity
from solver.planar.forces import force_true
from solver.planar.formulation import disk_gap_function, node_problem, robot_inequality_count

CIRCLE = Circle(center=(42, 143), radius=28)
SIZES = pytest.mark.parametrize(("length", "radius", "thickness"), [(10, 8, 0), (15, 60, 0), (15, 40, 2), (10, 25, 3)])
# Disks wider than the cable's offset, thin and thick, and the pulls [mm] where the first two of them meet.
ROBOTS = pytest.mark.parametrize(
    ("radius", "thickness", "before", "after", "most"), [(60.0, 0.0, 7.5, 8.0, 11.5), (40.0, 2.0, 9.0, 9.5, 16.0)]
)


def make_robot(radius, thickness):
    return Robot(
        length_mm=180,
        segments=12,
        offset_mm=8,
        model="rod",
        max_tension=1000,
        between=2,
        disk_radius_mm=radius,
        disk_thickness_mm=thickness,
    )


def pulled(solver, most):
    """States from rest on, 0.5 mm apart."""
    states = [solver.rest()]
    for cable in np.arange(1, round(2 * most) + 1) / 2:
        states.append(solver.step(states[-1], float(cable)))
    return states


def natural(equilibrium):
    """The certificate without units: lengths over L, slopes times L."""
    length, residuals = equilibrium.length_mm, equilibrium.residuals()
    return (
        residuals.stationarity * length,
        residuals.lengths / length,
        residuals.gaps / length,
        residuals.complementarity,
        residuals.sign * length,
    )


@SIZES
@pytest.mark.parametrize("angle", [-0.6, 0.0, 1e-9, 0.2, 0.7, 2.9])
def test_derivatives_of_the_law(angle, length, radius, thickness):
    function, step = disk_gap_function(), 1e-5
    law = lambda theta: function(theta, length, radius, thickness).full().ravel()  # noqa: E731
    slopes = (law(angle + step) - law(angle - step)) / (2 * step)
    assert law(angle)[1:] == pytest.approx(slopes[:2], abs=1e-8)


@SIZES
@pytest.mark.parametrize("angle", [-0.6, 0.0, 0.1, 0.4, 2.9])
def test_the_law_is_the_distance_between_the_faces_of_two_disks_at_their_edges(angle, length, radius, thickness):
    """The segment is an arc from the origin along +x that bends to the left, where the edges come closer."""
    end = (length, 0.0)
    if angle:
        end = length / angle * np.array([math.sin(angle), 1 - math.cos(angle)])
    ahead, aside = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    lower = np.array([thickness / 2, radius])
    upper = end + radius * aside - thickness / 2 * ahead
    between = upper - lower
    bisector = np.array([math.cos(angle / 2), math.sin(angle / 2)])
    gap = float(disk_gap_function()(angle, length, radius, thickness)[0])
    assert gap == pytest.approx(between @ bisector, abs=1e-12)
    assert abs(gap) == pytest.approx(np.linalg.norm(between), abs=1e-12)


@pytest.mark.parametrize(("length", "radius"), [(10, 8), (15, 60)])
def test_disks_without_thickness_meet_where_the_arc_turns_about_their_edge(length, radius):
    assert float(disk_gap_function()(length / radius, length, radius, 0)[0]) == pytest.approx(0, abs=1e-14)


@ROBOTS
def test_gaps_of_the_node_problem_are_those_of_the_law(radius, thickness, before, after, most):
    robot, scene = make_robot(radius, thickness), Scene([CIRCLE])
    problem = node_problem(robot, scene.laws, scene.mounted)
    gaps = ca.Function("gaps", [problem.unknowns, problem.parameters], [problem.inequalities])
    equilibrium = pulled(Solver(robot, scene), most)[-1]
    unknowns, parameters, _, multipliers = equilibrium.node_solution()
    values, turns = gaps(unknowns, parameters).full().ravel(), -np.diff(equilibrium.nodes[:, 2])
    law = disk_gap_function().map(robot.segments)
    expected = [law(side * turns, robot.segment_mm, radius, thickness)[0, :].full().ravel() for side in (1, -1)]
    assert robot_inequality_count(robot) == 1 + 2 * robot.segments
    assert values.size == multipliers.size
    assert values[1 : robot_inequality_count(robot)] == pytest.approx(np.concatenate(expected), abs=1e-10)
    assert values[robot_inequality_count(robot) :] == pytest.approx(equilibrium.gaps[:, :, 1:].ravel(), abs=1e-9)
    meeting = multipliers[1 : robot_inequality_count(robot)] > 0
    assert values[1 : robot_inequality_count(robot)][meeting] == pytest.approx(0, abs=1e-9)
    assert meeting.any()


@ROBOTS
def test_a_robot_pulled_on_bends_until_its_disks_meet(radius, thickness, before, after, most):
    """On the cable's side first, at the end also on the other one, near the base, which the circle pushes back."""
    robot = make_robot(radius, thickness)
    solver = Solver(robot, Scene([CIRCLE]))
    law = disk_gap_function().map(robot.segments)
    states = pulled(solver, most)
    for state in states:
        assert state.status is Status.CONVERGED
        assert max(natural(state)) <= 1e-8
        assert max(solver.optimality(state)) <= 1e-8
        turns = -np.diff(state.nodes[:, 2])
        gaps = law(np.abs(turns), robot.segment_mm, radius, thickness)[0, :].full().ravel()
        meet = state.disk_multipliers != 0
        assert gaps.min() >= -1e-12 * robot.length_mm
        assert gaps[meet] == pytest.approx(0, abs=1e-11 * robot.length_mm)
        assert (np.sign(state.disk_multipliers) == np.where(meet, np.sign(turns), 0)).all()
        assert meet.any() == (state.cable_mm >= after)
    assert states[-1].disk_multipliers.max() > 0
    assert states[-1].disk_multipliers.min() < 0


@ROBOTS
def test_the_reference_solver_finds_the_same_where_disks_meet(radius, thickness, before, after, most):
    robot, scene = make_robot(radius, thickness), Scene([CIRCLE])
    reference, states = ReferenceSolver(robot, scene), pulled(Solver(robot, scene), most)
    for state, following in itertools.islice(itertools.pairwise(states), round(2 * before) - 1, None, 2):
        same = reference.step(state, following.cable_mm)
        assert same.status is Status.CONVERGED
        assert same.nodes == pytest.approx(following.nodes, abs=1e-6)
        assert same.tension == pytest.approx(following.tension, rel=1e-8)
        assert same.disk_multipliers == pytest.approx(following.disk_multipliers, rel=1e-6, abs=1e-9)
        assert max(natural(same)) <= 1e-6


@ROBOTS
def test_sensitivities_hold_the_disks_that_meet(radius, thickness, before, after, most):
    solver, step = Solver(make_robot(radius, thickness), Scene([CIRCLE])), 1e-4
    start = pulled(solver, most - 0.5)[-1]
    behind, here, ahead = (solver.step(start, most - 0.2 + change) for change in (-step, 0, step))
    assert (here.disk_multipliers > 0).any()
    assert (here.disk_multipliers < 0).any()
    assert np.array_equal(np.sign(ahead.disk_multipliers), np.sign(behind.disk_multipliers))
    slopes = sensitivity(here)
    assert slopes.nodes[0] == pytest.approx((ahead.nodes - behind.nodes) / (2 * step), rel=1e-5, abs=1e-5)
    assert slopes.tension[0] == pytest.approx((ahead.tension - behind.tension) / (2 * step), rel=1e-5)
    assert slopes.forces[0] == pytest.approx((force_true(ahead) - force_true(behind)) / (2 * step), rel=1e-5)


def test_a_cable_that_shears_its_segments_has_no_disks_that_meet():
    robot = Robot.prototype(model="paper")
    assert robot_inequality_count(robot) == 0
    assert Solver(robot, Scene()).rest().disk_multipliers.size == 0


@pytest.mark.parametrize(("field", "value"), [("disk_radius_mm", 0.0), ("disk_thickness_mm", 9.5)])
def test_disks_that_cannot_be(field, value):
    with pytest.raises(ValueError, match=rf"{field} is {value}; it must be from"):
        Robot(length_mm=180, segments=18, offset_mm=8, model="rod", **{field: value})
