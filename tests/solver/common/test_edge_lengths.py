"""``edges_mm`` bounds the distance of neighbouring points that can touch, in every shape that a rod can have."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver import Cable, Load, Robot, Scene, Solver, spatial
from solver.planar.equilibrium import touching_points
from solver.planar.robot import LINES

SEGMENTS = 8
ROUNDOFF = 1e-12
shares = st.lists(st.floats(-1, 1), min_size=SEGMENTS, max_size=SEGMENTS).map(np.array)
sizes = {
    "model": st.just("rod"),
    "segments": st.just(SEGMENTS),
    "offset_mm": st.floats(2, 8),
    "length_mm": st.floats(40, 250),
    "rigidity": st.just(5000.0),
    "max_tension": st.just(math.inf),
    "disk_radius_mm": st.floats(8, 24),
    "between": st.integers(0, 2),
}


def most_turn(robot):
    """How far a segment may be bent at rest: short of where its disks meet, and of what a robot takes [rad]."""
    return min(1.5, 0.999 * robot.segment_mm / robot.edge_mm)


def assert_bounded(points, robot):
    """Points of each line, (p, k, d), are no farther apart than its bound."""
    lengths = np.linalg.norm(np.diff(points, axis=1), axis=2).max(axis=1)
    assert (lengths <= np.array(robot.edges_mm) * (1 + ROUNDOFF)).all()


@given(robot=st.builds(Robot, touch=st.just(LINES), **sizes), turns=shares)
def test_in_the_plane(robot, turns):
    """The robot is at rest in the shape, as one that was made with it."""
    curved = replace(robot, precurvature=tuple(most_turn(robot) * turns))
    assert_bounded(touching_points(curved, Solver(curved, Scene()).rest().nodes), robot)


@given(
    robot=st.builds(spatial.SpatialRobot, touch=st.just(("backbone", "rim")), rim_points=st.just(6), **sizes),
    turns=shares,
    ways=st.lists(st.integers(0, 5), min_size=SEGMENTS, max_size=SEGMENTS),
)
def test_in_space(robot, turns, ways):
    """Each segment bends straight away from one of the lines."""
    angles = math.pi / 3 * np.array(ways) + math.pi / 2
    bends = most_turn(robot) * turns[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    curved = replace(robot, precurvature=tuple((x, y, 0.0) for x, y in bends))
    assert_bounded(spatial.SpatialSolver(curved, Scene()).rest().points, robot)


@given(
    robot=st.builds(spatial.SpatialRobot, touch=st.just(("backbone", "rim")), rim_points=st.just(6), **sizes),
    turns=shares,
    twists=shares,
    ways=st.lists(st.integers(0, 5), min_size=SEGMENTS, max_size=SEGMENTS),
)
def test_twisted_in_space(robot, turns, twists, ways):
    """Each segment bends straight away from one of the lines, and twists by up to 0.5 rad."""
    angles = math.pi / 3 * np.array(ways) + math.pi / 2
    bends = 0.9 * most_turn(robot) * turns
    rotations = np.column_stack([bends * np.cos(angles), bends * np.sin(angles), twists / 2])
    curved = replace(robot, precurvature=tuple(map(tuple, rotations.tolist())))
    assert_bounded(spatial.SpatialSolver(curved, Scene()).rest().points, curved)


def twisted_by(force):
    """A curved segment, that resists twist but little, under a couple."""
    couple = tuple(
        Load(node=1, force=(0.0, sign * force, 0.0), at=(8.0, way)) for sign, way in ((1, 0.0), (-1, math.pi))
    )
    return spatial.SpatialRobot(
        length_mm=20.0,
        segments=2,
        offset_mm=8.0,
        torsion_ratio=0.01,
        max_tension=math.inf,
        cables=(Cable(),),
        loads=couple,
        precurvature=((0.0, 1.2, 0.0), (0.0, 0.0, 0.0)),
        touch=("backbone", "rim"),
    )


def test_twisted_by_loads():
    robot = twisted_by(0.5)
    rest = spatial.SpatialSolver(robot, Scene()).rest()
    assert abs(rest.controls[0, 2]) > robot.segment_mm / (2 * robot.offset_mm)
    assert_bounded(rest.points, robot)


def test_twisted_farther_than_the_bound_allows():
    with pytest.raises(ValueError, match="bend or twist it too far: raise max_tension or rigidity"):
        spatial.SpatialSolver(twisted_by(2.0), Scene()).rest()
