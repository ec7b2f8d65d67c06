"""Steps in space that used to be given up on, though the robot stalls or is blocked."""

import math

import numpy as np
import pytest

from solver import Cable, Load, Scene, Status
from solver.spatial import Box, HalfSpace, SpatialRobot, SpatialSolver, Sphere


def test_a_descent_that_loses_no_energy_leaves_a_wedged_robot_the_work_to_reach_its_tension_limit():
    """A segment caught between two spheres: the tension rises from 8 N to the limit within a micrometre."""
    robot = SpatialRobot.prototype(model="paper", segments=9, between=1)
    scene = Scene(
        [
            Sphere(center=(0.4980184451862861, -21.782172176641982, 103.13490804603079), radius=7.412391034398317),
            Sphere(center=(6.369342656127135, -39.23245352276464, 106.52391698418005), radius=8.130649013725897),
            Sphere(center=(-30.32368632200174, -22.249220305267425, 126.56065625842108), radius=7.539549173073781),
        ]
    )
    solver = SpatialSolver(robot, scene)
    state = solver.rest()
    for command in (
        (8.08782539161514, -12.566370614359172),
        (-11.915122168526647, 3.6035652771738294),
        (-7.623056093213194, 7.478140311929766),
        (-8.148664837969664, 7.4336744889432245),
    ):
        state = solver.step(state, command)
    assert state.status is Status.STALLED
    assert state.tensions.max() == pytest.approx(15, rel=1e-6)
    residuals = state.residuals()
    assert max(residuals.stationarity * robot.length_mm, residuals.gaps / robot.length_mm) < 1e-8


def test_a_robot_that_no_limit_stops_is_blocked_where_it_coils_until_its_disks_meet():
    """Three cables against each other shorten no farther then, whichever way they come there: tensions diverge."""
    robot = SpatialRobot.prototype(
        model="rod",
        between=1,
        max_tension=math.inf,
        cables=tuple(Cable(angle=2 * math.pi / 3 * k) for k in range(5)),
        torsion_ratio=1.397238486614305,
        weight_per_length=(0.0003808162493369544, 0.00014878843102599505, -0.0003523383980018961),
        loads=(
            Load(node=14, force=(0.46370010161141134, -0.003472481050994568, -0.511779038743751), at=(8.0, math.pi)),
            Load(node=16, force=(-0.32800783404787004, -0.06721742449341554, 0.12128437122452557), at=(8.0, math.pi)),
        ),
    )
    solver = SpatialSolver(robot, Scene())
    command = np.array([-4.945410174826705, 24.175891918386796, 3.03096270242304, 13.502329984241134, -14.6])
    at_once = solver.step(solver.rest(), command)
    slowly = solver.rest()
    for part in np.linspace(0, 1, 41)[1:]:
        slowly = solver.step(slowly, part * command)
    for state in (at_once, slowly):
        assert state.status is Status.BLOCKED
        assert state.cables_mm[1] / command[1] == pytest.approx(0.846884, abs=1e-5)
        assert state.tensions.max() > 1000
        assert max(solver.optimality(state)) < 1e-7


def test_a_descent_leaves_a_contact_that_stays_closed_without_sliding_along_it_at_once():
    """The branch ends between two commands; small steps snap to the same place as one step does."""
    cables = ((5.846493, 5.362754), (5.768661, 4.183464), (4.392779, 7.715016))
    robot = SpatialRobot.prototype(
        model="rod",
        segments=9,
        torsion_ratio=1.221507,
        cables=[Cable(angle=angle, offset_mm=offset) for angle, offset in cables],
    )
    center = 5.148608, -73.177348, 77.045733
    solver = SpatialSolver(robot, Scene([Sphere(center=center, radius=36.909137, spring=8.035536)]))
    start = solver.step(solver.rest(), (4.325514, 4.27849, 22.266013))
    goal = np.array([8.255952, 7.145837, 18.462971])
    state, small = solver.step(start, goal), start
    for share in (0.25, 0.5, 0.75, 0.9, 1):
        small = solver.step(small, start.cables_mm + share * (goal - start.cables_mm))
    assert state.status is small.status is Status.SNAPPED
    assert state.nodes == pytest.approx(small.nodes, abs=1e-6 * robot.length_mm)


def channel(right, back, left, front):
    """Return the sides of a channel along z, at these places."""
    sides = (
        ((right, 0.0, 0.0), (-1.0, 0.0, 0.0)),
        ((0.0, back, 0.0), (0.0, -1.0, 0.0)),
        ((left, 0.0, 0.0), (1.0, 0.0, 0.0)),
        ((0.0, front, 0.0), (0.0, 1.0, 0.0)),
    )
    return Scene(HalfSpace(point=point, normal=normal) for point, normal in sides)


def assert_certified(state):
    """Assert that a state solves the node-coordinate problem."""
    residuals, length = state.residuals(), state.robot.length_mm
    assert max(residuals.stationarity * length, residuals.gaps / length) < 1e-8


IN_A_CHANNEL = SpatialRobot.prototype(model="paper", angle=2 * math.pi / 3, between=1)


@pytest.mark.parametrize(
    ("walls", "commands"),
    [
        ((8.452, 8.251, -9.564, -7.145), ((-2.9, 6.0), (-5.9, 9.0))),
        ((9.292, 7.665, -9.843, -8.569), ((4.2, -4.4), (7.2, -8.5), (0.1, -12.0))),
    ],
)
def test_a_robot_presses_against_a_narrow_channel_at_very_many_points(walls, commands):
    """Up to 33 contacts at once, of a robot of 18 segments."""
    solver = SpatialSolver(IN_A_CHANNEL, channel(*walls))
    state = solver.rest()
    for command in commands:
        state = solver.step(state, command)
        assert state.status in (Status.CONVERGED, Status.SNAPPED, Status.STALLED)
        assert_certified(state)


@pytest.mark.parametrize(
    ("walls", "start", "goal"),
    [
        ((9.288, 9.072, -9.733, -8.550), (8.112, -0.111), (10.145, 4.361)),
        ((10.042, 8.977, -9.361, -7.750), (-7.894, 0.422), (-7.136, -4.444)),
    ],
)
def test_the_other_cable_of_a_pair_is_pulled_in_contact(walls, start, goal):
    """It runs through the opposite holes, which gives the robot a shape 1 mm away: it snaps there."""
    solver = SpatialSolver(IN_A_CHANNEL, channel(*walls))
    before = solver.step(solver.rest(), start)
    state = solver.step(before, goal)
    assert before.tensions[1] < 0
    assert state.status is Status.STALLED
    assert state.tensions.max() == pytest.approx(15, rel=1e-6)
    assert state.cables_mm[1] * goal[1] > 0
    assert_certified(state)


def test_a_long_descent_does_not_go_from_side_to_side_of_a_valley():
    """A rod let go from a box on a soft spring, whose damped iterates took twice the way to the least energy."""
    robot = SpatialRobot.prototype(between=2)
    box = Box(
        center=(0.0, 14.531591008141536, 144.6232435068666),
        sizes=(122.04193760177834, 12.503141346941263, 18.75471202041189),
        edge=0.12106603270416377,
        axis=(0.0, 0.0, 1.0),
        second=(0.0, 1.0, 0.0),
        spring=0.0006281891451149069,
    )
    solver = SpatialSolver(robot, Scene([box]))
    pulled = solver.step(solver.rest(), (5.55187, 11.44954))
    released = solver.step(pulled, (-0.22266, -0.45918))
    assert released.status is Status.SNAPPED
    assert released.factorizations < 2000
    assert max(solver.optimality(released)) < 1e-8
