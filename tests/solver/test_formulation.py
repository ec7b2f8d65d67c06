"""The laws the kernel is generated from: derivatives by central differences, and closure of the segments."""

import math

import casadi as ca
import numpy as np
import pytest

from solver import Robot, Solver
from solver.formulation import (
    GAP_LAWS,
    gap_function,
    node_problem,
    segment_closure,
    segment_function,
    segment_half_sine,
)

LENGTH, OFFSET = 10.0, 8.0
THETA, SLOPE, CURVATURE, PULL_SLOPE, COS_ZETA, SIN_ZETA, ZETA_SLOPE, ZETA_CURVATURE, COS_THETA, SIN_THETA = range(10)
SHAPES = {"circle": [40.0, 100.0, 12.0], "half_plane": [-0.6, 0.8, 30.0]}

segments = pytest.mark.parametrize(("sine", "pull"), [(0.0, 0.3), (0.2, 0.05), (-0.35, 0.7), (0.5, 1.2)])


@pytest.fixture(scope="module")
def law():
    function = segment_function()
    return lambda sine, pull: function(sine, pull, LENGTH, OFFSET).full().ravel()


def difference(function, at, step=1e-5):
    return (function(at + step) - function(at - step)) / (2 * step)


@segments
def test_segment_derivatives(law, sine, pull):
    value = law(sine, pull)
    in_sine = difference(lambda s: law(s, pull), sine)
    in_pull = difference(lambda p: law(sine, p), pull)
    zeta = math.atan2(value[SIN_ZETA], value[COS_ZETA])
    assert zeta == pytest.approx(math.asin(sine) - value[THETA] / 2, abs=1e-14)
    assert value[SLOPE] == pytest.approx(in_sine[THETA], abs=1e-8)
    assert value[CURVATURE] == pytest.approx(in_sine[SLOPE], abs=1e-8)
    assert value[PULL_SLOPE] == pytest.approx(in_pull[THETA], abs=1e-8)
    assert value[ZETA_SLOPE] * value[COS_ZETA] == pytest.approx(in_sine[SIN_ZETA], abs=1e-8)
    assert value[ZETA_CURVATURE] == pytest.approx(in_sine[ZETA_SLOPE], abs=1e-7)
    assert value[[COS_THETA, SIN_THETA]] == pytest.approx([math.cos(value[THETA]), math.sin(value[THETA])], abs=1e-14)


@segments
def test_closure_vanishes_at_the_half_sine(law, sine, pull):
    at = [ca.DM(v) for v in (sine, pull, LENGTH, OFFSET)]
    half_sine = segment_half_sine(*at)
    assert float(segment_closure(half_sine, *at)) == pytest.approx(0, abs=1e-12)
    assert 2 * math.asin(float(half_sine)) == pytest.approx(law(sine, pull)[THETA], abs=1e-14)


@pytest.mark.parametrize("kind", GAP_LAWS)
def test_gap_derivatives(kind):
    function, shape, point = gap_function(kind), SHAPES[kind], np.array([33.0, 91.0])
    law = lambda p: function(p, shape).full().ravel()  # noqa: E731
    value = law(point)
    for k, axis in enumerate(np.eye(2)):
        along = difference(lambda s, axis=axis: law(point + s * axis), 0.0, 1e-4)
        assert value[1 + k] == pytest.approx(along[0], abs=1e-8)
        assert value[[3 + k, 4 + k]] == pytest.approx(along[1:3], abs=1e-8)


@pytest.mark.parametrize("kind", GAP_LAWS)
def test_gap_has_a_unit_slope_on_the_surface(kind):
    surface = {"circle": (40 + 12 * math.cos(1), 100 + 12 * math.sin(1)), "half_plane": (-18.0, 24.0)}[kind]
    value = gap_function(kind)(surface, SHAPES[kind]).full().ravel()
    assert value[0] == pytest.approx(0, abs=1e-12)
    assert math.hypot(value[1], value[2]) == pytest.approx(1, abs=1e-12)


def test_node_problem_at_a_solution(circles, pulls):
    robot = Robot.prototype()
    scene = circles((44, 104, 15), (70, 140, 10))
    solver, problem = Solver(robot, scene), node_problem(robot.segments, scene.kinds)
    outputs = [problem.objective, problem.equalities, problem.gaps]
    evaluate = ca.Function("problem", [problem.unknowns, problem.parameters], outputs)
    equilibrium = solver.rest()
    for cable in pulls(8.0, 0.5):
        equilibrium = solver.step(equilibrium, cable)
        unknowns = np.concatenate([equilibrium.nodes[1:, :2].ravel(), equilibrium.cable_nodes[1:].ravel()])
        shapes = [v for obstacle in scene for v in obstacle.parameters]
        objective, equalities, gaps = evaluate(
            unknowns, [equilibrium.cable_mm, robot.length_mm, robot.offset_mm, *shapes]
        )
        assert float(objective) == pytest.approx(equilibrium.objective, rel=1e-10)
        assert np.abs(equalities.full()).max() < 1e-10
        np.testing.assert_allclose(gaps.full().ravel(), equilibrium.gaps[:, :, 1:].ravel(), atol=1e-9)
    assert equilibrium.contact.any()
