"""Whatever is passed to a public entry: a finite result, or a ValueError or TypeError, never anything else."""

import math
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from solver import (
    Capsule,
    Circle,
    Custom,
    Ellipse,
    Equilibrium,
    Family,
    HalfPlane,
    Polygon,
    ReferenceSolver,
    Robot,
    Scene,
    Sensitivity,
    Solver,
    Status,
    spatial,
)
from solver.cache.memo import TransitionMemo
from solver.planar import forces, free
from solver.planar.batch import BatchSolver
from solver.planar.sensitivity import sensitivity
from solver.spatial import SpatialBatchSolver, SpatialEquilibrium, SpatialRobot, SpatialSensitivity, SpatialSolver
from solver.spatial import forces as spatial_forces
from solver.spatial.sensitivity import spatial_sensitivity

ROBOT = Robot(model="paper", length_mm=180, segments=6, offset_mm=8, between=2, length_range_mm=(150, 200))
SPATIAL_ROBOT = SpatialRobot(model="paper", length_mm=180, segments=6, offset_mm=8, between=2)
SCENE = Scene([Circle(center=(50, 110), radius=18)])
SPATIAL_SCENE = Scene([spatial.Sphere(center=(50, 0, 110), radius=18)])
SOLVER, SPATIAL_SOLVER = Solver(ROBOT, SCENE), SpatialSolver(SPATIAL_ROBOT, SPATIAL_SCENE)
REFERENCE, MEMO = ReferenceSolver(ROBOT, SCENE), TransitionMemo(SOLVER)
PULLED = SOLVER.step(SOLVER.rest(), 7.0)
SPATIAL_PULLED = SPATIAL_SOLVER.step(SPATIAL_SOLVER.rest(), (7.0, 1.0))
OVAL = Family.trace(lambda point, sizes: (point[0] / sizes[0]) ** 2 + (point[1] / sizes[1]) ** 2 - 1, sizes=2)

NUMBERS = st.sampled_from(
    [
        *(0, 1, -1, 3, 0.5, -0.0, 7.25, 18, 60.0, 180, 1e3, 1e5, 1e12, 1e155, 1.7e308, 1e-9, 1e-155, 1e-320, 10**400),
        *(math.nan, math.inf, -math.inf, True, None, "3", "", b"1", 1j, object, [], (), {}),
        *(np.float32(2.5), np.int64(4), np.bool_(True), np.float64(math.nan), np.array(2.0), np.array([1.0])),
        np.timedelta64(3, "s"),
    ]
)
JUNK = st.one_of(
    NUMBERS,
    st.lists(NUMBERS, max_size=4),
    st.lists(NUMBERS, min_size=2, max_size=3).map(tuple),
    st.lists(st.lists(NUMBERS, min_size=2, max_size=2), min_size=2, max_size=4),
    st.sampled_from(
        [ROBOT, SPATIAL_ROBOT, SCENE, SPATIAL_SCENE, PULLED, SPATIAL_PULLED, OVAL, SOLVER, range(3), {1, 2}]
    ),
    st.sampled_from(
        [np.zeros(3), np.full(2, math.nan), np.zeros((2, 2), complex), np.array(["a"]), np.ones((1, 2), int)]
    ),
)
OBSTACLES = [
    (Circle, {"center": (50, 110), "radius": 18}),
    (HalfPlane, {"point": (50, 0), "normal": (-1, 0)}),
    (Ellipse, {"center": (60, 110), "radii": (18, 30), "axis": (1, 2)}),
    (Capsule, {"start": (50, 110), "end": (80, 120), "radius": 18}),
    (Polygon, {"corners": ((50, 80), (80, 80), (60, 120)), "radius": 16}),
    (Custom, {"family": OVAL, "sizes": (20, 25), "center": (60, 110), "axis": (1, 0), "reach": 30}),
    (spatial.Sphere, {"center": (50, 0, 110), "radius": 18}),
    (spatial.HalfSpace, {"point": (50, 0, 0), "normal": (-1, 0, 0)}),
    (spatial.Capsule, {"start": (50, -30, 110), "end": (50, 30, 120), "radius": 18}),
    (spatial.Cylinder, {"start": (50, -30, 110), "end": (50, 30, 120), "radius": 18, "edge": 2.0}),
    (spatial.Box, {"center": (60, 0, 110), "sizes": (40, 45, 50), "edge": 3, "axis": (1, 0, 0), "second": (0, 1, 1)}),
]
ROBOTS = [
    (Robot, {"length_mm": 180, "segments": 6, "offset_mm": 8, "between": 2}),
    (SpatialRobot, {"length_mm": 180, "segments": 6, "offset_mm": 8, "between": 2}),
]
fuzz = settings(max_examples=200, suppress_health_check=list(HealthCheck))


def survives(call, *arguments, **named):
    """The result of a call, None where it refuses what it is given."""
    try:
        return call(*arguments, **named)
    except (ValueError, TypeError):
        return None


