"""Slopes of the steps of a batch in their commands, and what they are at events."""

import math
from dataclasses import replace

import numpy as np
import pytest

from solver import BatchSolver, Cable, Circle, ReferenceBatch, Robot, Scene, Solver, Status
from solver.common.batch_slopes import PARTS
from solver.spatial import SpatialBatchSolver, SpatialRobot, Sphere

ROD = Robot.prototype(between=1)
PAPER = replace(ROD, model="paper")
SPACE = SpatialRobot.prototype(between=1)
CIRCLES = [Circle(center=(44, 104), radius=15), Circle(center=(70, 150), radius=10, spring=1.0)]
SPHERES = [Sphere(center=(40, 18, 104), radius=15), Sphere(center=(60, 20, 150), radius=10, spring=1.0)]
AROUND = tuple(Cable(angle=angle) for angle in (0.3, 2.4, 4.5))
OPPOSING = (Cable(), Cable(angle=math.pi))
CASES = {
    "paper": (PAPER, CIRCLES, [7.0]),
    "rod": (ROD, CIRCLES, [9.0]),
    "pair": (replace(ROD, cables=OPPOSING, weight_per_length=(2e-4, -1e-4)), CIRCLES, [9.0, -9.0]),
    "space": (replace(SPACE, model="paper"), SPHERES, [6.0, 2.4]),
    "space rod": (replace(SPACE, cables=AROUND, weight_per_length=(0.0, 1e-4, -2e-4)), SPHERES, [9.0, -8.0, -8.0]),
}


def make_batch(kind, count=6, threads=1):
    robot, obstacles, goal = CASES[kind]
    batch = (BatchSolver if isinstance(robot, Robot) else SpatialBatchSolver)(robot, count, len(obstacles), threads)
    for index in range(count):
        batch.assign(index, Scene(obstacle.shifted(0.3 * index * np.eye(batch.space)[0]) for obstacle in obstacles))
    batch.rest(range(count))
    return batch, np.array(goal)


def commands(batch, goal, part):
    rows = np.tile(part * goal, (batch.count, 1))
    return rows[:, 0] if batch.cables == 1 else rows


def check_rows(slopes, exact, rows, robots=slice(None)):
    for name in PARTS:
        found, expected = getattr(slopes, name)[slopes.found], getattr(exact, name)[robots, :rows][slopes.found]
        assert found.shape == expected.shape
        assert found == pytest.approx(expected, rel=0, abs=1e-10 * np.abs(expected).max(initial=0)), name


@pytest.mark.parametrize("kind", CASES)
def test_slopes_of_steps_are_those_of_where_they_end(kind):
    batch, goal = make_batch(kind, threads=2)
    other, _ = make_batch(kind)
    touched = 0
    for part in np.linspace(0, 1, 31)[1:]:
        slopes = batch.step(commands(batch, goal, part), derivatives=True)
        assert other.step(commands(batch, goal, part)) is None
        assert np.array_equal(batch.blocks, other.blocks)
        assert np.array_equal(slopes.found, batch.statuses == Status.CONVERGED)
        check_rows(slopes, batch.slopes(), batch.cables)
        touched += np.count_nonzero(slopes.forces.any(axis=(1, 2, 3)))
        assert not slopes.clearance[slopes.forces.any(axis=(1, 2, 3))].any()
    assert touched > 30


@pytest.mark.parametrize("kind", ["rod", "space"])
def test_slopes_of_some_robots_while_the_obstacles_of_a_few_move(kind):
    batch, goal = make_batch(kind)
    for part in np.linspace(0, 1, 31)[1:]:
        batch.step(commands(batch, goal, part))
    robots = [4, 0, 5, 2]
    way = 0.2 * np.eye(batch.space)[0]
    scenes = [Scene(o.shifted(way * (robot in (0, 2))) for o in batch.scene(robot)) for robot in robots]
    slopes = batch.step(commands(batch, goal, 1.01)[robots], robots, scenes, derivatives=True)
    assert slopes.found.all()
    check_rows(slopes, batch.slopes(), batch.cables, robots)
    assert np.array_equal(slopes.statuses, batch.statuses[robots])


def test_moves_have_slopes_in_the_length_too():
    robot = replace(PAPER, length_range_mm=(170, 190))
    batch = BatchSolver(robot, 3, 1)
    for index in range(3):
        batch.assign(index, Scene([Circle(center=(44 + index, 104), radius=15)]))
    batch.rest(range(3))
    for part in np.linspace(0, 1, 31)[1:]:
        batch.commands[:] = 7 * part, 180 + part
        slopes = batch.move(slice(None), derivatives=True)
        some = batch.move([2, 0], derivatives=True)
    assert slopes.found.all()
    assert slopes.nodes.shape == (3, 2, 19, 3)
    check_rows(slopes, batch.slopes(), 2)
    check_rows(some, batch.slopes(), 2, [2, 0])


