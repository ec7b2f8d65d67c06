"""Slopes that the kernel finds, against the dense optimality conditions and against differences of its own steps."""

import math
from dataclasses import replace

import numpy as np
import pytest
from soak.scenes import MODELS, sample_setting
from soak.walks import sample_increments, walk

from solver import BatchSolver, Cable, Circle, HalfPlane, Robot, Scene, Solver, Status, sensitivity
from solver.planar import sensitivity as planar
from solver.planar.robot import LINES
from solver.spatial import SpatialBatchSolver, SpatialRobot, SpatialSolver, Sphere, spatial_sensitivity
from solver.spatial import sensitivity as spatial

BRINK = 100.0  # largest slope of a node, beyond which a robot is about to snap or locked by its cables
PLANE = Robot.prototype(between=1)
SPACE = SpatialRobot.prototype(between=1)
CIRCLES = [Circle(center=(44, 104), radius=15), Circle(center=(70, 150), radius=10, spring=1.0)]
SPHERES = [Sphere(center=(40, 18, 104), radius=15), Sphere(center=(60, 20, 150), radius=10, spring=1.0)]
TRIPLE = tuple(Cable(angle=angle) for angle in (0.3, 2.4, 4.5))


def dense(equilibrium):
    in_plane = isinstance(equilibrium.robot, Robot)
    return (planar.dense_sensitivity if in_plane else spatial.dense_spatial_sensitivity)(equilibrium)


def kernel(equilibrium):
    """The kernel's slopes by name, None where it finds none."""
    in_plane = isinstance(equilibrium.robot, Robot)
    parts = (planar._kernel_slopes if in_plane else spatial._kernel_slopes)(equilibrium)
    names = (planar.Sensitivity if in_plane else spatial.SpatialSensitivity).__slots__
    return parts and dict(zip(names, parts, strict=True))


def compare(equilibrium, slopes, exact=None):
    exact = exact or dense(equilibrium)
    for name, found in slopes.items():
        expected = getattr(exact, name)
        assert found.shape == expected.shape
        assert found == pytest.approx(expected, rel=0, abs=1e-15 + 1e-9 * np.abs(expected).max(initial=0)), name


def is_comparable(equilibrium):
    """The paper's model needs a pull that determines its shear; the dense conditions know no contacts of the base."""
    robot = equilibrium.robot
    pulled = robot.model == "rod" or np.abs(equilibrium.cables_mm).max() > 0.1 * robot.offset_mm
    return pulled and equilibrium.status != Status.GAVE_UP and not equilibrium.contact[:, :, 0].any()


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("seeds", [range(1), pytest.param(range(1, 20), marks=pytest.mark.long)], ids=["some", "many"])
def test_slopes_are_those_of_the_dense_conditions(model, seeds):
    compared = 0
    for seed in seeds:
        generator = np.random.default_rng([seed, MODELS.index(model)])
        setting = sample_setting(generator, model)
        states = walk(setting.solver, sample_increments(generator, setting.solver, setting.scale, 40)).states
        fit = list(filter(is_comparable, states))
        touching = [state for state in fit if state.contact.any()] or fit
        for k in generator.choice(len(touching), min(2, len(touching)), replace=False):
            slopes, exact = kernel(touching[k]), dense(touching[k])
            if slopes is not None and np.abs(exact.nodes).max() < BRINK:
                compare(touching[k], slopes, exact)
                compared += 1
    assert compared >= len(seeds)


@pytest.mark.parametrize(("radius", "thickness", "cable"), [(60.0, 0.0, 11.0), (40.0, 2.0, 15.0)])
@pytest.mark.parametrize("sign", [1, -1])
def test_disks_that_meet(radius, thickness, cable, sign):
    sizes = {"disk_radius_mm": radius, "disk_thickness_mm": thickness}
    robot = replace(PLANE, model="rod", segments=12, max_tension=1000, cables=(Cable(), Cable(angle=math.pi)), **sizes)
    robot = replace(robot, length_range_mm=(170, 190))
    solver = Solver(robot, Scene([Circle(center=(sign * 42, 143), radius=28)]))
    equilibrium = solver.rest()
    for part in np.linspace(0, cable, 31)[1:]:
        equilibrium = solver.step(equilibrium, (part, -1.5 * part) if sign > 0 else (-1.5 * part, part))
    assert equilibrium.disk_multipliers.any()
    assert equilibrium.contact.any()
    compare(equilibrium, kernel(equilibrium))


def test_disks_that_meet_in_space():
    robot = replace(SPACE, model="rod", segments=12, max_tension=1000, disk_radius_mm=90.0, cables=TRIPLE)
    solver = SpatialSolver(robot, Scene([Sphere(center=(62, 16, 110), radius=28)]))
    equilibrium = solver.rest()
    for part in np.linspace(0, 20, 41)[1:]:
        equilibrium = solver.step(equilibrium, (part, -part, -part))
    assert equilibrium.disk_multipliers.any()
    assert equilibrium.contact.any()
    compare(equilibrium, kernel(equilibrium))


def outputs(equilibrium, slopes=None, row=None):
    """Everything that is differentiated but the turns of disks in space, or its slope."""
    of = equilibrium if slopes is None else slopes
    names = ("nodes", "multipliers", "tensions", "forces", "displacements")
    parts = [np.asarray(getattr(of, name))[() if slopes is None else row].ravel() for name in names]
    parts[1] = 1e3 * parts[1]
    return np.concatenate(parts)


