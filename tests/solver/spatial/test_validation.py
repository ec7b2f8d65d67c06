"""Bad input in space gives one clear error and leaves everything as it was."""

import copy
import math
import pickle

import numpy as np
import pytest

from solver import Circle, Robot, Scene, Status
from solver.spatial import (
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    SpatialBatchSolver,
    SpatialEquilibrium,
    SpatialReferenceSolver,
    SpatialRobot,
    SpatialSolver,
    Sphere,
    forces,
)
from solver.spatial.sensitivity import spatial_sensitivity

SCENE = Scene([Sphere(center=(50, 0, 110), radius=15)])


@pytest.fixture
def pulled(robot):
    solver = SpatialSolver(robot, SCENE)
    return solver.step(solver.rest(), (8.0, 1.0))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"length_mm": 1e-320}, "length_mm is .*; it must be positive and finite, from 1e-30 to 1e"),
        ({"rigidity": 1.7e308}, r"rigidity is 1.7e\+308; it must be positive and finite, from 1e-60 to 1e\+60"),
        ({"angle": 0.3}, "angle is 0.3; it must be from π/6 to 5π/6 either way: nearer to one plane"),
        ({"angle": 2.85}, "angle is 2.85; it must be from π/6 to 5π/6 either way"),
        ({"angle": math.nan}, "angle is nan; it must be finite"),
        ({"angle": "1"}, "angle is '1'; it must be finite"),
        ({"touch": "rim"}, r"touch is 'rim'; it must be a tuple of some of .*, as \('backbone',\)"),
        ({"rim_points": 16.0}, "rim_points is 16.0; it must be a whole number from 3 to 64"),
        ({"offset_mm": 1e-3}, "offset_mm is 0.001; it must be from 0.018 to 1800"),
        ({"max_cable_mm": []}, r"max_cable_mm is \[\]; it must be positive and finite"),
        (
            {"model": "paper", "segments": 4096, "between": 16},
            "348165 points that can touch, and at most 262144 are allowed",
        ),
    ],
)
def test_robot(change, message):
    with pytest.raises(ValueError, match=message):
        SpatialRobot(**{"length_mm": 180.0, "segments": 18, "offset_mm": 8.0, **change})


@pytest.mark.parametrize("angle", [math.pi / 6, math.pi / 2, 5 * math.pi / 6, -math.pi / 3])
def test_angles_that_are_taken(angle):
    assert SpatialRobot.prototype(model="paper", angle=angle).angle == angle


@pytest.mark.parametrize(
    ("obstacle", "message"),
    [
        (
            Circle(center=(50, 110), radius=15),
            "Circle.* is an obstacle of the plane; take one from the package solver.spatial",
        ),
        (
            Sphere(center=(1e9, 0, 0), radius=15),
            "center of Sphere.* mm from the base, beyond 18000 mm.*HalfSpace",
        ),
        (HalfSpace(point=(1e9, 0, 0), normal=(-1, 0, 0)), "point of HalfSpace.* mm from the base, beyond 18000 mm"),
        (Sphere(center=(50, 0, 110), radius=20000), "radius of Sphere.* is 20000 mm, beyond 18000 mm"),
        (
            Box(center=(50, 0, 110), sizes=(20, 20, 20), edge=1e-9),
            "edge of Box.* is 1e-09 mm; it must be at least",
        ),
        (Sphere(center=(50, 0, 110), radius=15, spring=1e9), "spring is from 1e.* it must be from"),
    ],
)
def test_obstacle_of_a_solver(robot, obstacle, message):
    batch = SpatialBatchSolver(robot, 1, 1)
    for solve in (SpatialSolver, SpatialReferenceSolver, lambda _, scene: batch.assign(0, scene)):
        with pytest.raises(ValueError, match=message):
            solve(robot, Scene([obstacle]))


