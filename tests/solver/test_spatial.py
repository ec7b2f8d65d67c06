"""Eq. 13: its free solution in closed form, its planar limit, symmetry about the base axis, and its certificate."""

import math

import casadi as ca
import numpy as np
import pytest

from solver import Circle, Robot, Scene, Solver, Status
from solver.free import free_nodes
from solver.spatial import SpatialReferenceSolver, SpatialRobot, Sphere, spatial_problem

ROBOT = SpatialRobot.prototype()
SPHERE = Sphere(center=(40, 18, 104), radius=15)


def turned(vectors, angle):
    """Vectors (..., 3) turned about the base axis."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return vectors @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])


def walk(solver, *commands):
    equilibrium = solver.rest()
    for command in commands:
        equilibrium = solver.step(equilibrium, command)
        assert equilibrium.status is Status.CONVERGED
    return equilibrium


@pytest.mark.parametrize("angle", [math.pi / 2, 2.0, -1.0])
@pytest.mark.parametrize("cables", [(3.0, 0.0), (0.0, 2.0), (4.0, 4.0), (5.0, 1.5)])
def test_free_robot_is_optimal(angle, cables):
    robot = SpatialRobot.prototype(angle=angle)
    equilibrium = walk(SpatialReferenceSolver(robot), cables)
    assert max(equilibrium.residuals()) < 1e-12


def test_one_cable_bends_as_in_the_plane():
    points = walk(SpatialReferenceSolver(ROBOT), (5.0, 0.0)).points[0]
    planar = free_nodes(Robot.prototype(), 5.0)
    assert points[:, [0, 2]] == pytest.approx(planar[:, :2], abs=1e-10)
    assert points[:, 1] == pytest.approx(0, abs=1e-10)


@pytest.mark.parametrize("angle", [math.pi / 2, 2 * math.pi / 3])
def test_equal_pulls_bend_in_the_plane_between(angle):
    """Fig. 11."""
    points = walk(SpatialReferenceSolver(SpatialRobot.prototype(angle=angle)), (4.0, 4.0)).points[0]
    assert turned(points, -angle / 2)[:, 1] == pytest.approx(0, abs=1e-9)
    assert turned(points, -angle / 2)[-1, 0] > 40


def test_a_sphere_in_the_plane_is_the_circle_of_the_plane():
    pulls = np.arange(0.5, 6.01, 0.5).tolist()
    solver = SpatialReferenceSolver(ROBOT, (Sphere(center=(44, 0, 104), radius=15),))
    equilibrium = walk(solver, *((pull, 0.0) for pull in pulls))
    planar_solver = Solver(Robot.prototype(), Scene([Circle(center=(44, 104), radius=15)]))
    planar = planar_solver.rest()
    for pull in pulls:
        planar = planar_solver.step(planar, pull)
    assert planar.contact.any()
    assert equilibrium.points[0][:, [0, 2]] == pytest.approx(planar.nodes[:, :2], abs=1e-6)
    # The objective of eq. 13 counts the turn of both holes; the second does not turn in the plane.
    assert equilibrium.multipliers.sum() == pytest.approx(planar.multipliers.sum(), rel=1e-5)


def test_contact_out_of_the_plane_is_certified():
    equilibrium = walk(SpatialReferenceSolver(ROBOT, (SPHERE,)), *((k / 2, k / 5) for k in range(1, 13)))
    assert equilibrium.multipliers.any()
    stationarity, lengths, depth = equilibrium.residuals()
    assert stationarity < 1e-8
    assert lengths < 1e-9
    assert depth < 1e-8
    assert np.all(equilibrium.multipliers * equilibrium.gaps < 1e-10)


def test_turning_holes_commands_and_scene_turns_the_result():
    """Cables at 0° and 120°, the first one pulled, are those at 0° and −120°, the second one pulled, turned by 120°."""
    third = 2 * math.pi / 3
    one = SpatialReferenceSolver(SpatialRobot.prototype(angle=third), (SPHERE,))
    x, y, z = turned(np.array(SPHERE.center), -third)
    other = SpatialReferenceSolver(
        SpatialRobot.prototype(angle=-third), (Sphere(center=(x, y, z), radius=SPHERE.radius),)
    )
    here = walk(one, *((k / 2, 0.0) for k in range(1, 13)))
    there = walk(other, *((0.0, k / 2) for k in range(1, 13)))
    assert here.multipliers.any()
    assert turned(there.points[0], third) == pytest.approx(here.points[0], abs=1e-7)
    assert turned(there.points[[2, 1]], third) == pytest.approx(here.points[1:], abs=1e-7)


def test_derivatives_are_smooth_where_disks_are_parallel():
    problem = spatial_problem(ROBOT, 0)
    slope = ca.Function("slope", [problem.unknowns], [ca.gradient(problem.objective, problem.unknowns)])
    rest = SpatialReferenceSolver(ROBOT).rest()
    assert np.all(slope(rest.points[:, 1:].ravel()).full() == 0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SpatialRobot.prototype(angle=math.pi), "angle is"),
        (lambda: SpatialRobot(length_mm=180, segments=1, offset_mm=8), "segments is 1"),
        (lambda: SpatialRobot(length_mm=180, segments=18, offset_mm=8, max_cable_mm=300), "max_cable_mm is 300"),
        (lambda: Sphere(center=(1, 2, math.inf), radius=3), "center is"),
        (
            lambda: SpatialReferenceSolver(ROBOT, (Sphere(center=(10, 0, 90), radius=12),)),
            "overlaps the straight robot",
        ),
        (lambda: SpatialReferenceSolver(ROBOT).step(SpatialReferenceSolver(ROBOT).rest(), (1.0, 99.0)), "cables_mm is"),
    ],
)
def test_what_it_refuses(make, message):
    with pytest.raises(ValueError, match=message):
        make()
