"""Bad input gives one clear error and leaves everything as it was."""

import copy
import math
import os
import pickle
from dataclasses import replace

import numpy as np
import pytest

from solver import (
    Capsule,
    Circle,
    Ellipse,
    Equilibrium,
    HalfPlane,
    Polygon,
    ReferenceSolver,
    Robot,
    Scene,
    Solver,
    Status,
)
from solver.cache.memo import TransitionMemo
from solver.planar import forces, free
from solver.planar.batch import BatchSolver
from solver.planar.sensitivity import sensitivity
from solver.spatial import SpatialRobot, Sphere

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
        ({"model": "slack"}, "model is 'slack'; it must be one of paper, rod"),
        ({"length_range_mm": (0, 200)}, "a bound of length_range_mm is 0; it must be positive and finite"),
        ({"length_range_mm": (190, 200)}, r"length_mm is 180.0; it must lie in length_range_mm \(190.0, 200.0\)"),
        ({"length_range_mm": 200}, "length_range_mm is 200; it must be a pair"),
        ({"length_range_mm": (0.1, 200)}, "the shortest must be at least 0.001 of the longest, 0.2"),
        ({"length_mm": 1e-320}, "length_mm is .*; it must be positive and finite, from 1e-30 to 1e"),
        ({"length_mm": True}, "length_mm is True; it must be positive"),
        ({"length_mm": "180"}, "length_mm is '180'; it must be positive"),
        ({"length_mm": 180 + 0j}, "length_mm is .*; it must be positive"),
        ({"length_mm": np.array(180.0)}, "length_mm is .*; it must be positive"),
        ({"length_mm": 10**400}, "length_mm is 1000.*; it must be positive"),
        ({"rigidity": 1.7e308}, r"rigidity is 1.7e\+308; it must be positive and finite, from 1e-60 to 1e\+60"),
        ({"offset_mm": 1e-3}, "offset_mm is 0.001; it must be from 0.018 to 1800"),
        ({"offset_mm": 1e7}, "offset_mm is 10000000.0; it must be from 0.018 to 1800"),
        ({"max_tension": 1e-9}, "max_tension is 1e-09; it must be at least .* of EI"),
        ({"max_cable_mm": 1e-9}, "max_cable_mm is 1e-09; it must be at least 8e-06"),
        ({"touch": "rim"}, r"touch is 'rim'; it must be a tuple of some of .*, as \('backbone',\)"),
        ({"touch": None}, "touch is None; it must be a tuple"),
        ({"segments": True}, "segments is True; it must be a whole number"),
        ({"segments": 4096, "between": 256}, "2105346 points that can touch, and at most 262144 are allowed"),
    ],
)
def test_robot(change, message):
    with pytest.raises(ValueError, match=message):
        Robot(**{**PROTOTYPE, **change})


def test_numbers_of_numpy_are_numbers():
    given = Robot(length_mm=np.float32(180), segments=np.int64(18), offset_mm=np.int32(8), between=np.uint8(2))
    assert given == replace(Robot.prototype(), between=2)
    assert {type(value) for value in (given.length_mm, given.offset_mm)} == {float}
    assert {type(value) for value in (given.segments, given.between)} == {int}
    assert Circle(center=np.array([40, 100]), radius=np.int64(10)) == Circle(center=(40.0, 100.0), radius=10.0)


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


def test_scene():
    for obstacles in (None, 3, Circle(center=(40, 100), radius=10)):
        with pytest.raises(TypeError, match=r"obstacles is .*; give a list of obstacles"):
            Scene(obstacles)
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
        (Sphere(center=(50, 0, 100), radius=15), "Sphere.* is an obstacle of space; give one of solver"),
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
    batch = BatchSolver(Robot.prototype(), 1, 1)
    for solve in (Solver, ReferenceSolver, lambda _, scene: batch.assign(0, scene)):
        with pytest.raises(ValueError, match=message):
            solve(Robot.prototype(), Scene([obstacle]))
    with pytest.raises(ValueError, match="robot 0 has not been assigned"):
        batch.scene(0)


@pytest.mark.parametrize("solver", [Solver, ReferenceSolver])
def test_what_a_solver_is_made_of(solver):
    for robot in (None, 3, SpatialRobot.prototype()):
        with pytest.raises(TypeError, match=r"robot is .*; it must be a Robot: robots of the plane are"):
            solver(robot, Scene())
    for scene in (None, [], Circle(center=(50, 100), radius=15)):
        with pytest.raises(TypeError, match=r"scene is .*; it must be a Scene: put the obstacles in one"):
            solver(Robot.prototype(), scene)


