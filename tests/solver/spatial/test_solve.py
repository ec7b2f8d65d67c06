"""The kernel in space: its certificate, the limits in which the answer is known, its events, and what it refuses."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver import Circle, Robot, Scene, Solver, Status
from solver.spatial import Box, Cylinder, HalfSpace, SpatialBatchSolver, SpatialRobot, SpatialSolver, Sphere

SPHERE = Sphere(center=(40, 18, 104), radius=15)
IN_PLANE = {
    "sphere": (Sphere(center=(44, 0, 104), radius=15), Circle(center=(44, 104), radius=15)),
    "cylinder": (
        Cylinder(start=(44, -40, 104), end=(44, 40, 104), radius=15),
        Circle(center=(44, 104), radius=15),
    ),
    "spring": (
        Sphere(center=(44, 0, 104), radius=15, spring=0.4),
        Circle(center=(44, 104), radius=15, spring=0.4),
    ),
}


@pytest.mark.parametrize("angle", [math.pi / 2, 2.0, -1.0])
@pytest.mark.parametrize("cables", [(3.0, 0.0), (0.0, -2.0), (4.0, 4.0), (-5.0, 1.5)])
def test_free_robot_is_optimal(angle, cables):
    solver = SpatialSolver(SpatialRobot.prototype(model="paper", angle=angle), Scene())
    equilibrium = solver.step(solver.rest(), cables)
    assert equilibrium.status is Status.CONVERGED
    assert max(equilibrium.residuals()) < 1e-12


@pytest.mark.parametrize("name", IN_PLANE)
def test_one_cable_among_obstacles_of_the_plane_is_the_planar_robot(name):
    in_space, in_plane = IN_PLANE[name]
    solver = SpatialSolver(SpatialRobot.prototype(model="paper"), Scene([in_space]))
    planar_solver = Solver(Robot.prototype(model="paper"), Scene([in_plane]))
    equilibrium, planar = solver.rest(), planar_solver.rest()
    for pull in np.arange(0.25, 6.01, 0.25):
        equilibrium, planar = solver.step(equilibrium, (pull, 0.0)), planar_solver.step(planar, pull)
        assert equilibrium.status is planar.status is Status.CONVERGED
        assert equilibrium.nodes[:, [0, 2]] == pytest.approx(planar.nodes[:, :2], abs=1e-7)
        assert equilibrium.nodes[:, 1] == pytest.approx(0, abs=1e-7)
        assert equilibrium.tensions == pytest.approx([planar.tension, 0], abs=1e-7)
        assert equilibrium.forces[0, [0, 2]] == pytest.approx(planar.forces[0], abs=1e-7)
        assert equilibrium.displacements[0, [0, 2]] == pytest.approx(planar.displacements[0], abs=1e-7)
        assert equilibrium.onset_tensions[0] == pytest.approx(planar.onset_tension, abs=1e-4)
        slopes = planar.tip_slopes
        assert equilibrium.tip_slopes[0] == pytest.approx([slopes[0], 0, slopes[1], -8 * slopes[2], 0], abs=1e-9)
    assert planar.contact.any()
    assert equilibrium.contact.any()


@pytest.mark.parametrize("angle", [math.pi / 2, 2 * math.pi / 3])
def test_equal_pulls_bend_in_the_plane_between(angle, turned):
    """Fig. 11."""
    solver = SpatialSolver(SpatialRobot.prototype(model="paper", angle=angle), Scene())
    nodes = turned(solver.step(solver.rest(), (4.0, 4.0)).nodes, -angle / 2)
    assert nodes[:, 1] == pytest.approx(0, abs=1e-9)
    assert nodes[-1, 0] > 40


def test_turning_holes_commands_and_scene_turns_the_result(turned, walk):
    """Cables at 0° and 120°, the first one pulled, are those at 0° and −120°, the second one pulled, turned by 120°."""
    third = 2 * math.pi / 3
    one = SpatialSolver(SpatialRobot.prototype(model="paper", angle=third), Scene([SPHERE]))
    sphere = replace(SPHERE, center=turned(SPHERE.center, -third))
    other = SpatialSolver(SpatialRobot.prototype(model="paper", angle=-third), Scene([sphere]))
    here = walk(one, ((k / 2, 0.0) for k in range(1, 13)))
    there = walk(other, ((0.0, k / 2) for k in range(1, 13)))
    assert here.contact.any()
    assert turned(there.nodes, third) == pytest.approx(here.nodes, abs=1e-9)
    assert turned(there.forces, third) == pytest.approx(here.forces, abs=1e-9)


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_quarter_turns_take_other_cables(quarters, robot, turned, walk):
    """With cables at right angles a quarter turn is one of the commands."""
    angle = quarters * math.pi / 2
    shape = Box(center=(45, 18, 110), sizes=(24, 30, 20), edge=3, axis=(1, 0.2, 0.1))
    there_shape = replace(
        shape, center=turned(shape.center, angle), axis=turned(shape.axis, angle), second=turned(shape.second, angle)
    )
    commands = [(k / 2, k / 5) for k in range(1, 13)]
    here = walk(SpatialSolver(robot, Scene([shape])), commands)
    there = walk(SpatialSolver(robot, Scene([there_shape])), (turned((*c, 0), angle)[:2] for c in commands))
    assert here.contact.any()
    assert there.nodes == pytest.approx(turned(here.nodes, angle), abs=1e-9)


@settings(max_examples=12)
@given(seed=st.integers(0, 2**32 - 1), angle=st.floats(0.8, 2.3))
def test_random_walks_are_certified(seed, angle, random_solver, random_walk):
    generator = np.random.default_rng(seed)
    lines = ("backbone", "holes") if generator.random() < 0.5 else ("backbone", "rim")
    robot = replace(
        SpatialRobot.prototype(model="paper", angle=angle),
        touch=lines,
        rim_points=8,
        between=int(generator.integers(2)),
    )
    for equilibrium in random_walk(generator, random_solver(generator, robot), 60)[::15]:
        assert equilibrium.status is not Status.GAVE_UP
        stationarity, lengths, gaps, complementarity, sign = equilibrium.residuals()
        assert stationarity < 1e-8
        assert lengths < 1e-9
        assert gaps < 1e-9
        assert complementarity < 1e-9
        assert sign == 0


def test_tension_is_the_slope_of_the_energy(robot, walk):
    solver = SpatialSolver(robot, Scene([SPHERE]))
    equilibrium = walk(solver, ((k / 2, k / 5) for k in range(1, 13)))
    for k, step in enumerate(1e-4 * np.eye(2)):
        high, low = (solver.step(equilibrium, equilibrium.cables_mm + sign * step) for sign in (1, -1))
        assert (high.energy - low.energy) / 2e-4 == pytest.approx(equilibrium.tensions[k], abs=1e-6)


def test_a_cable_stops_at_the_tension_limit_and_the_other_goes_on():
    solver = SpatialSolver(SpatialRobot.prototype(model="paper", max_tension=2.0), Scene())
    reached = solver.step(solver.rest(), (8.0, 3.0))
    assert reached.status is Status.STALLED
    assert reached.tensions[0] == pytest.approx(2.0, rel=1e-5)
    assert reached.tensions[0] <= 2.0
    assert reached.cables_mm[1] == 3.0
    released = solver.step(reached, (1.0, -3.0))
    assert released.status is Status.CONVERGED
    assert list(released.cables_mm) == [1.0, -3.0]


def test_a_release_relieves_while_the_other_cable_is_pulled():
    """The second cable cannot be pulled on without the first one passing its limit: it is let out first."""
    wall = HalfSpace(point=(18, 0, 0), normal=(-1, 0, 0))
    solver = SpatialSolver(SpatialRobot.prototype(model="paper", max_tension=1.5), Scene([wall]))
    equilibrium = solver.rest()
    for _ in range(20):
        equilibrium = solver.step(equilibrium, np.minimum(equilibrium.cables_mm + 0.5, 12.0))
    assert equilibrium.status is Status.STALLED
    assert solver.step(equilibrium, equilibrium.cables_mm - [0.5, 0.0]).status is Status.CONVERGED


def test_nothing_is_lost_where_the_way_is_blocked(robot, walk):
    """In a narrow shaft the robot stalls, or is blocked where its motors hold everything, and still lets go."""
    shaft = Scene(HalfSpace(point=(x, y, 0), normal=(-x, -y, 0)) for x, y in ((9.5, 0), (-9.5, 0), (0, 9.5), (0, -9.5)))
    for limit, statuses in ((15.0, {Status.STALLED}), (math.inf, {Status.BLOCKED, Status.GAVE_UP})):
        solver = SpatialSolver(replace(robot, max_tension=limit), shaft)
        stuck = walk(solver, ((k / 2, 0.1 * k) for k in range(1, 25)))
        assert stuck.status in statuses
        assert stuck.contact.any(axis=(1, 2)).all()
        assert max(stuck.residuals()) < 1e-8
        released = solver.step(stuck, stuck.cables_mm - 1)
        assert released.status in (Status.CONVERGED, Status.SNAPPED)
        assert released.cables_mm == pytest.approx(stuck.cables_mm - 1)


def test_a_robot_that_slips_off_says_so(robot):
    """Pressed a little beside its middle, the sphere lets the robot slide off; straight on, it is left with a snap."""
    solver = SpatialSolver(robot, Scene([Sphere(center=(40, 3, 150), radius=12)]))
    equilibrium, statuses = solver.rest(), []
    for pull in np.arange(0.25, 12.1, 0.25):
        equilibrium = solver.step(equilibrium, (pull, 0.0))
        statuses.append(equilibrium.status)
        assert equilibrium.gaps.min() > -1e-9
    assert Status.SNAPPED in statuses
    assert not equilibrium.contact.any()


def test_optimality_is_none_of_what_is_no_equilibrium(robot, walk):
    """A robot bent a little otherwise, or whose contacts push harder, than it should."""
    solver = SpatialSolver(robot, Scene([SPHERE]))
    pressed = walk(solver, ((k / 2, k / 5) for k in range(1, 17)))
    assert max(solver.optimality(pressed)) <= 1e-8
    places = pressed._layout
    for part, change in ((places.coordinates, 0.02), (places.multipliers, 1e-3)):
        block = pressed.block.copy()
        numbers = part(block)
        numbers[numbers != 0] += change
        made = replace(pressed, block=block)
        assert solver.optimality(made).stationarity >= 1e-5


def test_trace_ends_where_the_step_does(robot, walk):
    solver = SpatialSolver(robot, Scene([SPHERE]))
    equilibrium = walk(solver, ((k / 2, k / 5) for k in range(1, 10)))
    trace = solver.trace(equilibrium, (7.0, 2.0))
    for k, state in ((0, equilibrium), (-1, solver.step(equilibrium, (7.0, 2.0)))):
        assert np.all(trace.nodes[k] == state.nodes)
        assert trace.points[k] == pytest.approx(state.points, abs=1e-12)
        assert np.all(trace.displacements[k] == state.displacements)
    assert np.linalg.norm(np.diff(trace.nodes, axis=0), axis=-1).max() < 9


@pytest.mark.parametrize("threads", [1, 2])
def test_a_batch_is_many_solvers(robot, threads, random_solver, random_walk):
    generator = np.random.default_rng(3)
    solvers = []
    while len(solvers) < 24:
        solver = random_solver(generator, robot)
        if len(solver.scene) == 2:
            solvers.append(solver)
    walks = [random_walk(generator, solver, 40) for solver in solvers]
    batch = SpatialBatchSolver(robot, len(solvers), 2, threads)
    for index, solver in enumerate(solvers):
        batch.assign(index, solver.scene)
    batch.rest(range(len(solvers)))
    for k in range(1, 41):
        commands = np.array([states[k].cables_mm for states in walks])
        follow = [solver.step(batch.equilibrium(i), commands[i]) for i, solver in enumerate(solvers)]
        batch.step(commands)
        for index, equilibrium in enumerate(follow):
            assert np.array_equal(batch.blocks[index], equilibrium.block, equal_nan=True)
            assert batch.statuses[index] == equilibrium.status


def test_a_pull_towards_a_sphere_reaches_a_force(robot):
    batch = SpatialBatchSolver(robot, 2, 1)
    for index in range(2):
        batch.assign(index, Scene([SPHERE]))
    towards = np.array([[0.91, 0.41], [-0.91, -0.41]])
    found, forces = batch.ramp_reaches_force([0, 1], np.array([0.01, 0.01]), 0.5, 10.0, towards)
    assert list(found) == [True, False]
    assert list(np.linalg.norm(forces, axis=1) >= 0.01) == [True, False]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SpatialRobot.prototype(model="paper", angle=math.pi), "angle is"),
        (lambda: SpatialRobot(model="paper", length_mm=180, segments=1, offset_mm=8), "segments is 1"),
        (
            lambda: SpatialRobot(model="paper", length_mm=180, segments=18, offset_mm=8, max_cable_mm=300),
            "max_cable_mm is 300",
        ),
        (
            lambda: SpatialRobot(model="paper", length_mm=180, segments=18, offset_mm=8, max_tension=0),
            "max_tension is 0",
        ),
        (lambda: SpatialRobot(model="paper", length_mm=180, segments=18, offset_mm=8, touch=("cable",)), "touch is"),
        (lambda: SpatialRobot(model="paper", length_mm=180, segments=18, offset_mm=8, rim_points=2), "rim_points is 2"),
        (lambda: SpatialRobot(model="paper", length_mm=180, segments=18, offset_mm=8, between=-1), "between is -1"),
        (lambda: Sphere(center=(1, 2, math.inf), radius=3), "center is"),
        (lambda: Sphere(center=(1, 2), radius=3), "three coordinates"),
        (lambda: Sphere(center=(1, 2, 3), radius=3, spring=((1, 0), (0, 1))), "of three rows"),
        (lambda: HalfSpace(point=(1, 2, 3), normal=(0, 0, 0)), "normal is"),
        (lambda: Cylinder(start=(1, 2, 3), end=(1, 2, 9), radius=3, edge=4), "edge is 4"),
        (lambda: Cylinder(start=(1, 2, 3), end=(1, 2, 3), radius=3), "start and end"),
        (lambda: Box(center=(1, 2, 3), sizes=(5, 5, 1), edge=1), "edge is 1"),
        (lambda: Box(center=(1, 2, 3), sizes=(5, 5, 5), second=(2, 0, 0)), "second is"),
        (
            lambda: SpatialSolver(SpatialRobot.prototype(model="paper"), Scene([Circle(center=(40, 90), radius=9)])),
            "of the plane",
        ),
        (lambda: Scene([Circle(center=(40, 90), radius=9), SPHERE]), "some of the plane"),
        (
            lambda: SpatialSolver(
                SpatialRobot.prototype(model="paper"), Scene([Sphere(center=(10, 0, 90), radius=12)])
            ),
            "overlaps the unstressed robot",
        ),
        (
            lambda: SpatialSolver(SpatialRobot.prototype(model="paper"), Scene([Sphere(center=(40, 0, 90), radius=3)])),
            "could slip between points",
        ),
    ],
)
def test_what_it_refuses(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize("cables", [(1.0, 99.0), (1.0,), (math.nan, 0.0)])
def test_commands_it_refuses(robot, cables):
    solver = SpatialSolver(robot, Scene())
    with pytest.raises(ValueError, match="cables_mm is"):
        solver.step(solver.rest(), cables)
    with pytest.raises(ValueError, match="another scene"):
        solver.step(SpatialSolver(robot, Scene([SPHERE])).rest(), (1.0, 1.0))
