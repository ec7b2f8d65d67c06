"""A robot takes numbers in range and refuses others with one clear error."""

import math
from dataclasses import replace

import numpy as np
import pytest

from solver import Cable, Circle, Robot, Scene, Solver

PROTOTYPE = {"length_mm": 180.0, "segments": 18, "offset_mm": 8.0}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"length_mm": -180.0}, "length_mm is -180.0; it must be positive and finite"),
        ({"length_mm": math.nan}, "length_mm is nan; it must be positive and finite"),
        ({"offset_mm": 0.0}, "offset_mm is 0.0; it must be positive and finite"),
        ({"rigidity": math.inf}, "rigidity is inf; it must be positive and finite"),
        ({"max_tension": 0.0}, "max_tension is 0.0; it must be positive"),
        ({"max_tension": math.nan}, "max_tension is nan; it must be positive"),
        ({"segments": 1}, "segments is 1; it must be a whole number from 2 to 4096"),
        ({"segments": 18.0}, "segments is 18.0; it must be a whole number from 2 to 4096"),
        ({"max_cable_mm": -1.0}, "max_cable_mm is -1.0; it must be positive and finite"),
        ({"max_cable_mm": 200.0}, "max_cable_mm is 200.0; it must be below 180.0"),
        (
            {"model": "paper", "max_cable_mm": 110.0, "length_range_mm": (100, 200)},
            "max_cable_mm is 110.0; it must be below 100.0",
        ),
        ({"model": "slack"}, "model is 'slack'; it must be one of paper, rod"),
        ({"length_range_mm": (0, 200)}, "a bound of length_range_mm is 0; it must be positive and finite"),
        ({"length_range_mm": (190, 200)}, r"length_mm is 180.0; it must lie in length_range_mm \(190.0, 200.0\)"),
        ({"length_range_mm": 200}, "length_range_mm is 200; it must be a pair"),
        ({"length_range_mm": (0.1, 200)}, "the shortest must be at least 0.001 of the longest, 0.2"),
        ({"length_mm": 1e-320}, "length_mm is .*; it must be positive and finite, from 1e-30 to 1e"),
        ({"length_mm": True}, "length_mm is True; it must be positive"),
        ({"length_mm": "180"}, "length_mm is '180'; it must be positive"),
        ({"length_mm": 180 + 0j}, "length_mm is .*; it must be positive"),
        ({"length_mm": np.array(180.0)}, "length_mm is .*; it must be positive"),
        ({"length_mm": 10**400}, "length_mm is 1000.*; it must be positive"),
        ({"rigidity": 1.7e308}, r"rigidity is 1.7e\+308; it must be positive and finite, from 1e-60 to 1e\+60"),
        ({"offset_mm": 1e-3}, "offset_mm is 0.001; it must be from 0.018 to 1800"),
        ({"offset_mm": 1e7}, "offset_mm is 10000000.0; it must be from 0.018 to 1800"),
        ({"max_tension": 1e-9}, "max_tension is 1e-09; it must be at least .* of EI"),
        ({"max_cable_mm": 1e-9}, "max_cable_mm is 1e-09; it must be at least 8e-06"),
        ({"touch": "rim"}, r"touch is 'rim'; it must be a tuple of some of .*, as \('backbone',\)"),
        ({"touch": None}, "touch is None; it must be a tuple"),
        ({"segments": True}, "segments is True; it must be a whole number"),
        ({"segments": 4096, "between": 256}, "2105346 points that can touch, and at most 262144 are allowed"),
    ],
)
def test_robot(change, message):
    with pytest.raises(ValueError, match=message):
        Robot(**{**PROTOTYPE, **change})


def test_numbers_of_numpy_are_numbers():
    given = Robot(
        model="paper", length_mm=np.float32(180), segments=np.int64(18), offset_mm=np.int32(8), between=np.uint8(2)
    )
    assert given == replace(Robot.prototype(model="paper"), between=2)
    assert {type(value) for value in (given.length_mm, given.offset_mm)} == {float}
    assert {type(value) for value in (given.segments, given.between)} == {int}
    assert Circle(center=np.array([40, 100]), radius=np.int64(10)) == Circle(center=(40.0, 100.0), radius=10.0)


@pytest.mark.parametrize("robot", [Robot.prototype(), Robot.prototype(model="paper"), Robot.preset("rao_2021")])
def test_limits_that_are_not_given_follow_changed_sizes(robot):
    smaller = replace(robot, offset_mm=0.5, cables=() if robot.model == "paper" else robot.cables[:1])
    assert smaller.cable_limit_mm == pytest.approx(0.5 * math.pi)
    assert replace(robot, max_cable_mm=4.0).cable_limit_mm == 4.0
    assert replace(replace(robot, max_cable_mm=4.0), max_cable_mm=None) == robot


@pytest.mark.parametrize("cables", [(Cable(),), (Cable(), Cable(angle=math.pi))])
def test_loads_that_a_single_cable_cannot_hold_are_refused(cables):
    loaded = Robot.prototype(cables=cables, weight_per_length=(-0.0025, 0.0), max_tension=1.0)
    if len(cables) == 2:
        assert Solver(loaded, Scene()).rest().tensions.max() <= 1  # the motors pay them out
        return
    with pytest.raises(ValueError, match=r"max_tension is 1 N; at rest its loads .* raise max_tension"):
        Solver(loaded, Scene())
    held = Solver(replace(loaded, max_tension=15.0), Scene()).rest()
    assert 1 < held.tensions[0] < 15
