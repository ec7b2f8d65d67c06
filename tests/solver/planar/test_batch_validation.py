"""A batch refuses bad input with one clear error and leaves everything as it was."""

import math
import os

import numpy as np
import pytest

from solver import (
    Robot,
)
from solver.planar.batch import BatchSolver


@pytest.fixture
def batch(circles):
    made = BatchSolver(Robot.prototype(model="paper"), 4, 1)
    for k in range(4):
        made.assign(k, circles((44 + k, 104, 15)))
    made.rest(range(4))
    return made


def test_a_robot_put_among_other_obstacles_rests_before_it_moves(batch, circles):
    batch.step(np.full(4, 8.0))
    before = batch.blocks.copy()
    batch.assign(3, circles((41, 104, 15)))
    message = r"robot 3 has a new scene, or its rest was interrupted; call rest\(\[3\]\) before it moves"
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
    with pytest.raises(ValueError, match=r"each of the batch.s has|overlaps the straight robot"):
        batch.assign(2, circles(*scene))
    assert batch.scene(2) is kept
    assert batch.assign_if_clear(2, kept)
    assert not batch.assign_if_clear(2, circles((15, 100, 15)))
    assert batch.scene(2) is kept
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
        with pytest.raises(ValueError, match=r"robots? is .*; it must|robot index is .*; it must be a whole"):
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
        BatchSolver(Robot.prototype(model="paper"), *arguments)
    with pytest.raises(TypeError, match="robot is None; it must be a Robot"):
        BatchSolver(None, 1, 1)


def test_a_batch_answers_only_for_robots_that_are_assigned(circles):
    batch = BatchSolver(Robot.prototype(model="paper"), 2, 1)
    batch.assign(0, circles((44, 104, 15)))
    for call in (
        lambda: batch.rest([0, 1]),
        lambda: batch.ramp_reaches_force([1], [0.1], 0.5, 8.0),
        lambda: batch.move(1),
        lambda: batch.equilibrium(1),
    ):
        with pytest.raises(ValueError, match="robot 1 has no scene; call assign"):
            call()
    with pytest.raises(TypeError, match="scene is None; it must be a Scene"):
        batch.assign(1, None)