@pytest.mark.parametrize("step", ["step", "trace"])
@pytest.mark.parametrize("cable", [-0.1, 25.2, math.nan, math.inf, None, "3", True, 3j, [3.0], np.array(3.0), 10**400])
def test_command(cable, step):
    solver = Solver(Robot.prototype(), Scene())
    pulled = solver.step(solver.rest(), 3.0)
    block = pulled.block.copy()
    with pytest.raises(ValueError, match=r"cable_mm is .*; it must be from 0 to 25.1327 \(robot.max_cable_mm\)"):
        getattr(solver, step)(pulled, cable)
    assert np.array_equal(pulled.block, block)


@pytest.mark.parametrize("length", [0, 181, math.nan, "180", True])
def test_length(length):
    solver = Solver(Robot.prototype(), Scene())
    with pytest.raises(ValueError, match=r"length_mm is .*; it must be from 180 to 180"):
        solver.step(solver.rest(), 1.0, length)


def test_a_command_of_any_type_of_number_is_the_same_command():
    solver = Solver(Robot.prototype(), Scene())
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
    solver = Solver(Robot.prototype(), Scene())
    for call in (solver.step, solver.trace, TransitionMemo(solver).step):
        with pytest.raises(TypeError, match=r"equilibrium is None; it must be a Equilibrium: step from rest\(\)"):
            call(None, 1.0)
    for call in (forces.force_true, forces.VirtualWork().estimate, sensitivity):
        with pytest.raises(TypeError, match="equilibrium is 3; it must be a Equilibrium"):
            call(3)
    with pytest.raises(TypeError, match="solver is None; it must be a Solver or ReferenceSolver"):
        TransitionMemo(None)


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
            "its softest direction must",
        ),
        (lambda robot: Circle(center=(40, 100), radius=9).shifted((1, 2, 3)), "by is .*; it must be a pair"),
    ],
)
def test_functions(call, message):
    with pytest.raises(ValueError, match=message):
        call(Robot.prototype())


def test_functions_of_a_robot():
    for call in (free.free_nodes, free.tip_slopes, free.free_tension, free.free_angle):
        with pytest.raises(TypeError, match=r"robot is SpatialRobot.*; it must be a Robot"):
            call(SpatialRobot.prototype(), 1.0)


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
    "copied", [copy.copy, copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e)), replace], ids=lambda f: f.__name__
)
def test_a_copied_equilibrium_is_read_only(circles, copied):
    solver = Solver(Robot.prototype(), circles((44, 104, 15)))
    equilibrium = solver.step(solver.rest(), 7.0)
    twin = copied(equilibrium)
    assert twin.status is equilibrium.status
    assert twin.block.tobytes() == equilibrium.block.tobytes()
    assert solver.step(twin, 8.0).block.tobytes() == solver.step(equilibrium, 8.0).block.tobytes()
    for array in (twin.block, twin.nodes):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_an_equilibrium_keeps_no_array_that_others_write(circles):
    equilibrium = Solver(Robot.prototype(), circles((44, 104, 15))).rest()
    rows = np.array([equilibrium.block, equilibrium.block])
    held = Equilibrium(equilibrium.robot, equilibrium.scene, rows[0], Status.CONVERGED, 0)
    rows[:] = 7.0
    assert held.block.tobytes() == equilibrium.block.tobytes()


def test_an_equilibrium_is_shown_in_short(circles):
    solver = Solver(Robot.prototype(), circles((44, 104, 15)))
    text = repr(solver.step(solver.rest(), 7.0))
    assert len(text) < 300
    assert "<Equilibrium CONVERGED: 18 segments, 180 mm long, 1 obstacles, 1 contacts, cable 7 mm" in text


