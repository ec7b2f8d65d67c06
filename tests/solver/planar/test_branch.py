"""Where a branch ends: stall, block, snap and pretension."""

import math
from dataclasses import replace

import numpy as np
import pytest

from solver import Circle, HalfPlane, Robot, Scene, Solver, Status
from solver.planar.robot import LINES

BLOCKING = ((32.4, 84.7, 14.9), (57.6, 148.6, 14.3))
SLIPPERY = [
    ((41.3, 105.7, 13.9), (68.9, 140.5, 12.1)),
    ((50.3, 103.5, 11.7), (68.4, 145.9, 11.1)),
    ((35.7, 90.7, 15.6), (60.6, 144.4, 12.9)),
    ((37.7, 94.3, 11.0), (65.5, 149.7, 10.1)),
]


def certified(equilibrium):
    residuals = equilibrium.residuals()
    return max(residuals.stationarity, residuals.lengths, residuals.gaps, residuals.complementarity) <= 1e-8


def walk(solver, equilibrium, cables):
    for cable in cables:
        equilibrium = solver.step(equilibrium, cable)
        assert equilibrium.status is not Status.GAVE_UP
    return equilibrium


def test_stall(circles, pulls):
    robot = Robot.prototype(model="paper")
    solver = Solver(robot, circles(*BLOCKING))
    equilibrium = solver.rest()
    for cable in pulls(14.0, 0.25):
        equilibrium = solver.step(equilibrium, cable)
        assert equilibrium.tension <= robot.max_tension
    assert equilibrium.status is Status.STALLED
    assert equilibrium.tension == pytest.approx(robot.max_tension, rel=1e-5)
    assert certified(equilibrium)

    again = walk(solver, equilibrium, [14.0, 14.0])
    assert again.status is Status.STALLED
    assert again.cable_mm == equilibrium.cable_mm
    assert np.array_equal(again.nodes, equilibrium.nodes)


def test_release_from_a_stall(circles, pulls):
    solver = Solver(Robot.prototype(model="paper"), circles(*BLOCKING))
    stalled = walk(solver, solver.rest(), pulls(14.0, 0.25))
    released = walk(solver, stalled, np.arange(math.floor(stalled.cable_mm * 4), -1, -1) * 0.25)
    assert released.status is Status.CONVERGED
    assert released.cable_mm == 0
    assert np.array_equal(released.nodes, solver.rest().nodes)


def test_blocked(circles, pulls):
    solver = Solver(Robot.prototype(model="paper", max_tension=math.inf), circles(*BLOCKING))
    blocked = walk(solver, solver.rest(), pulls(14.0, 0.25))
    assert blocked.status is Status.BLOCKED
    assert 12 < blocked.cable_mm < 13
    assert certified(blocked)
    released = walk(solver, blocked, [12.0])
    assert released.status in (Status.CONVERGED, Status.SNAPPED)
    assert released.cable_mm == 12.0
    assert certified(released)


@pytest.mark.parametrize("step", [0.25, 5.0])
@pytest.mark.parametrize("pair", SLIPPERY)
def test_snap(pair, step, circles, pulls, swept, clearance):
    scene = circles(*pair)
    robot = Robot.prototype(model="paper", max_tension=math.inf)
    solver = Solver(robot, scene)
    equilibrium, statuses = solver.rest(), []
    for cable in [*pulls(14.0, step), 14.0]:
        shapes = solver.trace(equilibrium, cable).nodes
        equilibrium = solver.step(equilibrium, cable)
        statuses.append(equilibrium.status)
        assert np.array_equal(shapes[-1], equilibrium.nodes)
        assert clearance(shapes, robot, scene).min() >= -1e-6
        assert not swept(shapes, robot, scene).any()
        assert np.linalg.norm(np.diff(shapes[..., :2], axis=0), axis=-1).max(initial=0) <= 0.5 + 16 * min(step, 0.5)
        assert certified(equilibrium)
    if step < 1:  # a large step that is blocked after its snap reports that
        assert Status.SNAPPED in statuses


def test_large_increments_do_not_sweep(random_scene, swept, clearance):
    generator, robot = np.random.default_rng(7), Robot.prototype(model="paper")
    for _ in range(60):
        scene = random_scene(generator)
        solver = Solver(robot, scene)
        equilibrium = solver.rest()
        for change in generator.choice([-5.0, 5.0], 6, p=[0.3, 0.7]):
            cable = float(np.clip(equilibrium.cable_mm + change, 0, 14))
            shapes = solver.trace(equilibrium, cable).nodes
            equilibrium = solver.step(equilibrium, cable)
            assert equilibrium.status is not Status.GAVE_UP
            assert clearance(shapes, robot, scene).min() >= -1e-6
            assert not swept(shapes, robot, scene).any()


