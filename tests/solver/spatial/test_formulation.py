"""The generated laws of a segment in space against central differences, and those of its obstacles."""

import math

import casadi as ca
import numpy as np
import pytest

from solver.spatial import Box, Capsule, Cylinder, HalfSpace, Sphere
from solver.spatial.formulation import bend_function, closure_function, hessian_contraction_function, square_angle

A, LENGTH = 8.0, 10.0
HOLES = np.array([[A, -A * math.sin(0.3)], [0.0, A * math.cos(0.3)]])
CLOSURE, BEND, HESSIAN_CONTRACTION = closure_function(), bend_function(), hessian_contraction_function()
STEP = 1e-6


def bend(control, pulls):
    bending = np.zeros(2)
    for _ in range(10):
        law = CLOSURE(control, bending, pulls, LENGTH, HOLES).full().ravel()
        bending -= np.linalg.solve(law[2:].reshape(2, 2), law[:2])
    return bending, BEND(control, bending, pulls, LENGTH, HOLES).full().ravel()


def turn_between(before, after):
    """Rotation vector from one matrix to another, small."""
    twisted = after @ before.T
    return np.array([twisted[2, 1] - twisted[1, 2], twisted[0, 2] - twisted[2, 0], twisted[1, 0] - twisted[0, 1]]) / 2


def differences(function, at):
    """Central differences of the objective, the chord and the turn of the upper disk."""
    slopes = []
    for direction in STEP * np.eye(len(at)):
        (_, high), (_, low) = function(at + direction), function(at - direction)
        turn = turn_between(low[3:12].reshape(3, 3), high[3:12].reshape(3, 3))
        slopes.append(np.r_[high[12] - low[12], high[:3] - low[:3], turn] / (2 * STEP))
    return np.array(slopes).T


@pytest.fixture(name="segment", params=range(5))
def segment_fixture(request):
    generator = np.random.default_rng(request.param)
    return generator.uniform(-0.3, 0.3, 3), generator.uniform(0.1, 0.8, 2)


def test_lengths(segment):
    """Backbone and cables have the lengths they are given, wherever the disks are."""
    control, pulls = segment
    _, law = bend(control, pulls)
    chord, rotation = law[:3], law[3:12].reshape(3, 3)
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.norm(chord) == pytest.approx(LENGTH, abs=1e-13)
    holes = np.vstack([HOLES, np.zeros((1, 2))])
    ways = chord[:, None] + rotation @ holes - holes
    assert np.linalg.norm(ways, axis=0) == pytest.approx(LENGTH - pulls, abs=1e-13)
    angles = np.arccos(np.sum(holes * (rotation @ holes), axis=0) / A**2)
    assert law[12] == pytest.approx(np.sum(angles**2), abs=1e-13)


def test_slopes(segment):
    control, pulls = segment
    _, law = bend(control, pulls)
    in_control = differences(lambda at: bend(at, pulls), control)
    assert law[13:34].reshape(7, 3) == pytest.approx(in_control, abs=1e-8)
    in_pulls = differences(lambda at: bend(control, at), pulls)
    assert law[34:48].reshape(7, 2) == pytest.approx(in_pulls, abs=1e-8)


def test_curvature(segment):
    """Of the objective and the work on the chord; the turn is counted from the disk's present place."""
    control, pulls = segment
    force, moment = np.array([0.3, -0.2, 0.5]), np.array([0.7, 0.4, -0.6])
    bending, middle = bend(control, pulls)
    curvature = HESSIAN_CONTRACTION(control, bending, pulls, LENGTH, HOLES, force, moment).full().reshape(3, 3)

    def work(at):
        _, law = bend(at, pulls)
        return law[12] + force @ law[:3] + moment @ turn_between(middle[3:12].reshape(3, 3), law[3:12].reshape(3, 3))

    step = 1e-4
    found = np.zeros((3, 3))
    for i, a in enumerate(step * np.eye(3)):
        for j, b in enumerate(step * np.eye(3)):
            corners = work(control + a + b) - work(control + a - b) - work(control - a + b) + work(control - a - b)
            found[i, j] = corners / (4 * step**2)
    assert curvature == pytest.approx(found, abs=2e-6)