def test_the_clearance_has_slopes():
    batch = BatchSolver(ROD, 1, 2)
    batch.assign(0, Scene([Circle(center=(90, 104), radius=15), Circle(center=(70, 20), radius=5)]))
    batch.rest([0])
    slope = batch.step(np.array([4.0]), derivatives=True).clearance[0, 0]
    gaps = []
    for cable in (3.99, 4.01):
        batch.step(np.array([cable]))
        gaps.append(batch.equilibrium(0).gaps.min())
    assert slope == pytest.approx((gaps[1] - gaps[0]) / 0.02, rel=1e-5)
    assert slope < -1


def pulled(robot, circle, cables):
    batch = BatchSolver(robot, 1, 1)
    batch.assign(0, Scene([circle]))
    batch.rest([0])
    return [batch.step(np.array([cable]), derivatives=True) for cable in cables]


@pytest.mark.parametrize(
    ("status", "robot", "circle", "most"),
    [
        (Status.STALLED, replace(ROD, max_tension=5), Circle(center=(44, 104), radius=15), 14.0),
        (Status.STALLED, replace(PAPER, max_tension=5), Circle(center=(44, 104), radius=15), 14.0),
        (Status.SNAPPED, ROD, Circle(center=(33, 165), radius=10), 14.0),
    ],
)
def test_steps_that_did_not_converge_have_none(status, robot, circle, most):
    steps = pulled(robot, circle, np.linspace(0, most, 60)[1:])
    met = [step for step in steps if step.statuses[0] == status]
    assert met
    for step in met:
        assert not step.found[0]
        assert not any(getattr(step, name).any() for name in (*PARTS, "clearance"))
    assert all(step.found[0] for step in steps if step.statuses[0] == Status.CONVERGED)


def one_sided(solver, here, sign, step=2e-3):
    """Slopes of nodes, tension and force by a difference to one side, exact for parabolas."""

    def outputs(state):
        return np.concatenate([state.nodes.ravel(), state.tensions, state.forces.ravel()])

    near = [outputs(solver.step(here, here.cable_mm + sign * k * step)) for k in (1, 2)]
    return sign * (4 * near[0] - near[1] - 3 * outputs(here)) / (2 * step)


@pytest.mark.parametrize("robot", [PAPER, ROD], ids=["paper", "rod"])
@pytest.mark.parametrize("sign", [1, -1], ids=["closes", "opens"])
def test_slopes_at_a_contact_that_comes_or_goes_are_those_ahead(robot, sign):
    circle = Circle(center=(44, 104), radius=15)
    solver = Solver(robot, Scene([circle]))
    free, touching = 2.0, 6.0
    for _ in range(60):
        middle = (free + touching) / 2
        reached = solver.step(solver.step(solver.rest(), 2.0), middle)
        free, touching = (free, middle) if reached.contact.any() else (middle, touching)
    slopes = pulled(robot, circle, [2.0, touching + 0.2, touching] if sign < 0 else [2.0, touching])[-1]
    assert slopes.found[0]
    here = solver.step(solver.step(solver.rest(), 2.0), touching)
    found = np.concatenate([slopes.nodes[0, 0].ravel(), slopes.tensions[0, 0], slopes.forces[0, 0].ravel()])
    expected = one_sided(solver, here, sign)
    assert found == pytest.approx(expected, rel=0, abs=1e-4 * np.abs(expected).max())
    assert np.abs(slopes.forces).max() > 1e-3 if sign > 0 else np.abs(slopes.forces).max() < 1e-9
    other = one_sided(solver, here, -sign)
    assert np.abs(other - expected).max() > 1e-2  # the sides differ


@pytest.mark.parametrize("robot", [PAPER, ROD], ids=["paper", "rod"])
def test_a_cable_at_its_least_displacement_counts_as_pulled(robot):
    far = Circle(center=(100, 104), radius=15)
    *_, released = pulled(robot, far, [1.0, 0.0])
    stayed, again = pulled(robot, far, [0.0, 0.0])
    (barely,) = pulled(robot, far, [1e-5])
    for slopes in (released, stayed, again):
        assert slopes.found[0]
        assert slopes.nodes == pytest.approx(barely.nodes, rel=1e-4, abs=1e-4)
        assert slopes.tensions == pytest.approx(barely.tensions, rel=1e-4)


def test_a_cable_that_contacts_keep_from_being_slackened_does_not_follow():
    steps = pulled(PAPER, Circle(center=(20.1, 104), radius=12), [1.0, 0.0])
    assert steps[0].nodes.any()
    assert steps[1].found[0]
    assert not steps[1].nodes.any()


def test_reference_batches_refuse():
    batch = ReferenceBatch(PAPER, 1, 0)
    batch.assign(0, Scene())
    batch.rest([0])
    with pytest.raises(ValueError, match="a ReferenceBatch has no derivatives of its steps; use a BatchSolver"):
        batch.step(np.array([1.0]), derivatives=True)
    assert batch.commands[0, 0] == 0
