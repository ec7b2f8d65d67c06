"""Copies of solvers and batches go on with the same bits, in this process and in another one."""

import copy
import multiprocessing
import pickle

import numpy as np
import pytest

from solver import (
    BatchSolver,
    Capsule,
    Circle,
    Custom,
    Family,
    ReferenceBatch,
    ReferenceSolver,
    Robot,
    Scene,
    Solver,
    Status,
    TransitionMemo,
)
from solver.common.robot import MODELS
from solver.spatial import SpatialBatchSolver, SpatialReferenceSolver, SpatialRobot, SpatialSolver, Sphere

OVAL = Family.trace(lambda point, sizes: (point[0] / sizes[0]) ** 4 + (point[1] / sizes[1]) ** 2 - 1, sizes=2)
PLANAR = Scene(
    [
        Circle(center=(45.0, 100.0), radius=12.0),
        Capsule(start=(60.0, 130.0), end=(75.0, 150.0), radius=6.0, spring=0.2),
        Custom(family=OVAL, sizes=(10.0, 12.0), center=(-50.0, 100.0), reach=30.0),
    ]
)
SPATIAL = Scene(
    [Sphere(center=(40.0, 6.0, 104.0), radius=15.0), Sphere(center=(60.0, 10.0, 60.0), radius=9.0, spring=0.3)]
)
EVERY_COPY = pytest.mark.parametrize(
    "duplicate",
    [copy.copy, copy.deepcopy, lambda given: pickle.loads(pickle.dumps(given))],
    ids=["copy", "deep", "pickle"],
)
EVERY_MODEL = pytest.mark.parametrize("model", MODELS)


def planar_walk(solver, state, seed=3, steps=12):
    generator = np.random.default_rng(seed)
    for _ in range(steps):
        state = solver.step(state, float(np.clip(state.cable_mm + generator.uniform(-0.5, 1.2), 0, 14)))
    return state


def spatial_walk(solver, state, steps=8):
    for k in range(1, steps + 1):
        state = solver.step(state, [0.9 * k, 0.1 * k])
    return state


def moved(batch, seed=7, steps=6):
    """Move the first robots of a batch on; return what it keeps."""
    generator, shape = np.random.default_rng(seed), (batch.count - 1, batch.cables)
    for _ in range(steps):
        commands = batch.blocks[:-1, : batch.cables] + generator.uniform(-0.3, 0.9, shape)
        batch.step(
            np.clip(commands, 0.0, 10.0).reshape(-1 if batch.cables == 1 else shape), list(range(batch.count - 1))
        )
    return kept(batch)


def kept(batch):
    numbers = (batch.blocks, batch.statuses, batch.iterations, batch.factorizations, batch.commands)
    return [array.tobytes() for array in numbers], batch._scenes, batch._unrested


def make_batch(model, threads=1, space=2):
    """A batch of robots in contact, the last but one without an event, the last not yet at rest."""
    if space == 2:
        batch = BatchSolver(Robot.prototype(model=model, between=1), 21, 3, threads)
        scenes = [PLANAR, Scene(PLANAR.obstacles[::-1])]
    else:
        batch = SpatialBatchSolver(SpatialRobot.prototype(model=model, between=1), 19, 2, threads)
        scenes = [SPATIAL, Scene(SPATIAL.obstacles[::-1])]
    for k in range(batch.count):
        batch.assign(k, scenes[k % 2])
    batch.rest(range(batch.count - 1))
    moved(batch, seed=1)
    return batch


@EVERY_COPY
@EVERY_MODEL
def test_copied_solver_goes_on(duplicate, model):
    solver = Solver(Robot.prototype(model=model, between=1), PLANAR)
    state = planar_walk(solver, solver.rest())
    other, same = duplicate(solver), duplicate(state)
    assert np.array_equal(other.rest().block, solver.rest().block)
    assert np.array_equal(planar_walk(other, same, 5).block, planar_walk(solver, state, 5).block)


@EVERY_COPY
@EVERY_MODEL
def test_copied_solver_goes_on_in_space(duplicate, model):
    solver = SpatialSolver(SpatialRobot.prototype(model=model, between=1), SPATIAL)
    assert np.array_equal(
        spatial_walk(duplicate(solver), duplicate(solver.rest())).block, spatial_walk(solver, solver.rest()).block
    )


@EVERY_COPY
def test_copied_reference_goes_on(duplicate):
    solver = ReferenceSolver(Robot.prototype(segments=6, between=2, model="paper"), Scene(PLANAR.obstacles[:1]))
    assert np.array_equal(duplicate(solver).step(solver.rest(), 3.0).block, solver.step(solver.rest(), 3.0).block)
    in_space = SpatialReferenceSolver(SpatialRobot.prototype(segments=4, model="paper"), Scene())
    assert np.array_equal(duplicate(in_space).rest().block, in_space.rest().block)


def test_a_file_names_robot_and_scene_only():
    """A reference holds compiled CasADi functions, whose own serialisation loads the libraries that it names."""
    solver = ReferenceSolver(Robot.prototype(segments=6, between=2, model="paper"), Scene())
    assert b"casadi" not in pickle.dumps(solver)


@EVERY_COPY
def test_copied_memo_keeps_its_steps(duplicate):
    memo = TransitionMemo(Solver(Robot.prototype(between=1), PLANAR))
    memo.step(memo.rest(), 4.0)
    other = duplicate(memo)
    other.step(other.rest(), 4.0)
    assert other.statistics.hits == 1


@EVERY_COPY
@EVERY_MODEL
@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("space", [2, 3])
def test_copied_batch_goes_on(duplicate, model, threads, space):
    batch = make_batch(model, threads, space)
    other = duplicate(batch)
    assert other is not batch
    assert not np.shares_memory(other.blocks, batch.blocks)
    assert kept(other) == kept(batch)
    assert moved(other) == moved(batch)
    with pytest.raises(ValueError, match="call rest"):
        other.step(batch.blocks[:, : batch.cables].squeeze())


@EVERY_COPY
def test_copied_reference_batch_goes_on(duplicate):
    batch = ReferenceBatch(Robot.prototype(segments=6, between=2, model="paper"), 1, 1)
    batch.assign(0, Scene(PLANAR.obstacles[:1]))
    batch.rest([0])
    other = duplicate(batch)
    for each in (batch, other):
        each.step(np.array([2.0]))
    assert isinstance(other, ReferenceBatch)
    assert kept(other) == kept(batch)


def test_batch_goes_on_in_another_process():
    batch, in_space = make_batch("rod", 2), make_batch("rod", 2, 3)
    solver = Solver(Robot.prototype(between=1), PLANAR)
    context = multiprocessing.get_context("spawn")
    with context.Pool(1) as pool:
        there = pool.map(moved, [batch, in_space])
        walked = pool.apply(planar_walk, (solver, solver.rest()))
    assert there == [moved(batch), moved(in_space)]
    assert np.array_equal(walked.block, planar_walk(solver, solver.rest()).block)
    assert walked.status is not Status.GAVE_UP