@pytest.mark.parametrize("angle", [1e-6, 1e-2, 0.3, 1.0, 1.5])
def test_square_of_an_angle(angle):
    square = ca.SX.sym("square")
    law = ca.Function("law", [square], list(square_angle(square)))
    value, slope, curvature = (float(part) for part in law(math.sin(angle / 2) ** 2))
    assert value == pytest.approx(angle**2, rel=1e-14)
    assert slope == pytest.approx(4 * angle / math.sin(angle), rel=1e-14)
    if angle > 0.1:
        bent = 8 * (math.sin(angle) - angle * math.cos(angle)) / math.sin(angle) ** 3
        assert curvature == pytest.approx(bent, rel=1e-10)


OBSTACLES = [
    Sphere(center=(40, 18, 104), radius=15),
    HalfSpace(point=(40, 0, 100), normal=(-1, 0.3, 0.1)),
    Capsule(start=(30, 20, 100), end=(50, -20, 90), radius=9),
    Cylinder(start=(30, 20, 100), end=(50, -20, 90), radius=9, edge=3),
    Box(center=(40, 5, 100), sizes=(20, 30, 16), edge=3, axis=(1, 1, 0), second=(0, 0, 1)),
]


@pytest.mark.parametrize("obstacle", OBSTACLES, ids=lambda obstacle: obstacle.kind)
def test_gap(obstacle):
    """On the surface the gap vanishes and its slope is a unit vector; elsewhere it is that of central differences."""
    generator = np.random.default_rng(0)
    center, radius = np.array(obstacle.extent.center), min(obstacle.extent.radius, 30)
    points = center + generator.normal(size=(200, 3)) * radius
    points = points[obstacle.gap(points) > 0]
    steps = STEP * np.eye(3)
    slopes = np.stack([obstacle.gap(points + step) - obstacle.gap(points - step) for step in steps], axis=1) / (
        2 * STEP
    )
    assert obstacle.normal_at(points) == pytest.approx(slopes, abs=1e-7)
    surface = points
    for _ in range(30):
        slope = obstacle.normal_at(surface)
        surface = surface - (obstacle.gap(surface) / np.sum(slope**2, axis=1))[:, None] * slope
    assert obstacle.gap(surface) == pytest.approx(0, abs=1e-9)
    assert np.linalg.norm(obstacle.normal_at(surface), axis=1) == pytest.approx(1, abs=1e-9)
    shift = np.array([3.0, -2.0, 1.0])
    assert obstacle.shifted(shift).gap(points + shift) == pytest.approx(obstacle.gap(points), abs=1e-10)
    if math.isfinite(obstacle.extent.radius):
        assert np.linalg.norm(surface - center, axis=1).max() <= obstacle.extent.radius + 1e-9


@pytest.mark.parametrize("obstacle", OBSTACLES, ids=lambda obstacle: obstacle.kind)
def test_outline(obstacle):
    """Its points lie on the surface, but for rounded edges, which are drawn sharp."""
    outline = obstacle.outline()
    assert outline.ndim == 3
    assert outline.shape[-1] == 3
    gaps = obstacle.gap(outline)
    assert gaps.min() > -1e-9 or obstacle.kind in ("cylinder", "box")
    edge = getattr(obstacle, "edge", 0.0)
    assert gaps.max() <= edge * (math.sqrt(3) - 1) + 1e-9


def test_the_outline_of_a_wall_grows_with_its_distance():
    corners = {s: HalfSpace(point=(30.0 * s, 0.0, 40.0 * s), normal=(-1, 0, 0)).outline() for s in (1.0, 4.0)}
    assert np.ptp(corners[1.0], axis=(0, 1)) == pytest.approx([0, 100, 100])
    assert corners[4.0] == pytest.approx(4 * corners[1.0])