def test_touching_robot_keeps_its_pretension():
    solver = Solver(Robot.prototype(model="paper"), Scene([HalfPlane(point=(8.001, 0), normal=(-1, 0))]))
    pulled = walk(solver, solver.rest(), [0.5])
    assert pulled.contact.any()
    slack = walk(solver, pulled, [0.0])
    assert slack.status is Status.CONVERGED
    assert slack.cable_mm == pytest.approx(0.05, abs=1e-12)
    assert walk(solver, slack, [0.5]).status is Status.CONVERGED


def test_trace_begins_and_ends_with_the_equilibria_of_the_step():
    robot = replace(Robot.prototype(model="paper"), touch=LINES, between=1)
    solver = Solver(robot, Scene([Circle(center=(33, 89), radius=12.5, spring=0.5)]))
    before = walk(solver, solver.rest(), [3.0, 6.0])
    after, trace = solver.step(before, 9.0), solver.trace(before, 9.0)
    assert after.displacements.any()
    for k, state in ((0, before), (-1, after)):
        assert np.array_equal(trace.nodes[k], state.nodes)
        assert trace.points[k] == pytest.approx(state.points, abs=1e-12)
        assert np.array_equal(trace.displacements[k], state.displacements)
    assert len(trace.nodes) == len(trace.points) == len(trace.displacements) > 4


def test_steps_are_pure(circles):
    scene = circles(*BLOCKING)
    solver, other = (Solver(Robot.prototype(model="paper"), scene) for _ in range(2))
    equilibrium = walk(solver, solver.rest(), [3.0, 6.0])
    block = equilibrium.block.copy()
    first = solver.step(equilibrium, 9.0)
    walk(solver, solver.rest(), [12.0, 1.0])
    assert np.array_equal(solver.step(equilibrium, 9.0).block, first.block)
    assert np.array_equal(other.step(equilibrium, 9.0).block, first.block)
    assert np.array_equal(equilibrium.block, block)


def test_an_equilibrium_serves_equal_solvers():
    scene = Scene([Circle(center=(33, 89), radius=12.5)])
    equilibrium = Solver(Robot.prototype(model="paper"), scene).rest()
    assert Solver(Robot.prototype(model="paper"), Scene(list(scene))).step(equilibrium, 2.0).status is Status.CONVERGED


def test_far_obstacles_change_nothing(circles):
    """Those out of reach are passed over on the way, and measured in the answer."""
    near, far = BLOCKING[:1], [(60 + 12 * k, -30 - 5 * k, 6.0) for k in range(31)]
    alone, crowded = (
        Solver(Robot.prototype(model="paper"), circles(*obstacles)) for obstacles in (near, (*near, *far))
    )
    one, many = alone.rest(), crowded.rest()
    for cable in (4.0, 8.0, 11.0, 9.0):
        one, many = alone.step(one, cable), crowded.step(many, cable)
        assert one.contact.any()
        assert np.array_equal(one.nodes, many.nodes)
        assert np.array_equal(one.multipliers[0], many.multipliers[0])
        points = np.stack([many.nodes[:, :2], many.cable_nodes])
        assert many.gaps == pytest.approx(np.array([obstacle.gap(points) for obstacle in many.scene]), rel=1e-12)


@pytest.mark.parametrize("touch", [("backbone", "cable"), ("backbone", "cable", "rim")])
@pytest.mark.parametrize("center", [(30, 120), (45, 150), (60, 110), (24, 70)])
def test_a_thin_peg_does_not_slip_between_nodes(center, touch, circles, pulls, swept):
    peg = circles((*center, 0.5))
    coarse = {"model": "paper", "length_mm": 180.0, "segments": 10, "offset_mm": 8.0, "touch": touch}
    with pytest.raises(ValueError, match=r"radius 0.5 mm; it could slip between points .* between=(18|27) or more"):
        Solver(Robot(**coarse), peg)
    robot = Robot(**coarse, between=29)
    solver = Solver(robot, peg)
    equilibrium, touched = solver.rest(), False
    for cable in [*pulls(14.0, 0.5), *(14.0 - np.array(list(pulls(10.0, 0.5))))]:
        shapes = solver.trace(equilibrium, cable).nodes
        equilibrium = solver.step(equilibrium, cable)
        touched |= equilibrium.contact.any()
        assert equilibrium.status in (Status.CONVERGED, Status.SNAPPED, Status.STALLED)
        assert equilibrium.gaps.min() >= -1e-6
        assert not swept(shapes, robot, peg).any()
        assert certified(equilibrium)
    assert touched


