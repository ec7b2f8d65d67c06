"""The laws the kernel is generated from: derivatives by central differences, and closure of the segments."""

import math

import casadi as ca
import numpy as np
import pytest

from solver import Capsule, Circle, Ellipse, HalfPlane, Polygon, Robot, Solver
from solver.common.gap_laws import gap_function
from solver.planar.formulation import (
    GAP_LAWS,
    arc_function,
    node_problem,
    segment_closure,
    segment_function,
    segment_half_sine,
)

LENGTH, OFFSET = 10.0, 8.0
THETA, SLOPE, CURVATURE, PULL_SLOPE, COS_ZETA, SIN_ZETA, ZETA_SLOPE, ZETA_CURVATURE, COS_THETA, SIN_THETA = range(10)
OBSTACLES = [
    Circle(center=(40, 100), radius=12),
    HalfPlane(point=(-18, 24), normal=(-0.6, 0.8)),
    Ellipse(center=(40, 100), radii=(15, 6), axis=(1, 2)),
    Capsule(start=(35, 95), end=(48, 99), radius=5),
    Polygon(corners=((35, 95), (48, 95), (52, 104), (44, 110)), radius=3),
]
EVERY_OBSTACLE = pytest.mark.parametrize("obstacle", OBSTACLES, ids=[obstacle.kind for obstacle in OBSTACLES])

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


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.2, -0.7, 3.1])
def test_arc(angle):
    """Chord and cable of an arc by their closed forms, derivatives by central differences."""
    function = arc_function()
    law = lambda theta: function(theta, LENGTH).full().ravel()  # noqa: E731
    _, forward, sideways, stretch, stretch_slope, cosine, sine, half_cosine, half_sine, *short = law(angle)
    chord = LENGTH * math.sin(angle / 2) / (angle / 2) if angle else LENGTH
    assert LENGTH * math.hypot(forward, sideways) == pytest.approx(chord, abs=1e-13)
    assert math.atan2(sideways, forward) == pytest.approx(-angle / 2, abs=1e-14)
    assert (cosine, sine) == pytest.approx((math.cos(angle), math.sin(angle)), abs=1e-14)
    assert (half_cosine, half_sine) == pytest.approx((math.cos(angle / 2), math.sin(angle / 2)), abs=1e-14)
    assert LENGTH - short[0] == pytest.approx(chord, abs=1e-13)
    chord_at = lambda theta: np.hypot(*law(theta)[1:3])  # noqa: E731
    assert stretch * chord_at(angle) == pytest.approx(difference(chord_at, angle), abs=1e-8)
    bent = lambda theta: law(theta)[3] * chord_at(theta)  # noqa: E731
    assert stretch_slope * chord_at(angle) == pytest.approx(difference(bent, angle), abs=1e-8)
    assert short[1:] == pytest.approx(difference(law, angle)[9:11], abs=1e-8)


def test_every_law_has_an_obstacle():
    assert tuple(obstacle.law for obstacle in OBSTACLES) == GAP_LAWS


@EVERY_OBSTACLE
@pytest.mark.parametrize("point", [(33.0, 91.0), (41.0, 91.5), (57.0, 104.0), (43.0, 97.0)])
def test_gap_derivatives(obstacle, point):
    function = gap_function(obstacle.law)
    law = lambda p: function(p, obstacle.parameters).full().ravel()  # noqa: E731
    value = law(point)
    assert obstacle.gap(np.array(point)) == pytest.approx(value[0], abs=1e-13)
    assert obstacle.normal_at(np.array(point)) == pytest.approx(value[1:3], abs=1e-13)
    for k, axis in enumerate(np.eye(2)):
        along = difference(lambda s, axis=axis: law(point + s * axis), 0.0, 1e-4)
        assert value[1 + k] == pytest.approx(along[0], abs=1e-7)
        assert value[[3 + k, 4 + k]] == pytest.approx(along[1:3], abs=1e-7)


@EVERY_OBSTACLE
def test_gap_on_the_outline(obstacle):
    """No gap, and a unit slope that points outwards, on the surface; the disc of the extent holds it."""
    outline = obstacle.outline()
    slopes = obstacle.normal_at(outline)
    assert obstacle.gap(outline) == pytest.approx(0, abs=1e-12)
    assert np.linalg.norm(slopes, axis=-1) == pytest.approx(1, abs=1e-12)
    assert obstacle.gap(outline + 0.1 * slopes) == pytest.approx(0.1, abs=0.005)
    center, radius, inradius, min_curvature_radius = obstacle.extent
    assert np.linalg.norm(outline - center, axis=-1).max() <= radius * (1 + 1e-12)
    assert 0 < min_curvature_radius <= radius
    if len(outline) > 1:
        steps = np.linspace(-radius, radius, 101)
        inside = (center + np.stack(np.meshgrid(steps, steps), axis=-1)).reshape(-1, 2)
        inside = inside[obstacle.gap(inside) < 0]
        shares = np.linspace(0, 1, 40)[:, None, None]
        surface = (outline + shares * (np.roll(outline, -1, axis=0) - outline)).reshape(-1, 2)
        depths = [np.linalg.norm(surface - point, axis=-1).min() for point in inside]
        assert inradius == pytest.approx(max(depths), rel=0.05)


@EVERY_OBSTACLE
def test_shifted_obstacle(obstacle):
    points, shift = np.array([(33.0, 91.0), (57.0, 104.0)]), np.array([2.5, -4.0])
    moved = obstacle.shifted(shift)
    assert moved.gap(points + shift) == pytest.approx(obstacle.gap(points), abs=1e-12)
    assert moved.outline() == pytest.approx(obstacle.outline() + shift, abs=1e-12)


def test_node_problem_at_a_solution(circles, pulls):
    robot = Robot.prototype(model="paper")
    scene = circles((44, 104, 15), (70, 140, 10))
    solver, problem = Solver(robot, scene), node_problem(robot, scene.laws, scene.mounted)
    outputs = [problem.objective, problem.equalities, problem.inequalities]
    evaluate = ca.Function("problem", [problem.unknowns, problem.parameters], outputs)
    equilibrium = solver.rest()
    for cable in pulls(8.0, 0.5):
        equilibrium = solver.step(equilibrium, cable)
        unknowns = np.concatenate([equilibrium.nodes[1:, :2].ravel(), equilibrium.cable_nodes[1:].ravel()])
        objective, equalities, gaps = evaluate(
            unknowns, [equilibrium.cable_mm, robot.length_mm, robot.offset_mm, robot.rigidity, *scene.parameters]
        )
        assert float(objective) == pytest.approx(equilibrium.objective, rel=1e-10)
        assert np.abs(equalities.full()).max() < 1e-10
        np.testing.assert_allclose(gaps.full().ravel(), equilibrium.gaps[:, :, 1:].ravel(), atol=1e-9)
    assert equilibrium.contact.any()
