"""Bad input gives one clear error and leaves everything as it was."""

import math

import numpy as np
import pytest

from solver import Capsule, Circle, Ellipse, HalfPlane, Polygon, Robot, Scene, Solver

PROTOTYPE = {"length_mm": 180.0, "segments": 18, "offset_mm": 8.0}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"length_mm": -180.0}, "length_mm is -180.0; it must be positive and finite"),
        ({"length_mm": math.nan}, "length_mm is nan; it must be positive and finite"),
        ({"offset_mm": 0.0}, "offset_mm is 0.0; it must be positive and finite"),
        ({"rigidity": math.inf}, "rigidity is inf; it must be positive and finite"),
        ({"max_tension": 0.0}, "max_tension is 0.0; it must be positive"),
        ({"max_tension": math.nan}, "max_tension is nan; it must be positive"),
        ({"segments": 1}, "segments is 1; it must be a whole number from 2 to 4096"),
        ({"segments": 18.0}, "segments is 18.0; it must be a whole number from 2 to 4096"),
        ({"max_cable_mm": -1.0}, "max_cable_mm is -1.0; it must be positive and finite"),
        ({"max_cable_mm": 200.0}, "max_cable_mm is 200.0; it must be below 180.0"),
        ({"max_cable_mm": 110.0, "length_range_mm": (100, 200)}, "max_cable_mm is 110.0; it must be below 100.0"),
        ({"cable": "slack"}, "cable is 'slack'; it must be one of uniform, sliding"),
        ({"length_range_mm": (0, 200)}, "a bound of length_range_mm is 0; it must be positive and finite"),
        ({"length_range_mm": (190, 200)}, r"length_mm is 180.0; it must lie in length_range_mm \(190.0, 200.0\)"),
    ],
)
def test_robot(change, message):
    with pytest.raises(ValueError, match=message):
        Robot(**{**PROTOTYPE, **change})


@pytest.mark.parametrize(
    ("center", "radius", "message"),
    [
        ((40.0, 100.0), -1.0, "radius is -1.0; it must be positive and finite"),
        ((40.0, 100.0), math.nan, "radius is nan; it must be positive and finite"),
        ((40.0, math.nan), 10.0, "center is .*nan.*; it must be finite"),
        ((40.0, 100.0, 0.0), 10.0, "center is .*; it must be a pair"),
        ("ab", 10.0, "center is 'ab'; it must be a pair"),
        (40.0, 10.0, "center is 40.0; it must be a pair"),
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
        ({"nodes": ()}, "nodes is .*; it must name at least one node"),
        ({"nodes": (-1,)}, "nodes is .*; it must name at least one node, each once, from 0"),
        ({"nodes": (3, 3)}, "nodes is .*; it must name at least one node, each once, from 0"),
    ],
)
def test_half_plane(change, message):
    with pytest.raises(ValueError, match=message):
        HalfPlane(**{"point": (30.0, 0.0), "normal": (-1.0, 0.0), **change})


def test_scene():
    with pytest.raises(TypeError, match="is not an obstacle; give a Circle, HalfPlane"):
        Scene([(40.0, 100.0, 10.0)])


@pytest.mark.parametrize(
    ("obstacle", "message"),
    [
        (
            Circle(center=(10, 80), radius=12),
            r"Circle\(.*center=\(10.0, 80.0\), radius=12.0\) overlaps the straight robot by .* mm at node",
        ),
        (HalfPlane(point=(7, 0), normal=(-1, 0)), "HalfPlane.* overlaps the straight robot by 1 mm"),
        (
            HalfPlane(point=(30, 0), normal=(-1, 0), nodes=(19,)),
            "HalfPlane names node 19; the robot's nodes are 0 to 18",
        ),
    ],
)
def test_obstacle_of_a_solver(obstacle, message):
    with pytest.raises(ValueError, match=message):
        Solver(Robot.prototype(), Scene([obstacle]))


@pytest.mark.parametrize("step", ["step", "trace"])
@pytest.mark.parametrize("cable", [-0.1, 25.2, math.nan, math.inf])
def test_command(cable, step):
    solver = Solver(Robot.prototype(), Scene())
    pulled = solver.step(solver.rest(), 3.0)
    block = pulled.block.copy()
    with pytest.raises(ValueError, match=r"cable_mm is .*; it must be from 0 to 25.1327 \(robot.max_cable_mm\)"):
        getattr(solver, step)(pulled, cable)
    assert np.array_equal(pulled.block, block)


def test_equilibrium_of_another(circles):
    solver = Solver(Robot.prototype(), circles((44, 104, 15)))
    with pytest.raises(ValueError, match="the equilibrium is of another robot"):
        solver.step(Solver(Robot.prototype(segments=9), solver.scene).rest(), 1.0)
    with pytest.raises(ValueError, match="the equilibrium is of another scene"):
        solver.step(Solver(solver.robot, circles((44, 104, 14))).rest(), 1.0)


def test_equilibrium_is_read_only(circles):
    equilibrium = Solver(Robot.prototype(), circles((44, 104, 15))).rest()
    for array in (equilibrium.block, equilibrium.nodes, equilibrium.multipliers, equilibrium.gaps):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


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
        (lambda: Scene([Circle(center=(40, 0), radius=1)] * 33), "obstacles has more than 32 entries; a scene holds at most 32"),
    ],
)
def test_shape(build, message):
    with pytest.raises(ValueError, match=message):
        build()


def test_polygon_in_either_sense():
    corners = ((30, 90), (50, 90), (50, 100), (30, 100))
    assert Polygon(corners=corners, radius=1) == Polygon(corners=corners[::-1], radius=1)
    assert Polygon(corners=corners[::-1], radius=1).gap(np.array([40.0, 80.0])) == pytest.approx(9)