def test_lines_that_touch():
    """Gaps of a wall 20 mm behind the straight robot, to each line of points alone."""
    wall = Scene([HalfPlane(point=(-20, 0), normal=(1, 0))])
    for line, gap in (("backbone", 20.0), ("cable", 28.0), ("rim", 12.0)):
        robot = Robot(model="paper", length_mm=180, segments=18, offset_mm=8, touch=(line,), between=2)
        rest = Solver(robot, wall).rest()
        assert rest.gaps.shape == (1, 1, 55)
        assert rest.gaps == pytest.approx(gap)
        assert rest.points[0, :, 1] == pytest.approx(np.linspace(0, 180, 55))


def test_motor_yields_where_a_release_snaps_to_more_tension_than_it_holds(pulls):
    wall = HalfPlane(point=(54.9, 116.64), normal=(-0.81685, -0.57684))
    robot = Robot(model="paper", length_mm=180, segments=18, offset_mm=8, touch=LINES, between=3)
    solver = Solver(robot, Scene([wall, Circle(center=(50.24, 112.21), radius=10.99)]))
    hooked = walk(solver, solver.rest(), pulls(12.75, 0.25))
    released = solver.step(hooked, hooked.cable_mm - 0.1)
    assert released.status is Status.STALLED
    assert released.cable_mm < hooked.cable_mm - 0.1
    assert released.tension <= robot.max_tension
    assert certified(released)


@pytest.mark.parametrize(("x", "release"), [(67.05, 0.03), (67.1, 0.1), (67.4, 0.31)])
def test_a_tip_that_rolls_onto_a_circle_is_not_taken_for_blocked(x, release):
    """Two gaps close at the end of the descent, which costs more energy than is left to win."""
    robot = replace(Robot.prototype(model="paper"), model="rod")
    solver = Solver(robot, Scene([Circle(center=(x, 132.6), radius=13.7)]))
    state = walk(solver, solver.rest(), np.arange(0.5, 12, 0.5).tolist())
    statuses = set()
    for cable in np.arange(state.cable_mm - release, 11.0, -release):
        state = solver.step(state, float(cable))
        statuses.add(state.status)
    assert Status.SNAPPED in statuses
    assert statuses <= {Status.CONVERGED, Status.SNAPPED}
    assert certified(state)


SMALL_SNAPS = [  # cable, circles, where the step of 0.5 mm begins and ends [mm]
    ("rod", ((61.960395, 140.412247, 11.092004), (45.735903, 82.051608, 10.097247)), 10.5, 10.0),
    (
        "paper",
        ((56.417880, 127.799052, 15.862201), (72.076162, 144.512886, 12.462216), (56.428765, 80.038946, 10.286344)),
        11.0,
        11.5,
    ),
]


@pytest.mark.parametrize(("model", "obstacles", "start", "end"), SMALL_SNAPS, ids=["released", "pulled"])
def test_a_small_snap_within_a_step_is_told(model, obstacles, start, end, circles, pulls):
    """Of 1.4 and 2.4 mm, no more than the robot moves along its branch in the same step."""
    solver = Solver(replace(Robot.prototype(model="paper"), model=model), circles(*obstacles))
    before = walk(solver, solver.rest(), pulls(start, 0.5))
    fine, statuses = before, set()
    for part in np.linspace(start, end, 101)[1:]:
        after = solver.step(fine, float(part))
        statuses.add(after.status)
        fine = after
    assert Status.SNAPPED in statuses
    coarse = solver.step(before, end)
    assert coarse.status is Status.SNAPPED
    assert coarse.nodes == pytest.approx(fine.nodes, abs=1e-8)


@pytest.mark.parametrize("model", ["paper", "rod"])
def test_a_large_step_ends_where_small_ones_do(model, random_scene):
    generator = np.random.default_rng(11)
    for _ in range(12):
        solver = Solver(replace(Robot.prototype(model="paper"), model=model), random_scene(generator))
        equilibrium = solver.rest()
        for change in generator.choice([-0.5, 0.5], 24, p=[0.3, 0.7]):
            cable_mm = float(np.clip(equilibrium.cable_mm + change, 0, 14))
            fine = walk(solver, equilibrium, np.linspace(equilibrium.cable_mm, cable_mm, 26)[1:].tolist())
            equilibrium = solver.step(equilibrium, cable_mm)
            assert equilibrium.nodes == pytest.approx(fine.nodes, abs=1e-6)