def check(equilibrium):
    if equilibrium is None:
        return
    assert isinstance(equilibrium, Equilibrium | SpatialEquilibrium)
    assert not np.isnan(equilibrium.block).any()
    for array in (equilibrium.nodes, equilibrium.multipliers, equilibrium.forces, equilibrium.displacements):
        assert np.isfinite(array).all()
    assert len(repr(equilibrium)) < 300


@st.composite
def changed(draw, known, kinds):
    """A class, and arguments one or two of which are junk."""
    kind, arguments = draw(st.sampled_from(kinds))
    names = draw(st.lists(st.sampled_from([*arguments, *known(kind)]), min_size=1, max_size=2, unique=True))
    return kind, {**arguments, **{name: draw(JUNK) for name in names}}


def names_of(kind):
    return [field.name for field in fields(kind)]


@fuzz
@given(changed(names_of, OBSTACLES))
@example((Circle, {"center": (1e155, 89), "radius": 9e154}))
def test_obstacles(case):
    kind, arguments = case
    obstacle = survives(kind, **arguments)
    if obstacle is None:
        return
    outline = obstacle.outline()
    assert np.isfinite(outline).all()
    assert np.isfinite(obstacle.gap(outline)).all()
    assert np.isfinite(obstacle.normal_at(outline)).all()
    scene = Scene([obstacle])
    made = Solver if obstacle.space == 2 else SpatialSolver
    solver = survives(made, ROBOT if obstacle.space == 2 else SPATIAL_ROBOT, scene)
    if solver is not None:
        check(solver.step(solver.rest(), 4.0 if obstacle.space == 2 else (4.0, -1.0)))


@fuzz
@given(st.sampled_from([SCENE.obstacles[0], SPATIAL_SCENE.obstacles[0]]), JUNK)
def test_methods_of_obstacles(obstacle, junk):
    for method in (obstacle.gap, obstacle.normal_at):
        result = survives(method, junk)
        assert result is None or np.isfinite(result).all()
    survives(obstacle.shifted, junk)
    survives(obstacle.touchable, junk)
    survives(Scene, junk)
    survives(Scene, [junk])
    survives(Family.trace, junk)
    survives(Family.trace, lambda *_: junk)
    survives(Family.trace, lambda point, _: point[0], junk)


@fuzz
@given(changed(names_of, ROBOTS))
@example((SpatialRobot, {"length_mm": 1e-320, "segments": 18, "offset_mm": 8}))
@example((Robot, {"length_mm": 180, "segments": 18, "offset_mm": 8, "rigidity": 1.7e308}))
def test_robots(case):
    kind, arguments = case
    robot = survives(kind, **arguments)
    if robot is None:
        return
    assert np.isfinite([robot.energy_scale, robot.rigidity / robot.length_mm**2, *robot.edges_mm]).all()
    assert np.isfinite(robot.lines_mm).all()
    if robot.positions > 2000:
        return
    solver = (Solver if kind is Robot else SpatialSolver)(robot, Scene())
    quarter = robot.cable_limit_mm / 4
    check(solver.step(solver.rest(), quarter if kind is Robot else (quarter, -quarter)))


@fuzz
@given(JUNK, JUNK, JUNK)
def test_planar_calls(first, second, third):
    for solver in (SOLVER, MEMO, REFERENCE):
        check(survives(solver.step, first, 1.0))
        check(survives(solver.step, solver.rest(), second))
        check(survives(solver.step, solver.rest(), 0.1, third))
    survives(SOLVER.trace, first, second, third)
    for kind in (Solver, ReferenceSolver):
        survives(kind, first, Scene())
        survives(kind, ROBOT, second)
    survives(TransitionMemo, first, second)
    survives(TransitionMemo, SOLVER, second)
    survives(ROBOT.at, first)
    survives(Robot.prototype, max_tension=first)
    survives(Robot.prototype, segments=second)


@fuzz
@given(JUNK, JUNK)
def test_spatial_calls(first, second):
    check(survives(SPATIAL_SOLVER.step, first, (1.0, 1.0)))
    check(survives(SPATIAL_SOLVER.step, SPATIAL_PULLED, second))
    survives(SPATIAL_SOLVER.trace, SPATIAL_PULLED, second)
    survives(SpatialSolver, first, Scene())
    survives(SpatialSolver, SPATIAL_ROBOT, second)
    survives(spatial.SpatialReferenceSolver, first, second)
    survives(SpatialRobot.prototype, angle=first)