def written(place, value):
    def change(block):
        block[place] = value
        return block

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (written(1, -180.0), "length_mm in block is -180.0; it must be from 180 to 180: take the block of"),
        (written(1, -math.inf), "block has numbers that are not finite"),
        (written(1, math.nan), "block has numbers that are not finite"),
        (written(0, 1e9), "the displacement of a cable in block is .*; it must be at most 180"),
        (written(5, 1e9), "a coordinate of a segment in block is .*; it must be at most"),
        (written(40, 1e9), "the distance of a node in block is .*; it must be at most"),
        (lambda block: block[:-1], "block has shape .*; it must be"),
        (lambda block: block.astype(np.float32), "it must be a contiguous array of float64"),
        (lambda block: np.repeat(block, 2)[::2], "it must be a contiguous array of float64"),
        (lambda block: block.tolist(), "it must be a contiguous array of float64"),
        (lambda block: None, "block is None; it must be a contiguous array of float64"),
    ],
)
def test_blocks_that_are_none(circles, change, message):
    equilibrium = Solver(Robot.prototype(), circles((44, 104, 15))).rest()
    with pytest.raises(ValueError, match=message):
        Equilibrium(equilibrium.robot, equilibrium.scene, change(equilibrium.block.copy()), Status.CONVERGED, 0)


def test_parts_of_an_equilibrium_that_are_none():
    rest = Solver(Robot.prototype(), Scene()).rest()
    for robot, scene, status in ((None, rest.scene, rest.status), (rest.robot, [], rest.status)):
        with pytest.raises(TypeError, match=r"it must be a (Robot|Scene)"):
            Equilibrium(robot, scene, rest.block, status, 0)
    with pytest.raises(TypeError, match="status is 0; it must be a Status"):
        Equilibrium(rest.robot, rest.scene, rest.block, 0, 0)
    with pytest.raises(ValueError, match="iterations is -1; it must be a whole number"):
        Equilibrium(rest.robot, rest.scene, rest.block, rest.status, -1)


@pytest.fixture
def batch(circles):
    made = BatchSolver(Robot.prototype(), 4, 1)
    for k in range(4):
        made.assign(k, circles((44 + k, 104, 15)))
    made.rest(range(4))
    return made


def test_a_robot_put_among_other_obstacles_rests_before_it_moves(batch, circles):
    batch.step(np.full(4, 8.0))
    before = batch.blocks.copy()
    batch.assign(3, circles((41, 104, 15)))
    message = r"robot 3 was put among other obstacles, or its rest was cut short; call rest\(\[3\]\) before it moves"
    for move in (
        lambda: batch.step(np.full(4, 8.0)),
        lambda: batch.step(np.full(1, 8.0), [3]),
        lambda: batch.move(3),
        lambda: batch.move([3]),
        lambda: batch.move(slice(None)),
        lambda: batch.probe(batch.commands),
        lambda: batch.equilibrium(3),
    ):
        with pytest.raises(ValueError, match=message):
            move()
    assert np.array_equal(batch.blocks, before)
    batch.step(np.full(2, 8.5), [0, 2])
    batch.rest([3])
    batch.step(np.full(4, 8.0))
    assert batch.equilibrium(3).gaps.min() > -1e-9
    before = batch.blocks.copy()
    batch.assign(3, circles((41, 104, 15)))  # those that it is among
    batch.step(np.full(4, 8.0))
    assert np.array_equal(batch.blocks, before)


@pytest.mark.parametrize("scene", [(), ((44, 104, 15), (60, 140, 12)), ((15, 100, 15),)])
def test_a_scene_that_a_batch_refuses_changes_nothing(batch, circles, scene):
    kept = batch.scene(2)
    with pytest.raises(ValueError, match=r"as many obstacles as it was made for|overlaps the straight robot"):
        batch.assign(2, circles(*scene))
    assert batch.scene(2) is kept
    assert batch.leaves_clear(kept)
    assert not batch.leaves_clear(circles((15, 100, 15)))
    batch.step(np.full(4, 5.0))


@pytest.mark.parametrize(
    "robots", [[0, 0], [4], [-1], [True], [1.0], ["1"], None, 1, np.array([1.0]), [10**20], np.array([[0, 1]])]
)
def test_robots_that_a_batch_does_not_have(batch, robots):
    before = batch.blocks.copy()
    for call in (
        lambda: batch.rest(robots),
        lambda: batch.ramp_reaches_force(robots, np.full(np.size(robots), 0.1), 0.5, 8.0),
        lambda: batch.step(np.full(np.size(robots), 3.0), [1.5] if robots is None else robots),
    ):
        with pytest.raises(ValueError, match=r"robots? is .*; it must|the index of a robot is .*; it must be a whole"):
            call()
    assert np.array_equal(batch.blocks, before)


