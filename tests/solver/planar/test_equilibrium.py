"""An equilibrium is immutable, complete, and refuses blocks of another robot or scene."""

import copy
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

from solver import (
    Equilibrium,
    Robot,
    Scene,
    Solver,
    Status,
)


def test_equilibrium_of_another(circles):
    solver = Solver(Robot.prototype(model="paper"), circles((44, 104, 15)))
    with pytest.raises(ValueError, match="the equilibrium is of another robot"):
        solver.step(Solver(Robot.prototype(model="paper", segments=9), solver.scene).rest(), 1.0)
    with pytest.raises(ValueError, match="the equilibrium is of another scene"):
        solver.step(Solver(solver.robot, circles((44, 104, 14))).rest(), 1.0)


def test_equilibrium_is_read_only(circles):
    equilibrium = Solver(Robot.prototype(model="paper"), circles((44, 104, 15))).rest()
    for array in (equilibrium.block, equilibrium.nodes, equilibrium.multipliers, equilibrium.gaps):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e)), replace], ids=lambda f: f.__name__
)
def test_a_copied_equilibrium_is_read_only(circles, copied):
    solver = Solver(Robot.prototype(model="paper"), circles((44, 104, 15)))
    equilibrium = solver.step(solver.rest(), 7.0)
    twin = copied(equilibrium)
    assert twin.status is equilibrium.status
    assert twin.block.tobytes() == equilibrium.block.tobytes()
    assert solver.step(twin, 8.0).block.tobytes() == solver.step(equilibrium, 8.0).block.tobytes()
    for array in (twin.block, twin.nodes):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_an_equilibrium_keeps_no_array_that_others_write(circles):
    equilibrium = Solver(Robot.prototype(model="paper"), circles((44, 104, 15))).rest()
    rows = np.array([equilibrium.block, equilibrium.block])
    kept = Equilibrium(equilibrium.robot, equilibrium.scene, rows[0], Status.CONVERGED, 0)
    rows[:] = 7.0
    assert kept.block.tobytes() == equilibrium.block.tobytes()


def test_an_equilibrium_is_shown_in_short(circles):
    solver = Solver(Robot.prototype(model="paper"), circles((44, 104, 15)))
    text = repr(solver.step(solver.rest(), 7.0))
    assert len(text) < 300
    assert "<Equilibrium CONVERGED: 18 segments, 180 mm long, 1 obstacles, 1 contacts, cable 7 mm" in text


def written(index, value):
    def change(block):
        block[index] = value
        return block

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (written(1, -180.0), "length_mm in block is -180.0; it must be from 180 to 180: take the block of"),
        (written(1, -math.inf), "block has numbers that are not finite"),
        (written(1, math.nan), "block has numbers that are not finite"),
        (written(0, 1e9), "the displacement of a cable in block is .*; it must be at most 180"),
        (written(5, 1e9), "a coordinate of a segment in block is .*; it must be at most"),
        (written(40, 1e9), "the distance of a node in block is .*; it must be at most"),
        (lambda block: block[:-1], "block has shape .*; it must be"),
        (lambda block: block.astype(np.float32), "it must be a contiguous array of float64"),
        (lambda block: np.repeat(block, 2)[::2], "it must be a contiguous array of float64"),
        (lambda block: block.tolist(), "it must be a contiguous array of float64"),
        (lambda block: None, "block is None; it must be a contiguous array of float64"),
    ],
)
def test_blocks_that_are_none(circles, change, message):
    equilibrium = Solver(Robot.prototype(model="paper"), circles((44, 104, 15))).rest()
    with pytest.raises(ValueError, match=message):
        Equilibrium(equilibrium.robot, equilibrium.scene, change(equilibrium.block.copy()), Status.CONVERGED, 0)


def test_parts_of_an_equilibrium_that_are_none():
    rest = Solver(Robot.prototype(model="paper"), Scene()).rest()
    for robot, scene, status in ((None, rest.scene, rest.status), (rest.robot, [], rest.status)):
        with pytest.raises(TypeError, match=r"it must be a (Robot|Scene)"):
            Equilibrium(robot, scene, rest.block, status, 0)
    with pytest.raises(TypeError, match="status is 0; it must be a Status"):
        Equilibrium(rest.robot, rest.scene, rest.block, 0, 0)
    with pytest.raises(ValueError, match="iterations is -1; it must be a whole number"):
        Equilibrium(rest.robot, rest.scene, rest.block, rest.status, -1)
