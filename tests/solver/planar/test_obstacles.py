"""Obstacles take shapes that make sense and refuse others with one clear error."""

import math

import numpy as np
import pytest

from solver import (
    Capsule,
    Circle,
    Ellipse,
    HalfPlane,
    Polygon,
    Scene,
)


@pytest.mark.parametrize(
    ("center", "radius", "message"),
    [
        ((40.0, 100.0), -1.0, "radius is -1.0; it must be positive and finite"),
        ((40.0, 100.0), math.nan, "radius is nan; it must be positive and finite"),
        ((40.0, math.nan), 10.0, "center is .*nan.*; it must be finite"),
        ((40.0, 100.0, 0.0), 10.0, "center is .*; it must be a pair"),
        ("ab", 10.0, "center is 'ab'; it must be a pair"),
        (40.0, 10.0, "center is 40.0; it must be a pair"),
        ((40.0, True), 10.0, "center is .*; it must be a pair"),
        ((1e155, 89.0), 10.0, "center is .*; it must be finite, at most 1e"),
        ((40.0, 100.0), 9e154, "radius is 9e.*; it must be positive and finite, from 1e-30 to 1e"),
    ],
)
def test_circle(center, radius, message):
    with pytest.raises(ValueError, match=message):
        Circle(center=center, radius=radius)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"normal": (0.0, 0.0)}, r"normal is \(0, 0\)"),
        ({"normal": (math.inf, 0.0)}, "normal is .*; it must be finite"),
        ({"point": (1.0, 2.0, 3.0)}, "point is .*; it must be a pair"),
        ({"nodes": 14}, "nodes is 14; it must be a tuple of node indices"),
        ({"nodes": (1.0,)}, r"nodes is \(1.0,\); it must be a tuple of node indices"),
        ({"nodes": ()}, "nodes is .*; it must name at least one node"),
        ({"nodes": (-1,)}, "nodes is .*; it must name at least one node, each once, from 0"),
        ({"nodes": (3, 3)}, "nodes is .*; it must name at least one node, each once, from 0"),
    ],
)
def test_half_plane(change, message):
    with pytest.raises(ValueError, match=message):
        HalfPlane(**{"point": (30.0, 0.0), "normal": (-1.0, 0.0), **change})


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Ellipse(center=(0, 0), radii=(3, -1)), "a half-axis of radii is -1.0; it must be positive"),
        (lambda: Ellipse(center=(0, 0), radii=(3, 1), axis=(0, 0)), r"axis is \(0, 0\); give the direction"),
        (lambda: Capsule(start=(1, 2), end=(1, 2), radius=1), "must differ"),
        (lambda: Capsule(start=(1, 2), end=(1, 3), radius=0), "radius is 0; it must be positive and finite"),
        (lambda: Polygon(corners=((0, 0), (1, 0)), radius=1), "corners has 2 points; it must have 3 to 8"),
        (lambda: Polygon(corners=((0, 0), (2, 0), (1, 0.5), (1, 2)), radius=1), "once round a convex polygon"),
        (lambda: Polygon(corners=((0, 0), (1, 0), (2, 0), (1, 2)), radius=1), "none straight"),
        (
            lambda: Scene([Circle(center=(40, 0), radius=1)] * 33),
            "obstacles has more than 32 entries; a scene holds at most 32",
        ),
    ],
)
def test_shape(build, message):
    with pytest.raises(ValueError, match=message):
        build()


def test_polygon_in_either_sense():
    corners = ((30, 90), (50, 90), (50, 100), (30, 100))
    assert Polygon(corners=corners, radius=1) == Polygon(corners=corners[::-1], radius=1)
    assert Polygon(corners=corners[::-1], radius=1).gap(np.array([40.0, 80.0])) == pytest.approx(9)


@pytest.mark.parametrize("length", [10**400, math.nan, "180", 0])
def test_a_length_that_is_none_is_refused(length):
    with pytest.raises(ValueError, match=r"length_mm is .*; it must be positive and finite"):
        Circle(center=(40, 100), radius=9).check_proportion(length)
