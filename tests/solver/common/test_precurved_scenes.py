"""Solver and batch take the same scenes: those clear of the shape that the robot has where nothing strains it."""

import numpy as np
import pytest

from solver import BatchSolver, Circle, Load, ReferenceSolver, Robot, Scene, Solver, Status, spatial

CURVED = {
    "plane": Robot.prototype(precurvature=0.05, between=2),
    "plane, uneven": Robot.prototype(precurvature=tuple(np.linspace(-0.08, 0.05, 18).tolist()), between=2),
    "space": spatial.SpatialRobot.prototype(precurvature=(0.02, 0.04, 0.01), between=1),
    "space, uneven": spatial.SpatialRobot.prototype(
        precurvature=tuple((0.05, 0.01 * k, -0.03) for k in range(-9, 9)), between=1
    ),
}
EVERY_ROBOT = pytest.mark.parametrize("robot", CURVED.values(), ids=CURVED.keys())


def solvers(robot):
    """Solver, batch and shape of an obstacle of the robot's space."""
    if isinstance(robot, Robot):
        return Solver, BatchSolver, Circle
    return spatial.SpatialSolver, spatial.SpatialBatchSolver, spatial.Sphere


def tell(assign, *arguments):
    """What an assignment was refused with, if it was."""
    try:
        assign(*arguments)
    except ValueError as error:
        return str(error)
    return ""


@EVERY_ROBOT
def test_solver_and_batch_refuse_the_same_scenes_with_the_same_words(robot):
    solver, make_batch, shape = solvers(robot)
    batch, free = make_batch(robot, 1, 1), solver(robot, Scene()).rest()
    generator, refused = np.random.default_rng(3), []
    for _ in range(60):
        node = free.nodes[generator.integers(6, 19), : shape.space]
        center = node + generator.normal(size=shape.space) * generator.uniform(0.0, 30.0)
        scene = Scene([shape(center=tuple(center.tolist()), radius=generator.uniform(10.0, 16.0))])
        batch.assign_if_clear(0, Scene([shape(center=(*(200.0,) * (shape.space - 1), 50.0), radius=10.0)]))
        alone, side_by_side = tell(solver, robot, scene), tell(batch.assign, 0, scene)
        assert alone == side_by_side
        refused.append(bool(alone))
        if not alone:
            batch.rest([0])
            assert batch.statuses[0] == Status.CONVERGED
            assert batch.equilibrium(0).gaps.min() >= 0
    assert 0.15 < np.mean(refused) < 0.85


@EVERY_ROBOT
def test_obstacles_on_the_straight_line_are_clear_of_a_curved_robot(robot):
    solver, make_batch, shape = solvers(robot)
    straight = np.zeros(shape.space)
    straight[-1] = 175.0
    scene = Scene([shape(center=tuple(straight.tolist()), radius=10.0)])
    assert solver(robot, scene).rest().gaps.min() > 0
    batch = make_batch(robot, 1, 1)
    batch.assign(0, scene)
    batch.rest([0])
    assert np.array_equal(batch.blocks[0], solver(robot, scene).rest().block)


def test_what_loads_press_a_robot_against_is_met_in_both():
    robot = Robot.prototype(loads=(Load(node=18, force=(0.15, 0.0)),), between=1)
    tip = Solver(robot, Scene()).rest().nodes[-1, :2]
    scene = Scene([Circle(center=(tip[0] + 8.0, tip[1] - 20.0), radius=12.0)])
    alone = Solver(robot, scene).rest()
    batch = BatchSolver(robot, 1, 1)
    batch.assign(0, scene)
    batch.rest([0])
    assert alone.contact.any()
    assert np.array_equal(batch.blocks[0], alone.block)
    assert ReferenceSolver(robot, scene).rest().nodes == pytest.approx(alone.nodes, abs=1e-5)