def check_difference(equilibrium, slopes, row, moved, step=0.01):
    """By Richardson's extrapolation of central differences."""
    near = [moved(part * step) for part in (-2, -1, 1, 2)]
    assert all(np.array_equal(state.contact, equilibrium.contact) for state in near)
    assert all(np.array_equal(state.tensions > 0, equilibrium.tensions > 0) for state in near)
    far_back, back, ahead, far_ahead = map(outputs, near)
    difference = (8 * (ahead - back) - (far_ahead - far_back)) / (12 * step)
    found = outputs(equilibrium, slopes, row)
    assert found == pytest.approx(difference, rel=1e-6, abs=1e-6 * np.abs(difference).max())


CASES = {
    "paper": (replace(PLANE, model="paper", length_range_mm=(170, 190)), CIRCLES, [7.0]),
    "rod": (replace(PLANE, model="rod", length_range_mm=(170, 190)), CIRCLES, [9.0]),
    "loaded": (
        replace(
            PLANE, cables=(Cable(), Cable(angle=math.pi, end=9)), weight_per_length=(2e-4, -1e-4), precurvature=0.01
        ),
        CIRCLES,
        [9.0, -3.0],
    ),
    "space": (replace(SPACE, model="paper"), SPHERES, [6.0, 2.4]),
    "space rod": (replace(SPACE, cables=TRIPLE, weight_per_length=(0.0, 1e-4, -2e-4)), SPHERES, [9.0, -8.0, -8.0]),
}


@pytest.mark.parametrize("kind", CASES)
def test_slopes_are_differences_of_steps(kind):
    robot, obstacles, goal = CASES[kind]
    in_plane = isinstance(robot, Robot)
    solver = (Solver if in_plane else SpatialSolver)(robot, scene := Scene(obstacles))
    equilibrium, goal = solver.rest(), np.array(goal)
    for part in np.linspace(0, 1, 31)[1:]:
        equilibrium = solver.step(equilibrium, part * goal)
    assert equilibrium.contact.any()
    slopes = (sensitivity if in_plane else spatial_sensitivity)(equilibrium)
    rows = type(slopes).rows(robot)
    for row, change in enumerate(np.eye(len(goal))):
        check_difference(equilibrium, slopes, row, lambda by, one=change: solver.step(equilibrium, goal + by * one))
    if in_plane and robot.length_range_mm:
        check_difference(equilibrium, slopes, rows.length, lambda by: solver.step(equilibrium, goal, 180 + by))
    for j, obstacle in enumerate(obstacles):
        motions = [lambda o, by, k=k: o.shifted(by * np.eye(o.space)[k]) for k in range(obstacle.space)]
        ways = dict(enumerate(motions)) | {-1: lambda o, by: replace(o, radius=o.radius + by)}
        for motion, move in ways.items():
            scenes = lambda by, j=j, move=move: Scene(move(o, by) if i == j else o for i, o in enumerate(scene))  # noqa: E731
            row = range(len(slopes.nodes))[rows.obstacle(j)][motion]
            moved = lambda by, to=scenes: solver.step(equilibrium, goal, scene=to(by))  # noqa: E731
            check_difference(equilibrium, slopes, row, moved)


@pytest.mark.parametrize("kind", CASES)
def test_slopes_of_a_batch_are_those_of_the_robots(kind):
    robot, obstacles, goal = CASES[kind]
    in_plane, goal = isinstance(robot, Robot), np.array(goal)
    batch = (BatchSolver if in_plane else SpatialBatchSolver)(robot, 20, len(obstacles), threads=2)
    for index in range(batch.count):
        batch.assign(index, Scene(obstacle.shifted(0.1 * index * np.eye(batch.space)[0]) for obstacle in obstacles))
    batch.rest(range(batch.count))
    for part in np.linspace(0, 1, 31)[1:]:
        commands = np.tile(part * goal, (batch.count, 1))
        batch.step(commands[:, 0] if batch.cables == 1 else commands)
    slopes = batch.slopes()
    assert slopes.found.all()
    for index in range(batch.count):
        single = (sensitivity if in_plane else spatial_sensitivity)(batch.equilibrium(index))
        for name in type(single).__slots__:
            assert np.array_equal(getattr(slopes, name)[index], getattr(single, name)[: len(goal) + 1]), name
    some = batch.slopes([7, 2])
    assert all(np.array_equal(part, whole[[7, 2]]) for part, whole in zip(some, slopes, strict=True))


def test_a_batch_has_no_slopes_of_slack_robots():
    batch = BatchSolver(replace(PLANE, model="paper"), 2, 0)
    for index in range(2):
        batch.assign(index, Scene())
    batch.rest(range(2))
    batch.step(np.array([1.0]), [1])
    slopes = batch.slopes()
    assert slopes.found.tolist() == [False, True]
    assert not slopes.nodes[0].any()
    assert slopes.nodes[1].any()


def test_contacts_that_depend_on_each_other_are_refused():
    """Three points of a link all touch a wall where two do."""
    solver = Solver(replace(PLANE, touch=LINES), Scene([HalfPlane(point=(31, 127), normal=(-1, 0))]))
    equilibrium = solver.step(solver.rest(), 3.0)
    active = np.zeros_like(equilibrium.contact)
    active[0, 0, 20:23] = True
    with pytest.raises(ValueError, match="3 contacts that depend on each other; close fewer"):
        sensitivity(equilibrium, active)
    active[0, 0, 21] = False
    assert sensitivity(equilibrium, active).multipliers[:, active].any()


def test_cables_that_lock_a_robot_cannot_be_moved_alone():
    robot = replace(PLANE, cables=(Cable(), Cable(angle=math.pi)), max_tension=50.0)
    batch = BatchSolver(robot, 1, 0)
    batch.assign(0, Scene())
    batch.rest([0])
    batch.step(np.array([[0.5, 0.5]]))
    assert (batch.equilibrium(0).tensions > 10).all()
    assert kernel(batch.equilibrium(0)) is None
    assert not batch.slopes().found[0]