@pytest.mark.parametrize("solver", [SpatialSolver, SpatialReferenceSolver, lambda r, s: SpatialBatchSolver(r, 1, 0)])
def test_what_a_solver_is_made_of(solver):
    for robot in (None, Robot.prototype(model="paper")):
        with pytest.raises(TypeError, match=r"robot is .*; it must be a SpatialRobot: robots of the plane are"):
            solver(robot, Scene())


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Sphere(center=(1, 2), radius=3), r"center is \(1, 2\); it must be three coordinates"),
        (lambda: Sphere(center=(1, 2, 1e155), radius=3), "center is .*; it must be finite, at most 1e"),
        (lambda: Sphere(center=(1, 2, 3), radius=True), "radius is True; it must be positive"),
        (lambda: Capsule(start=(1, 2, 3), end=(1, 2, "3"), radius=3), "end is .*; it must be three coordinates"),
        (lambda: Cylinder(start=(1, 2, 3), end=(1, 2, 30), radius=3, edge=None), "edge is None; it must be positive"),
        (lambda: Box(center=(1, 2, 3), sizes=(1, 2), edge=0.1), "sizes is .*; it must be three coordinates"),
        (lambda: Box(center=(1, 2, 3), sizes=(9, 9, 9), second="abc"), "second is 'abc'; it must be three"),
        (lambda: Box(center=(1, 2, 3), sizes=(9, 9, 9), second=(1, 1e-9, 0)), "second is .*; give the direction"),
    ],
)
def test_shape(build, message):
    with pytest.raises(ValueError, match=message):
        build()


@pytest.mark.parametrize("cables", [3.0, "ab", None, (1.0,), (1, 2, 3), (1, math.nan), (1, True), (1, 13), (1j, 2)])
def test_command(robot, cables, pulled):
    solver = SpatialSolver(robot, SCENE)
    for call in (solver.step, solver.trace):
        with pytest.raises(ValueError, match=r"cables_mm is .*; it must be 2 numbers, from -12.5664 to 12.5664"):
            call(pulled, cables)
        with pytest.raises(TypeError, match="equilibrium is None; it must be a SpatialEquilibrium: step from rest"):
            call(None, (1.0, 1.0))


def test_whole_commands_are_the_same_commands(robot, pulled):
    solver = SpatialSolver(robot, SCENE)
    for cables in ([8, 1], np.array([8, 1]), (np.float32(8), np.int8(1))):
        assert solver.step(solver.rest(), cables).block.tobytes() == pulled.block.tobytes()


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e))])
def test_a_copied_equilibrium_is_read_only(pulled, copied):
    twin = copied(pulled)
    assert twin.block.tobytes() == pulled.block.tobytes()
    with pytest.raises(ValueError, match="read-only"):
        twin.block[...] = 0
    assert len(repr(twin)) < 300
    assert "SpatialEquilibrium CONVERGED: 18 segments" in repr(twin)


@pytest.mark.parametrize("length", [-180.0, -math.inf, math.nan, 1e300])
def test_blocks_that_are_none(pulled, length):
    block = pulled.block.copy()
    block[2] = length
    with pytest.raises(ValueError, match=r"length_mm in block is .*; it must be from 180|numbers that are not finite"):
        SpatialEquilibrium(pulled.robot, pulled.scene, block, Status.CONVERGED, 0)


def test_what_is_no_equilibrium():
    for call in (forces.force_true, forces.SpatialVirtualWork().estimate, spatial_sensitivity):
        with pytest.raises(TypeError, match="equilibrium is 3; it must be a SpatialEquilibrium"):
            call(3)
    with pytest.raises(ValueError, match="friction is None; it must be finite"):
        forces.SpatialVirtualWork(None)


def test_a_robot_put_among_other_obstacles_rests_before_it_moves(robot):
    batch = SpatialBatchSolver(robot, 2, 1)
    for k in range(2):
        batch.assign(k, SCENE)
    batch.rest([0, 1])
    batch.step(np.full((2, 2), 5))
    batch.assign(1, Scene([Sphere(center=(48, 0, 110), radius=15)]))
    message = r"robot 1 has a new scene, or its rest was interrupted or refused; call rest\(\[1\]\) before it moves"
    with pytest.raises(ValueError, match=message):
        batch.step(np.full((2, 2), 5.0))
    for commands in (np.full(2, 5.0), np.full((2, 2), 13.0), np.full((2, 3), 1.0)):
        with pytest.raises(ValueError, match="cable_mm is"):
            batch.step(commands)
    batch.rest([1])
    batch.step(np.full((2, 2), 5.0))
    assert batch.equilibrium(1).gaps.min() > -1e-9
