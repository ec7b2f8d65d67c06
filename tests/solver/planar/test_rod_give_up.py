"""Steps of rods with several cables that used to be given up on, though the robot stalls or has somewhere to go."""

import math
from dataclasses import replace

import numpy as np
import pytest
from soak.episodes import Episode, setting_of
from soak.walks import sample_increments, walk

from solver import Cable, Circle, Ellipse, Polygon, Robot, Scene, Solver, Status

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


UNEVEN = replace(STRONG, max_tension=math.inf, cables=(Cable(offset_mm=4.43), Cable(offset_mm=7.44, angle=math.pi)))
CHANNEL = tuple(
    Circle(center=center, radius=13.29118997752611)
    for center in (
        (-22.402248937491407, 130.69976233774014),
        (-22.402248937491407, 164.81039191379023),
        (22.440423416647292, 75.76969316316612),
        (22.440423416647292, 109.8803227392162),
        (22.440423416647292, 178.10158189131633),
    )
)
INSERTED = replace(STRONG, segments=30, between=3, touch=("backbone", "cable", "rim"), length_range_mm=(100.0, 180.0))
MEETS_A_PEG = replace(
    INSERTED,
    length_mm=145.007020686826,
    cables=(Cable(offset_mm=6.207458811814818, end=26), Cable(angle=math.pi)),
)
SNAPS_AT_THE_LIMIT = replace(
    INSERTED,
    length_mm=13.250823112489886,
    length_range_mm=(10.0, 18.0),
    segments=18,
    offset_mm=0.8,
    disk_radius_mm=0.8,
    rigidity=50.0,
    max_tension=15.0,
    max_cable_mm=2.5,
    cables=(Cable(offset_mm=0.7497871118287467, end=13), Cable()),
)


def follow(robot, *commands, scene=()):
    solver = Solver(robot, Scene(scene))
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


def test_a_robot_that_is_held_tight_snaps_beyond_the_end_of_its_branch_instead_of_creeping_along_it():
    """In a channel, cables that no limit stops: it was followed by 6e-12 of the offset at a time."""
    setting, generator = setting_of(Episode("sections", 1300, 356, 500))
    increments = sample_increments(generator, setting.solver, setting.scale, 500)
    states = walk(setting.solver, increments[:18]).states
    assert states[-1].status is Status.SNAPPED
    assert states[-1].length_mm == pytest.approx(180)


@pytest.mark.parametrize("start", [(-0.404340139, -0.595947961), (-1.0, -1.0), (-0.4, -0.6)])
@pytest.mark.parametrize("command", [(0.0118121596, 0.01740968), (0.01, 0.015), (0.01, 0.02)])
def test_cables_that_are_pulled_from_slack_buckle_the_robot_however_little(start, command):
    """All patterns of bends have almost the same energy there; moments of two cables that pull evenly balance."""
    *_, buckled = follow(UNEVEN, (start,), (command,))
    assert buckled.status is Status.SNAPPED
    assert buckled.cables_mm == pytest.approx(command, abs=1e-9)
    assert buckled.tensions.sum() == pytest.approx(2 * BUCKLING, rel=1e-3)
    assert buckled.tensions[0] * 4.43 == pytest.approx(buckled.tensions[1] * 7.44, rel=1e-3)


def test_a_descent_slides_along_a_contact_that_presses_it_less_and_less():
    start, command = (1.4277523630782247, -2.8555047261564495), (8.484631712714396, -16.969263425428792)
    *_, snapped = follow(replace(STRONG, segments=30, between=0), (start,), (command,), scene=CHANNEL)
    assert snapped.status is Status.SNAPPED
    assert snapped.cables_mm == pytest.approx(command, abs=1e-9)
    assert snapped.residuals().stationarity * STRONG.length_mm < 1e-8


@pytest.mark.parametrize(
    ("robot", "peg", "commands"),
    [
        (
            MEETS_A_PEG,
            Circle(center=(16.40493356487175, 109.54219081832039), radius=2.201040247722756),
            (
                ((1.1589543941713178, 7.982880028435452), 112.94782816926005),
                ((3.041023189381013, 10.718497609342563), 111.65652321107821),
            ),
        ),
        (
            SNAPS_AT_THE_LIMIT,
            Circle(center=(2.510856434939581, 12.106145683892619), radius=0.47958951537226735),
            (((0.003979781339305894, 1.2016331899014785), 15.868367893898117),),
        ),
    ],
    ids=[
        "the tension falls before the robot meets a peg",
        "a stalled cable is let go by another",
    ],
)
def test_a_stall_is_where_a_repeated_command_leads_no_farther(robot, peg, commands):
    *_, stalled, again = follow(robot, *commands, commands[-1], scene=(peg,))
    assert stalled.status is again.status is Status.STALLED
    assert stalled.tensions.max() == pytest.approx(robot.max_tension, rel=1.1e-6)
    assert again.cables_mm == pytest.approx(stalled.cables_mm, abs=1e-4 * robot.offset_mm)
    assert again.length_mm == pytest.approx(stalled.length_mm, abs=1e-4 * robot.length_mm)


def test_a_snap_goes_on_until_a_soft_obstacle_that_it_carried_along_is_home_again():
    """The robot takes it as far as it is long, and lets it go: hundreds of iterates of a descent."""
    robot = Robot(
        length_mm=1800.0,
        segments=9,
        offset_mm=80.0,
        rigidity=5e5,
        max_tension=100.0,
        model="rod",
        between=1,
        touch=("backbone", "cable"),
        cables=(
            Cable(end=5),
            Cable(angle=math.pi, end=5),
            Cable(offset_mm=66.6),
            Cable(angle=math.pi, offset_mm=48.2),
        ),
    )
    fixed = Ellipse(center=(420.0, 1300.0), radii=(205.0, 112.0), axis=(-0.6, -0.8))
    corners = ((324.0, 1202.0), (285.0, 1016.0), (500.0, 1005.0), (500.0, 1174.0))
    soft = Polygon(corners=corners, radius=120.0, spring=1e-5)
    solver, command = Solver(robot, Scene([fixed, soft])), (-142.0, 129.0, -94.0, 62.0)
    before = solver.step(solver.rest(), (43.0, -47.0, 195.0, -155.0))
    away = np.linalg.norm(solver.trace(before, command).displacements[:, 1], axis=1)
    assert solver.step(before, command).status is Status.SNAPPED
    assert before.contact[1].any()
    assert away.max() > 0.9 * robot.length_mm
    assert away[-1] == pytest.approx(0, abs=1e-9)
