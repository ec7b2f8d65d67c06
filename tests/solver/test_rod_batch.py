"""Rods with several cables: batches and the memo give the bits of the single solver, and states survive pickling."""

import copy
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

from solver import (
    BatchSolver,
    Cable,
    Circle,
    Load,
    ReferenceBatch,
    Robot,
    Scene,
    Solver,
    Status,
    TransitionMemo,
    spatial,
)

COUNT, STEPS = 5, 40
PAIR = Robot.prototype(
    model="rod",
    cables=(Cable(), Cable(angle=math.pi), Cable(end=9)),
    weight_per_length=(1e-4, -1e-4),
    length_range_mm=(120, 180),
)
SECTIONS = spatial.SpatialRobot.prototype(
    model="rod",
    cables=tuple(Cable(angle=2 * math.pi / 3 * k, end=end) for end in (18, 9) for k in range(3)),
    loads=(Load(node=18, force=(0.0, 0.02, -0.05), at=(8.0, 0.0)),),
)
ROBOTS = pytest.mark.parametrize("robot", [PAIR, SECTIONS], ids=["plane", "space"])


def make_solver(robot, scene):
    return (Solver if isinstance(robot, Robot) else spatial.SpatialSolver)(robot, scene)


def sample_scene(robot, generator):
    """Return two obstacles, one of them on a spring, that the robot comes to."""
    height, radius = generator.uniform(80, 140), generator.uniform(12, 16)
    if isinstance(robot, Robot):
        return Scene(
            [Circle(center=(44, height), radius=radius), Circle(center=(-44, height), radius=radius, spring=1.0)]
        )
    sphere = spatial.Sphere(center=(40, generator.uniform(-10, 10), height), radius=radius)
    return Scene([sphere, spatial.Sphere(center=(-40, 0, height), radius=radius, spring=1.0)])


def sample_commands(robot, generator, steps=STEPS):
    """Return displacements that pull one cable after the other, with the others paid out, ``(steps, cables)``."""
    cables = len(robot.cables)
    pulled = np.repeat(generator.integers(cables, size=steps // 10), 10)
    ends = np.where(pulled[:, None] == np.arange(cables), 7.0, -9.0)
    return ends * np.tile(np.arange(1, 11) / 10, steps // 10)[:, None] + generator.normal(0, 0.05, (steps, cables))


@ROBOTS
@pytest.mark.parametrize("threads", [1, 3])
def test_batch_has_the_bits_of_the_single_solver(robot, threads):
    generator = np.random.default_rng(4)
    batch = (BatchSolver if isinstance(robot, Robot) else spatial.SpatialBatchSolver)(robot, COUNT, 2, threads)
    scenes = [sample_scene(robot, generator) for _ in range(COUNT)]
    for index, scene in enumerate(scenes):
        batch.assign(index, scene)
    batch.rest(range(COUNT))
    solvers = [make_solver(robot, scene) for scene in scenes]
    states, touched = [solver.rest() for solver in solvers], 0
    commands = np.stack([sample_commands(robot, generator) for _ in range(COUNT)], axis=1)
    for rows in commands:
        batch.step(rows)
        states = [solver.step(state, row) for solver, state, row in zip(solvers, states, rows, strict=True)]
        touched += sum(state.contact.any() for state in states)
        for index, state in enumerate(states):
            assert batch.blocks[index].tobytes() == state.block.tobytes()
            assert batch.statuses[index] == state.status
        assert batch.equilibrium(0).block.tobytes() == states[0].block.tobytes()
    assert touched > 10


def test_batch_inserts_a_rod_with_several_cables():
    batch, scene = BatchSolver(PAIR, 1, 1), Scene([Circle(center=(44, 104), radius=15)])
    batch.assign(0, scene)
    batch.rest([0])
    solver = Solver(PAIR, scene)
    state = solver.rest()
    for part in np.linspace(0, 1, 21)[1:]:
        command = [8 * part, -10 * part, part, 180 - 20 * part]
        batch.commands[0] = command
        batch.move(0)
        state = solver.step(state, command[:3], command[3])
        assert batch.blocks[0].tobytes() == state.block.tobytes()
    assert state.length_mm == 160


@ROBOTS
def test_memo_has_the_bits_of_the_solver(robot):
    generator = np.random.default_rng(5)
    solver = make_solver(robot, sample_scene(robot, generator))
    memo, commands = TransitionMemo(solver), sample_commands(robot, generator)
    for round_ in range(2):
        state, same = solver.rest(), memo.rest()
        for row in commands:
            state, same = solver.step(state, row), memo.step(same, tuple(row.tolist()) if round_ else row)
            assert state.block.tobytes() == same.block.tobytes()
    assert memo.statistics[:3] == (STEPS, STEPS, STEPS)
    with pytest.raises(ValueError, match=f"{len(robot.cables)} numbers"):
        memo.step(state, (1.0,))


@ROBOTS
@pytest.mark.parametrize("copied", [copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e)), replace])
def test_a_copied_state_goes_on_alike(robot, copied):
    generator = np.random.default_rng(6)
    solver = make_solver(robot, sample_scene(robot, generator))
    state = solver.rest()
    for row in sample_commands(robot, generator, 10):
        state = solver.step(state, row)
    twin = copied(state)
    assert twin.robot == state.robot
    assert twin.block.tobytes() == state.block.tobytes()
    assert twin.residuals() == state.residuals()
    command = state.cables_mm + 0.1
    assert solver.step(twin, command).block.tobytes() == solver.step(state, command).block.tobytes()


def test_reference_batch_follows_the_kernel():
    robot = replace(PAIR, length_range_mm=None)
    batch, scene = ReferenceBatch(robot, 1, 1), Scene([Circle(center=(44, 104), radius=15)])
    batch.assign(0, scene)
    batch.rest([0])
    solver = Solver(robot, scene)
    state = solver.rest()
    for part in np.linspace(0, 1, 9)[1:]:
        command = np.array([8.0, -10.0, 1.0]) * part
        batch.step(command[None])
        state = solver.step(state, command)
        assert batch.statuses[0] == state.status == Status.CONVERGED
        assert batch.equilibrium(0).nodes == pytest.approx(state.nodes, abs=1e-6)
        assert batch.equilibrium(0).tensions == pytest.approx(state.tensions, abs=1e-6)
    assert state.contact.any()
