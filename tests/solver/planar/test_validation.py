"""Bad input gives one clear error and leaves everything as it was."""

import math

import numpy as np
import pytest

from solver import (
    Circle,
    Ellipse,
    HalfPlane,
    Polygon,
    ReferenceSolver,
    Robot,
    Scene,
    Solver,
)
from solver.cache.memo import TransitionMemo
from solver.planar import forces, free
from solver.planar.batch import BatchSolver
from solver.planar.sensitivity import sensitivity
from solver.spatial import SpatialRobot, Sphere


@pytest.mark.parametrize(
    ("obstacle", "message"),
    [
        (
            Circle(center=(10, 80), radius=12),
            r"Circle\(.*center=\(10.0, 80.0\), radius=12.0\) overlaps the unstressed robot by .* mm at node",
        ),
        (HalfPlane(point=(7, 0), normal=(-1, 0)), "HalfPlane.* overlaps the unstressed robot by 1 mm"),
        (
            HalfPlane(point=(30, 0), normal=(-1, 0), nodes=(19,)),
            "HalfPlane names node 19; the robot's nodes are 0 to 18",
        ),
        (Sphere(center=(50, 0, 100), radius=15), "Sphere.* is an obstacle of space; take one from the package solver"),
        (
            Circle(center=(1e9, 0), radius=50),
            "center of Circle.* is .* mm from the base, beyond 18000 mm.*HalfPlane",
        ),
        (Circle(center=(17000, 0), radius=19000), "radius of Circle.* is 19000 mm, beyond 18000 mm"),
        (HalfPlane(point=(1e6, 0), normal=(-1, 0)), "point of HalfPlane.* is .* mm from the base, beyond 18000 mm"),
        (
            Polygon(corners=((30, 80), (50, 80), (40, 100)), radius=1e-9),
            "radius of Polygon.* is 1e-09 mm; it must be at least 1.8e-07 mm",
        ),
        (Ellipse(center=(1e4, 100), radii=(1e4, 0.01)), "the sharpest radius of Ellipse.* is 1e-08 mm; it must be at"),
        (Circle(center=(50, 100), radius=15, spring=1e9), "spring is from 1e.* it must be from .* fix a stiffer"),
        (Circle(center=(50, 100), radius=15, spring=1e-20), "leave out a softer obstacle"),
    ],
)
def test_obstacle_of_a_solver(obstacle, message):
    batch = BatchSolver(Robot.prototype(model="paper"), 1, 1)
    for solve in (Solver, ReferenceSolver, lambda _, scene: batch.assign(0, scene)):
        with pytest.raises(ValueError, match=message):
            solve(Robot.prototype(model="paper"), Scene([obstacle]))
    with pytest.raises(ValueError, match="robot 0 has no scene"):
        batch.scene(0)


@pytest.mark.parametrize("solver", [Solver, ReferenceSolver])
def test_what_a_solver_is_made_of(solver):
    for robot in (None, 3, SpatialRobot.prototype(model="paper")):
        with pytest.raises(TypeError, match=r"robot is .*; it must be a Robot: robots of the plane are"):
            solver(robot, Scene())
    for scene in (None, [], Circle(center=(50, 100), radius=15)):
        with pytest.raises(TypeError, match=r"scene is .*; it must be a Scene: put the obstacles in one"):
            solver(Robot.prototype(model="paper"), scene)


@pytest.mark.parametrize("step", ["step", "trace"])
@pytest.mark.parametrize("cable", [-0.1, 25.2, math.nan, math.inf, None, "3", True, 3j, np.array(3.0), 10**400])
def test_command(cable, step):
    solver = Solver(Robot.prototype(model="paper"), Scene())
    pulled = solver.step(solver.rest(), 3.0)
    block = pulled.block.copy()
    with pytest.raises(ValueError, match=r"cable_mm is .*; it must be from 0 to 25.1327 \(robot.max_cable_mm\)"):
        getattr(solver, step)(pulled, cable)
    assert np.array_equal(pulled.block, block)


@pytest.mark.parametrize("length", [0, 181, math.nan, "180", True])
def test_length(length):
    solver = Solver(Robot.prototype(model="paper"), Scene())
    with pytest.raises(ValueError, match=r"length_mm is .*; it must be from 180 to 180"):
        solver.step(solver.rest(), 1.0, length)


def test_a_command_of_any_type_of_number_is_the_same_command():
    solver = Solver(Robot.prototype(model="paper"), Scene())
    memo = TransitionMemo(solver)
    expected = solver.step(solver.rest(), 3.0)
    for cable in (3, np.int8(3), np.float32(3), np.float64(3)):
        for step in (solver.step, memo.step):
            assert step(solver.rest(), cable, np.int64(180)).block.tobytes() == expected.block.tobytes()
    assert memo.statistics.size == 1
    assert memo.step(solver.rest(), -0.0).block.tobytes() == solver.step(solver.rest(), 0.0).block.tobytes()
    with pytest.raises(ValueError, match="cable_mm is True"):
        memo.step(solver.step(solver.rest(), 1.0), True)


def test_what_is_no_equilibrium():
    solver = Solver(Robot.prototype(model="paper"), Scene())
    for call in (solver.step, solver.trace, TransitionMemo(solver).step):
        with pytest.raises(TypeError, match=r"equilibrium is None; it must be an Equilibrium: step from rest\(\)"):
            call(None, 1.0)
    for call in (forces.force_true, forces.VirtualWork().estimate, sensitivity):
        with pytest.raises(TypeError, match="equilibrium is 3; it must be an Equilibrium"):
            call(3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda robot: free.free_nodes(robot, 30.0), "cable_mm is 30.0; it must be from 0 to 25.1327"),
        (lambda robot: free.tip_slopes(robot, math.nan), "cable_mm is nan; it must be from 0 to 25.1327"),
        (lambda robot: free.tip_slopes(robot, 3.0, 19), "node is 19; it must be a whole number from 0 to 18"),
        (lambda robot: free.fitted_slopes(robot, 0.0, 3.0, -1), "node is -1; it must be a whole number from 0 to 18"),
        (lambda robot: forces.VirtualWork(math.nan), "friction is nan; it must be finite"),
        (lambda robot: forces.VirtualWork(0.1, (3, 2)), r"fit_range_mm is \(3, 2\); it must grow"),
        (lambda robot: forces.VirtualWork.calibrated(0, 1, np.ones(3), 8), "force is 0; it must be positive"),
        (lambda robot: forces.VirtualWork.calibrated(1, 1, np.zeros(3), 8), "the tip must move in y"),
        (lambda robot: Circle(center=(40, 100), radius=9).gap("ab"), r"points is 'ab'; it must be numbers of shape"),
        (lambda robot: Circle(center=(40, 100), radius=9).gap([1j, 2]), "points is .*, not complex"),
        (lambda robot: Circle(center=(40, 100), radius=9).gap([1, math.nan]), "points is .*; all must be finite"),
        (
            lambda robot: Circle(center=(40, 100), radius=9, spring=((1, 0), (0, 1e-12))),
            "the stiffness of its softest direction must",
        ),
        (lambda robot: Circle(center=(40, 100), radius=9).shifted((1, 2, 3)), "by is .*; it must be a pair"),
    ],
)
def test_functions(call, message):
    with pytest.raises(ValueError, match=message):
        call(Robot.prototype(model="paper"))


def test_functions_of_a_robot():
    for call in (free.free_nodes, free.tip_slopes, free.free_tension, free.free_angle):
        with pytest.raises(TypeError, match=r"robot is SpatialRobot.*; it must be a Robot"):
            call(SpatialRobot.prototype(model="paper"), 1.0)