@fuzz
@given(JUNK, JUNK, JUNK)
def test_functions(first, second, third):
    for function in (free.tip_slopes, free.free_angle, free.free_nodes, free.free_tension):
        for result in (survives(function, first, 1.0), survives(function, ROBOT, second)):
            assert result is None or np.isfinite(result).all()
    for result in (
        survives(free.tip_slopes, ROBOT, 1.0, third),
        survives(free.fitted_slopes, ROBOT, first, second),
        survives(free.fitted_slopes, ROBOT, 1.0, 2.0, third),
        survives(forces.force_true, first),
        survives(spatial_forces.force_true, first),
        survives(lambda: forces.VirtualWork(first, second).estimate(PULLED)),
        survives(lambda: forces.VirtualWork().estimate(third)),
        survives(lambda: spatial_forces.SpatialVirtualWork(first).estimate(SPATIAL_PULLED)),
        survives(lambda: spatial_forces.SpatialVirtualWork().estimate(third)),
        survives(lambda: forces.VirtualWork.calibrated(first, second, np.ones(3), 8.0).friction),
        survives(lambda: forces.VirtualWork.calibrated(1.0, 1.0, third, 8.0).friction),
        survives(lambda: forces.VirtualWork.calibrated(1.0, 1.0, np.ones(3), third).friction),
    ):
        assert result is None or np.isfinite(result).all()
    survives(free.clearance, first, SCENE, 0.0)
    survives(free.clearance, ROBOT, second, 0.0)
    survives(free.clearance, ROBOT, SCENE, third)
    survives(sensitivity, first)
    survives(sensitivity, PULLED, second)
    survives(Sensitivity.rows, first)
    survives(Sensitivity.rows(ROBOT).obstacle, third)
    survives(spatial_sensitivity, first)
    survives(spatial_sensitivity, SPATIAL_PULLED, second)
    survives(SpatialSensitivity.rows, first)
    survives(SpatialSensitivity.rows(SPATIAL_ROBOT).obstacle, third)


def make_batch(spatially):
    robot, scene = (SPATIAL_ROBOT, SPATIAL_SCENE) if spatially else (ROBOT, SCENE)
    batch = (SpatialBatchSolver if spatially else BatchSolver)(robot, 3, 1)
    for k in range(3):
        batch.assign(k, scene)
    batch.rest(range(3))
    return batch


BATCHES = {spatially: make_batch(spatially) for spatially in (False, True)}


@fuzz
@given(st.booleans(), JUNK, JUNK, JUNK)
def test_batches(spatially, first, second, third):
    batch = BATCHES[spatially]
    cables = np.ones((3, 2)) if spatially else np.ones(3)
    for call in (
        lambda: batch.assign(first, second),
        lambda: batch.assign(0, second),
        lambda: batch.assign_if_clear(first, second),
        lambda: batch.rest(first),
        lambda: batch.step(first),
        lambda: batch.step(cables[:1], second),
        lambda: batch.move(third),
        lambda: batch.move([first, second]),
        lambda: batch.probe(first),
        lambda: batch.scene(second),
        lambda: check(batch.equilibrium(third)),
        lambda: batch.ramp_reaches_force(first, [0.1], 0.5, 8.0),
        lambda: batch.ramp_reaches_force([1], first, 0.5, 8.0),
        lambda: batch.ramp_reaches_force([1], [0.1], first, second),
        lambda: batch.ramp_reaches_force([1], [0.1], 0.5, 8.0, third),
        lambda: batch.ramp_reaches_force([1], [0.1], 0.5, 8.0, None, third),
        lambda: type(batch)(first, 2, 1),
        lambda: type(batch)(batch.robot, first, 1),
        lambda: type(batch)(batch.robot, 2, second),
        lambda: type(batch)(batch.robot, 2, 1, third),
    ):
        survives(call)
    assert not np.isnan(batch.blocks).any()
    assert (batch.blocks[:, batch.layout.clearance.at] >= -1e-9).all()


@fuzz
@given(st.booleans(), st.integers(0, 2**31), NUMBERS, JUNK, JUNK)
def test_blocks(spatially, place, number, junk, other):
    solver, pulled = (SPATIAL_SOLVER, SPATIAL_PULLED) if spatially else (SOLVER, PULLED)
    kind, block = type(pulled), pulled.block.copy()
    survives(kind, pulled.robot, pulled.scene, junk, Status.CONVERGED, 0)
    survives(kind, junk, other, block.copy(), Status.CONVERGED, 0)
    survives(kind, pulled.robot, pulled.scene, block.copy(), junk, other)
    try:
        block[place % (6 if place % 2 else block.size)] = number
    except (TypeError, ValueError, OverflowError):
        return
    start = survives(kind, pulled.robot, pulled.scene, block, Status.CONVERGED, 0)
    if start is not None:
        survives(solver.step, start, (5.0, 0.5) if spatially else 5.0)


@pytest.mark.parametrize("spatially", [False, True])
@pytest.mark.parametrize("length", [-1.0, 0.0, math.nan, math.inf, 1e300])
def test_a_length_written_into_a_batch(spatially, length):
    batch = make_batch(spatially)
    batch.blocks[1, batch.layout.length.at] = length
    with pytest.raises(ValueError, match=r"lengths in blocks are .*; all must be from 1.0 to .*: call rest\(robots\)"):
        batch.step(np.ones((3, 2)) if spatially else np.ones(3))
    batch.rest([1])
    batch.step(np.ones((3, 2)) if spatially else np.ones(3))
