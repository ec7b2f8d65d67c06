"""Steps of rods with several cables that used to be given up on, though the robot stalls or has somewhere to go."""

import math

import numpy as np
import pytest
from soak.episodes import Episode, setting_of
from soak.walks import sample_increments, walk

from solver import Cable, Robot, Scene, Solver, Status

PAIR = (Cable(), Cable(angle=math.pi))
SMALL = Robot(length_mm=18.0, segments=9, offset_mm=0.8, rigidity=50.0, max_tension=15.0, between=1, cables=PAIR)
SECTIONS = Robot.prototype(
    model="rod",
    segments=30,
    length_range_mm=(100.0, 180.0),
    length_mm=112.16006554011628,
    cables=(
        Cable(end=14),
        Cable(angle=math.pi, end=14),
        Cable(offset_mm=5.784630726327244),
        Cable(angle=math.pi, offset_mm=2.660753789111226),
    ),
)
STRONG = Robot.prototype(model="rod", segments=9, cables=PAIR, max_tension=100.0)
BUCKLING = 6 * STRONG.rigidity * (STRONG.segments / STRONG.length_mm) ** 2  # of each of two cables [N]


def follow(robot, *commands):
    solver = Solver(robot, Scene([]))
    states = [solver.rest()]
    for command in commands:
        states.append(solver.step(states[-1], *command))
    assert max(solver.optimality(states[-1])) < 1e-9
    return states


def test_a_pair_that_crosses_its_straight_shape_stalls_where_both_cables_are_taut():
    """The gap that closes last there is that of the cable which slackens, and it is closed already."""
    start, command = (-0.5028631965306289, 0.08678653871598693), (0.04786299808766159, -0.00826042543032883)
    *_, stalled = follow(SMALL, (start,), (command,))
    assert stalled.status is Status.STALLED
    assert stalled.tensions.max() == pytest.approx(15, rel=1e-6)
    assert stalled.cables_mm == pytest.approx([-command[1], command[1]], abs=1e-5)


def test_two_sections_go_on_in_finer_steps_where_tensions_rise_steeply():
    start = (-4.936952947326009, 4.950593722316127, -9.108863147947078, 3.7170701015328165)
    command = (-6.076529171560363, 9.985524129694294, -8.818712289374696, 8.755964233939288)
    *_, stalled = follow(SECTIONS, (start, 180.0), (command, 180.0))
    assert stalled.status is Status.STALLED


def test_cables_that_no_limit_stops_buckle_the_robot_segment_by_segment():
    """A segment of EI and l0 under two cables in line buckles at 12 EI/l0² together; the segments bend to and fro."""
    _, buckled, tighter, free = follow(STRONG, ((1.0, 0.0),), ((2.0, 0.0),), ((0.0, 0.0),))
    assert buckled.status is Status.SNAPPED
    assert tighter.status <= Status.SNAPPED
    for state, pulled in (buckled, 1.0), (tighter, 2.0):
        assert state.cables_mm == pytest.approx([pulled, 0.0], abs=1e-9)
        assert state.tensions.sum() == pytest.approx(2 * BUCKLING, rel=0.05)
        turns = np.diff(state.nodes[:, 2])
        assert turns.min() < 0 < turns.max()
    assert free.status <= Status.SNAPPED
    assert free.nodes[:, 0] == pytest.approx(np.zeros(10), abs=1e-2)


def test_a_descent_does_not_creep_along_a_contact_that_it_must_leave():
    setting, generator = setting_of(Episode("pair", 8, 11, 500))
    increments = sample_increments(generator, setting.solver, setting.scale, 500)
    states = walk(setting.solver, increments[:316]).states
    assert max(state.status for state in states) < Status.GAVE_UP
