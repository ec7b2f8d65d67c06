"""Custom shapes are measured, and refused where their gap is of no use, on outlines that are fine enough."""

import re
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from solver import Circle, Custom, Ellipse, Family, Robot, Scene, Solver

ELLIPSE = Family.trace(lambda point, sizes: (point[0] / sizes[0]) ** 2 + (point[1] / sizes[1]) ** 2 - 1, sizes=2)


def disc(point):
    return ca.norm_2(point) - 12


def pulled(obstacle):
    solver = Solver(Robot.prototype(model="paper"), Scene([obstacle]))
    equilibrium = solver.rest()
    for cable in np.arange(0.25, 9.01, 0.25):
        equilibrium = solver.step(equilibrium, cable)
        yield equilibrium


# The inner radius and the depth are those of one polygon, which is fine enough for a thin shape.


@pytest.mark.parametrize("radii", [(60, 2), (2, 60), (60, 0.5), (30, 9), (12, 12)])
def test_the_inner_radius_of_a_thin_shape_is_that_of_the_ellipse(radii):
    shape = Custom(family=ELLIPSE, sizes=radii, center=(72, 60), axis=(3, 1), reach=63)
    assert shape.extent.inradius <= min(radii)
    assert shape.extent.inradius == pytest.approx(min(radii), rel=2e-3)
    assert shape.extent.min_curvature_radius == pytest.approx(min(radii) ** 2 / max(radii), rel=1e-3)


def test_a_thin_shape_that_edges_could_lie_across_is_refused():
    thin = Custom(family=ELLIPSE, sizes=(60, 2), center=(72, 60), reach=63)
    for shape in (thin, Ellipse(radii=(60, 2), center=(72, 60))):
        with pytest.raises(ValueError, match=r"has the radius 2 mm; .* give the robot between=2 or more"):
            Solver(Robot.prototype(model="paper"), Scene([shape]))
    Solver(replace(Robot.prototype(model="paper"), between=2), Scene([thin]))


def test_a_shape_with_a_neck_has_the_curvature_of_the_neck():
    """A disc of the radius of curvature fits everywhere in a convex shape, but not in a neck."""
    foci = Family.trace(lambda p, _: ca.norm_2(p - ca.DM([10, 0])) * ca.norm_2(p + ca.DM([10, 0])) - 102)
    assert Custom(family=foci, center=(60, 90), reach=30).extent.min_curvature_radius == pytest.approx(2**0.5)


# The gap is a number wherever points of the robot can be.


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda point, _: ca.exp(10 * disc(point)) - 1, "the gap is not positive and finite"),
        (lambda point, _: ca.tanh(10 * disc(point)), "the gap is not positive and finite"),
        (lambda point, _: disc(point) * (150 - ca.norm_2(point)), "the gap is not positive and finite"),
        (lambda point, _: ca.fmax(disc(point), -1), "the gap is not negative and finite"),
    ],
)
def test_functions_that_are_of_no_use_farther_away_are_refused(function, message):
    shape = Custom(family=Family.trace(function), center=(44, 104), axis=(1, 2), reach=20)
    remedy = rf"{message}.* at the point .*; give a function that grows as the distance does, such as norm_2\(point\)"
    with pytest.raises(ValueError, match=remedy) as refusal:
        Solver(Robot.prototype(model="paper"), Scene([shape]))
    x, y = map(float, re.search(r"\((\S+), (\S+)\)", str(refusal.value)).groups())
    values = shape.measure(np.array([x, y]))
    assert not np.isfinite(values).all() or (values[0] > 0) != (np.hypot(x - 44, y - 104) > 12)


def test_functions_that_overflow_only_far_from_the_robot_are_taken():
    steep = Family.trace(lambda point, _: ca.exp(disc(point) / 2) - 1)
    steep_one, circle = Custom(family=steep, center=(44, 104), reach=20), Circle(center=(44, 104), radius=12)
    for ours, theirs in zip(pulled(steep_one), pulled(circle), strict=True):
        assert np.isfinite(ours.gaps).all()
        assert ours.nodes == pytest.approx(theirs.nodes, abs=1e-6)
    with pytest.raises(ValueError, match="the gap is not positive and finite"):
        Solver(Robot(model="paper", length_mm=1800, segments=200, offset_mm=8), Scene([steep_one]))
