"""Obstacles that move within a step, in space and with several cables."""

import numpy as np
import pytest

from solver import BatchSolver, Cable, Circle, Robot, Rows, Scene, Solver, Status
from solver.common.robot import MODELS
from solver.spatial import Box, Capsule, Cylinder, SpatialBatchSolver, SpatialRobot, SpatialSolver, Sphere

EVERY_MODEL = pytest.mark.parametrize("model", MODELS)
SHAPES = {
    "sphere": Sphere(center=(42.0, 6.0, 108.0), radius=14.0),
    "capsule": Capsule(start=(45.0, -20.0, 105.0), end=(45.0, 30.0, 112.0), radius=12.0),
    "cylinder": Cylinder(start=(48.0, -20.0, 105.0), end=(48.0, 30.0, 112.0), radius=13.0, edge=4.0),
    "box": Box(center=(50.0, 0.0, 110.0), sizes=(30.0, 60.0, 30.0), edge=6.0),
    "sprung": Sphere(center=(42.0, 6.0, 108.0), radius=14.0, spring=0.4),
}


def shifted(scene, by):
    return Scene(obstacle.shifted(by) for obstacle in scene)


def pulled(solver, target, steps=20):
    state = solver.rest()
    for k in range(1, steps + 1):
        state = solver.step(state, [k / steps * each for each in target])
        assert state.status is Status.CONVERGED
    return state


@EVERY_MODEL
@pytest.mark.parametrize("shape", SHAPES)
def test_moving_a_scene_leads_where_pulling_in_the_moved_scene_does(model, shape):
    robot, scene = SpatialRobot.prototype(model=model, between=1), Scene([SHAPES[shape]])
    there = shifted(scene, (-3.0, 1.0, 2.0))
    moved = SpatialSolver(robot, scene).step(pulled(SpatialSolver(robot, scene), (6.0, 0.5)), (6.0, 0.5), scene=there)
    direct = pulled(SpatialSolver(robot, there), (6.0, 0.5))
    assert moved.status is Status.CONVERGED
    assert moved.scene == there
    assert moved.contact.any()
    assert np.abs(moved.nodes - direct.nodes).max() <= 1e-7 * robot.length_mm
    assert np.abs(moved.forces - direct.forces).max() <= 1e-6


@EVERY_MODEL
def test_random_motions_keep_every_promise(model):
    robot, generator = SpatialRobot.prototype(model=model, between=1, max_tension=6.0), np.random.default_rng(1)
    solver = SpatialSolver(robot, Scene([SHAPES["sphere"], SHAPES["capsule"].shifted((0.0, 0.0, -60.0))]))
    batch = SpatialBatchSolver(robot, 1, 2)
    batch.assign(0, solver.scene)
    batch.rest([0])
    state, statuses = solver.rest(), []
    for k in range(40):
        if k % 10 == 0:
            motion = generator.normal(size=(2, 3))
        target = np.clip(state.cables_mm + generator.uniform((-0.2, -0.3), (0.9, 0.5)), -3, 9)
        there = Scene(obstacle.shifted(by) for obstacle, by in zip(state.scene, motion, strict=True))
        state = solver.step(state, target, scene=there)
        batch.step(target[None], scenes=[there])
        assert np.array_equal(batch.blocks[0], state.block)
        assert batch.scene(0) == state.scene
        assert state.gaps.min() >= -1e-12 * robot.length_mm
        assert batch.optimality().max() <= 1e-8
        assert state.tensions.max() <= robot.max_tension
        statuses.append(state.status)
        if state.scene != there:
            motion = -motion
    assert statuses.count(Status.GAVE_UP) <= 1
    assert statuses.count(Status.CONVERGED) > 10


def test_opposing_cables_pay_out():
    cables = (Cable(), Cable(angle=np.pi))
    robot = Robot.prototype(cables=cables, between=1, max_tension=4.0)
    scene = Scene([Circle(center=(45.0, 110.0), radius=12.0)])
    solver = Solver(robot, scene)
    state = pulled(solver, (5.0, -5.5))
    pressed = solver.step(state, (5.0, -5.5), scene=shifted(scene, (-6.0, 0.0)))
    assert pressed.scene == shifted(scene, (-6.0, 0.0))
    assert pressed.tensions.max() <= robot.max_tension
    assert pressed.gaps.min() >= -1e-12 * robot.length_mm
    batch, none = BatchSolver(robot, 1, 1), np.zeros(1, np.int64)
    command = pressed.block[None, :3]
    rows = Rows(robot, (None,), (pressed.scene,), np.ones(1, bool), pressed.block[None], none, none, none, command)
    batch.set_rows([0], rows)
    assert batch.optimality().max() <= 1e-8
    released = solver.step(pressed, (5.0, -5.5), scene=scene)
    assert released.status is Status.CONVERGED
    assert np.abs(released.nodes - state.nodes).max() <= 1e-7 * robot.length_mm