@pytest.mark.parametrize(
    "commands",
    [[1.0, 2.0, 3.0], 1.0, [1, 2, 3, math.nan], [1, 2, 3, 26], ["1"] * 4, [1j] * 4, [True] * 4, None, np.ones((4, 2))],
)
def test_commands_that_a_batch_refuses(batch, commands):
    before = batch.blocks.copy(), batch.commands.copy()
    with pytest.raises(ValueError, match="cable_mm is"):
        batch.step(commands)
    with pytest.raises(ValueError, match="commands is"):
        batch.probe(commands)
    assert np.array_equal(batch.blocks, before[0])
    assert np.array_equal(batch.commands, before[1])


def test_whole_commands_and_no_robots(batch):
    batch.step(np.array([1, 2, 3, 4]))
    blocks = batch.blocks.copy()
    batch.step([1.0, 2.0, 3.0, 4.0])
    batch.step(np.zeros(0), [])
    batch.rest([])
    assert np.array_equal(batch.blocks, blocks)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"increment_mm": 0}, "increment_mm is 0; it must be positive and finite, from 0.00014"),
        ({"increment_mm": math.nan}, "increment_mm is nan; it must be positive"),
        ({"increment_mm": -0.5}, "increment_mm is -0.5; it must be positive"),
        ({"increment_mm": 1e-300}, "increment_mm is 1e-300; it must be positive"),
        ({"limit_mm": 26.0}, "limit_mm is 26.0; it must be positive and finite, from 1e-30 to 25.1327"),
        ({"limit_mm": None}, "limit_mm is None; it must be positive"),
        ({"forces": [math.nan] * 4}, "forces is .*; all must be finite and not negative"),
        ({"forces": [0.1]}, r"forces is .*; it must be numbers of shape \(4,\)"),
        ({"directions": np.ones((4, 2))}, r"directions is .*; it must be numbers of shape \(4, 1\)"),
        ({"directions": -np.ones((4, 1))}, "directions is .*; all must be from 0 to 1"),
        ({"obstacle": 1}, "obstacle is 1; it must be a whole number from 0 to 0"),
        ({"obstacle": -1}, "obstacle is -1; it must be a whole number from 0 to 0"),
    ],
)
def test_trial_pulls(batch, change, message):
    pull = {"robots": range(4), "forces": np.full(4, 0.01), "increment_mm": 0.5, "limit_mm": 14.0}
    assert batch.ramp_reaches_force(**pull)[0].any()
    with pytest.raises(ValueError, match=message):
        batch.ramp_reaches_force(**{**pull, **change})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0, 1), "count is 0; it must be a whole number from 1"),
        ((True, 1), "count is True; it must be a whole number"),
        ((2.0, 1), "count is 2.0; it must be a whole number"),
        ((10**9, 1), r"count is 1000000000; their blocks need .* GB and this machine has .* GB: make batches of at"),
        ((2, -1), "obstacles is -1; it must be a whole number from 0 to 32"),
        ((2, 33), "obstacles is 33; it must be a whole number from 0 to 32"),
        ((2, None), "obstacles is None; it must be a whole number"),
        ((2, 1, 0), "threads is 0; it must be a whole number from 1"),
        ((2, 1, 100_000), f"threads is 100000; .* from 1 to {max(64, 4 * (os.cpu_count() or 1))}; more do not help"),
    ],
)
def test_what_a_batch_is_made_of(arguments, message):
    with pytest.raises(ValueError, match=message):
        BatchSolver(Robot.prototype(), *arguments)
    with pytest.raises(TypeError, match="robot is None; it must be a Robot"):
        BatchSolver(None, 1, 1)


def test_a_batch_answers_only_for_robots_that_are_assigned(circles):
    batch = BatchSolver(Robot.prototype(), 2, 1)
    batch.assign(0, circles((44, 104, 15)))
    for call in (
        lambda: batch.rest([0, 1]),
        lambda: batch.ramp_reaches_force([1], [0.1], 0.5, 8.0),
        lambda: batch.move(1),
        lambda: batch.equilibrium(1),
    ):
        with pytest.raises(ValueError, match="robot 1 has not been assigned to a scene; call assign"):
            call()
    with pytest.raises(TypeError, match="scene is None; it must be a Scene"):
        batch.assign(1, None)


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
