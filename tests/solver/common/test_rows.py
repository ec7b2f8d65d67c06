"""Rows of a batch: robots taken out, put back and forked."""

import copy
import json

import numpy as np
import pytest

from solver import BatchSolver, Circle, Robot, Rows, Scene

SCENES = [Scene([Circle(center=(x, 100.0), radius=12.0)]) for x in (40.0, 45.0, 60.0)]


def make_batch(count=3, rested=True):
    batch = BatchSolver(Robot.prototype(), count, 1)
    for k, scene in enumerate(SCENES[:count]):
        batch.assign(k, scene)
    if rested:
        batch.rest(range(min(count, 3)))
        batch.step(np.array([3.0, 7.0, 9.0])[:count], range(min(count, 3)))
    return batch


def test_robots_go_back():
    batch = make_batch()
    rows, before = batch.get_rows([0, 2]), batch.blocks.copy()
    batch.step(np.array([5.0, 8.0, 9.5]))
    after = batch.blocks.copy()
    batch.assign(2, SCENES[0])
    batch.set_rows([0, 2], rows)
    assert np.array_equal(batch.blocks[[0, 2]], before[[0, 2]])
    assert np.array_equal(batch.blocks[1], after[1])
    assert batch.scene(2) == SCENES[2]
    batch.step(np.array([5.0, 8.0, 9.5]))
    assert np.array_equal(batch.blocks[[0, 2]], after[[0, 2]])


def test_rows_are_copies():
    batch = make_batch()
    rows = batch.get_rows([1])
    kept = rows.blocks.copy()
    batch.step(np.array([1.0, 1.0, 1.0]))
    assert np.array_equal(rows.blocks, kept)


def test_one_robot_forks_into_many():
    batch, forks = make_batch(), BatchSolver(Robot.prototype(), 40, 1, threads=2)
    forks.set_rows(range(40), batch.get_rows([1] * 40))
    pulls = np.linspace(4.0, 10.0, 40)
    forks.step(pulls)
    for k in (0, 17, 39):
        alone = copy.deepcopy(batch)
        alone.step(pulls[[k]], [1])
        assert np.array_equal(forks.blocks[k], alone.blocks[1])
        assert forks.statuses[k] == alone.statuses[1]


def test_rows_of_one_batch_change_places():
    batch = make_batch()
    before = batch.blocks.copy()
    batch.set_rows([0, 1, 2], batch.get_rows([2, 0, 1]))
    assert np.array_equal(batch.blocks, before[[2, 0, 1]])
    assert [batch.scene(k) for k in range(3)] == [SCENES[2], SCENES[0], SCENES[1]]


def test_what_was_not_at_rest_does_not_move():
    batch = make_batch(rested=False)
    other = BatchSolver(Robot.prototype(), 2, 1)
    other.set_rows([0], batch.get_rows([0]))
    with pytest.raises(ValueError, match=r"rest\(\[0\]\)"):
        other.step(np.array([1.0]), [0])
    other.rest([0])
    other.step(np.array([1.0]), [0])
    other.set_rows([0], batch.get_rows([2]))
    other.set_rows([1], BatchSolver(Robot.prototype(), 1, 1).get_rows([0]))
    with pytest.raises(ValueError, match="has no scene"):
        other.scene(1)


def test_arrays_pass_through_text():
    batch = make_batch()
    rows = batch.get_rows([1])
    text = json.dumps({"blocks": rows.blocks.tolist(), "commands": rows.commands.tolist()})
    read = {name: np.array(values) for name, values in json.loads(text).items()}
    other = make_batch(rested=False)
    other.set_rows([1], rows._replace(**read))
    for each in (batch, other):
        each.step(np.array([9.0]), [1])
    assert np.array_equal(other.blocks[1], batch.blocks[1])


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"blocks": np.zeros((1, 3))}, "blocks of rows has the shape"),
        ({"statuses": np.zeros(1)}, "statuses of rows has the shape"),
        ({"scenes": ()}, "must have one for each"),
        ({"scenes": (Scene(),)}, "scene has 0 obstacles"),
        ({"robot": Robot.prototype(rigidity=1.0)}, "another robot"),
    ],
)
def test_rows_that_do_not_fit_are_refused(changed, message):
    batch = make_batch()
    rows, before = batch.get_rows([0])._replace(**changed), batch.get_rows([0, 1, 2])
    with pytest.raises(ValueError, match=message):
        batch.set_rows([0], rows)
    after = batch.get_rows([0, 1, 2])
    assert after.scenes == before.scenes
    assert np.array_equal(after.blocks, before.blocks)


def test_only_rows_are_rows():
    with pytest.raises(TypeError, match="take those of get_rows"):
        make_batch().set_rows([0], {"blocks": 0})
    assert isinstance(make_batch().get_rows([]), Rows)
