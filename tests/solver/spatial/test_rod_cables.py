"""Cables of the rod in space that pull against each other."""

import math
from functools import reduce

import numpy as np
import pytest
from soak.episodes import Episode, setting_of
from soak.walks import sample_increments, walk

from solver import Cable, Scene, Status
from solver.spatial import SpatialRobot, SpatialSolver, Sphere


@pytest.mark.parametrize("count", [3, 4, 6])
def test_cables_all_around_stall_at_the_tension_limit(count):
    cables = tuple(Cable(angle=2 * math.pi * k / count) for k in range(count))
    solver = SpatialSolver(SpatialRobot.prototype(model="rod", cables=cables), Scene())
    bent = solver.step(solver.rest(), [4 * math.cos(cable.angle) for cable in cables])
    tight = solver.step(bent, [4 * math.cos(cable.angle) + 0.5 for cable in cables])
    again = solver.step(tight, [4 * math.cos(cable.angle) + 0.5 for cable in cables])
    for state in (tight, again):
        assert state.status is Status.STALLED
        assert state.tensions.max() == pytest.approx(15, rel=1e-6)
        assert max(solver.optimality(state)) < 1e-10
    assert again.cables_mm == pytest.approx(tight.cables_mm, abs=1e-9)
    free = solver.step(again, bent.cables_mm)
    assert free.status is Status.CONVERGED
    assert free.nodes == pytest.approx(bent.nodes, abs=1e-7)


@pytest.mark.parametrize("count", [3, 4, 6])
def test_cables_all_around_that_are_released_let_the_robot_rest(count):
    """At rest their slopes are dependent, and Newton's method finds no step."""
    cables = tuple(Cable(angle=2 * math.pi * k / count) for k in range(count))
    solver = SpatialSolver(SpatialRobot.prototype(model="rod", cables=cables), Scene())
    bent = solver.step(solver.rest(), [0.25 * math.cos(cable.angle) for cable in cables])
    released = solver.step(bent, count * [0.0])
    assert released.status is Status.CONVERGED
    assert released.factorizations == 0
    assert not released.tensions.any()
    assert np.array_equal(released.nodes, solver.rest().nodes)


def test_cables_go_slack_on_a_robot_that_is_straight_then():
    cables = tuple(Cable(angle=math.pi / 2 * k) for k in range(4))
    solver = SpatialSolver(SpatialRobot.prototype(model="rod", cables=cables), Scene())
    state = solver.rest()
    for pull in (0.094, 0.012, -0.07):
        state = solver.step(state, (pull, -1.3, -4.0, -2.0))
        assert state.status is Status.CONVERGED
    assert not state.tensions.any()
    assert state.slacks_mm == pytest.approx([0.07, 1.3, 4.0, 2.0], abs=1e-12)  # a straight robot takes up nothing
    assert state.nodes == pytest.approx(solver.rest().nodes, abs=1e-12)
    taut = solver.step(state, (0.05, -1.3, -4.0, -2.0))  # a bend of 0.05 / a takes T a = EI 0.05 / (a L)
    assert taut.tensions == pytest.approx([5000 * 0.05 / (8**2 * 180), 0, 0, 0], rel=1e-3)
    assert taut.slacks_mm[0] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("ends", "limit", "pulls"),
    [
        ((18, 18, 18, 18, 18, 18), 6.6, (3.61, -5.94, 3.03, 2.77, -0.85, -2.67)),
        ((18, 18, 18, 9, 18, 18), 10.4, (0.25, -2.85, 0.1, -0.86, 0.71, 4.23)),
        ((9, 18, 9, 18, 18), 11.3, (-0.8, -0.73, -5.92, 3.95, -1.23)),
    ],
)
def test_cables_on_the_edge_of_slack_do_not_keep_others_from_stalling(ends, limit, pulls):
    """Roundoff leaves tensions of 1e-16 N of either sign: none is lost, none pushes, and all others reach the limit."""
    cables = tuple(Cable(angle=2 * math.pi / len(ends) * k, end=end) for k, end in enumerate(ends))
    robot = SpatialRobot.prototype(model="rod", cables=cables, max_tension=limit)
    solver = SpatialSolver(robot, Scene())
    state = solver.step(solver.rest(), pulls)
    edge = solver.step(state, np.where(state.tensions > 0, state.cables_mm, state.cables_mm + state.slacks_mm))
    assert state.status is Status.STALLED
    for found in (state, edge):
        assert (found.tensions >= 0).all()
        assert found.slacks_mm.min() > -1e-9
        assert np.abs(found.tensions * found.slacks_mm).max() < 1e-9
        assert max(solver.optimality(found)) < 1e-9
    tightened = solver.step(edge, np.where(edge.tensions > 1e-9, edge.cables_mm, edge.cables_mm + 1e-3))
    assert np.abs(tightened.tensions * tightened.slacks_mm).max() < 1e-9


def test_a_gap_out_of_reach_among_those_that_conflict_is_not_followed():
    """It is infinite, and a search for where it closes had a command that is no number."""
    setting, generator = setting_of(Episode("space rod", 52, 11, 500))
    increments = sample_increments(generator, setting.solver, setting.scale, 500)
    states = walk(setting.solver, increments[:16]).states
    assert max(state.status for state in states) < Status.GAVE_UP


def follow(solver, *commands):
    """Return the state after commands from rest."""
    return reduce(solver.step, commands, solver.rest())


def assert_no_motor_pulls_on(state, command):
    """Check that every motor holds its command below its limit, or has let its cable follow at the limit."""
    missed, spare = command - state.cables_mm, 1 - state.tensions / state.robot.max_tension
    assert missed.min() > -1e-9
    assert spare.min() >= 0
    assert np.minimum(missed / state.robot.offset_mm, spare).max() < 2e-6


def test_motors_reach_their_limit_where_the_tension_jumps_over_it():
    """Cables that hold a robot tight leave it no way; where others become taut, tensions change without a motion."""
    angles = 5.662756963532212, 1.9606877533948088, 4.734160137367538, 3.3922960372330353, 1.1103390078608542
    robot = SpatialRobot.prototype(
        model="rod",
        max_tension=100.0,
        cables=tuple(Cable(angle=angle) for angle in (*angles, 0.7586073201773602)),
        torsion_ratio=0.9497161784381833,
        precurvature=(-0.0690788573108327, 0.08236914456097777, -0.07823735923544457),
        weight_per_length=(-5.103689445903943e-05, -0.00012408300467337387, -5.169735874797899e-05),
    )
    start = 1.70554835364947, -1.3189854078846355, 0.8323239569614271, -1.2790937597617007
    start += -0.038388482335240025, 0.5570297109661813
    near = -5.40655447, 7.35827771, -7.4264462, -0.52067067, 6.02357317, 4.10324375
    command = -5.406554466591348, 7.3596201982790275, -7.426446198236546, -0.5197058122344402
    command += 6.024511040758811, 4.103792845397489
    solver = SpatialSolver(robot, Scene())
    stalled = follow(solver, start, near, command)
    again = solver.step(stalled, command)
    assert stalled.status is again.status is Status.STALLED
    assert again.cables_mm == pytest.approx(stalled.cables_mm, abs=1e-6)
    assert_no_motor_pulls_on(stalled, command)


def test_no_motor_pulls_across_a_jump_of_the_tension():
    """Cables all around lock a robot that one of them, twice there, would still bend: all motors go to their limit."""
    robot = SpatialRobot.prototype(
        model="rod",
        segments=18,
        between=1,
        cables=tuple(Cable(angle=math.pi / 2 * quarter) for quarter in range(5)),
        torsion_ratio=1.022244741527736,
    )
    command = np.array([-2.6523284174233144, -2.69361358272645, 2.582094007069561])
    command = np.append(command, [2.7144816961851554, -2.4466038268875936])
    solver = SpatialSolver(robot, Scene())
    stalled = follow(solver, command)
    again = solver.step(stalled, command)
    assert stalled.status is again.status is Status.STALLED
    assert again.cables_mm == pytest.approx(stalled.cables_mm, abs=1e-6)
    assert_no_motor_pulls_on(stalled, command)


def test_a_robot_snaps_to_rest_while_a_motor_lets_its_cable_out():
    """The descent ends under loads that the motor cannot hold yet, and lets the cable out farther."""
    rigidity = 5242.891707880753, 13584.332128660279, 2223.899500672998, 2714.1086498001, 5259.688538378054
    rigidity += 3086.5982631237252, 2093.0091555507543, 5509.531965056304, 9065.460931028356, 5298.548194359921
    rigidity += 3414.352517107732, 2063.8519260933767, 8968.33209506859, 2881.9372975064157, 3110.7580942041295
    rigidity += 11453.403719979802, 9773.357515856753, 3024.129021756759
    robot = SpatialRobot.prototype(
        model="rod",
        segments=18,
        max_tension=15.0,
        cables=(
            Cable(offset_mm=4.736824863386806, end=7),
            Cable(angle=math.pi / 2, offset_mm=5.149602288473183),
            Cable(angle=math.pi, offset_mm=5.724292298352526, end=7),
        ),
        torsion_ratio=1.675968147348699,
        segment_rigidity=rigidity,
        weight_per_length=(0.012073713247048484, 0.003992768020843243, 0.0031592735376558545),
    )
    ball = Sphere(center=(14.09947883220876, 12.889999232841292, 106.5348561362253), radius=10.70204816604527)
    solver = SpatialSolver(robot, Scene([ball]))
    rest = solver.rest()
    assert rest.status is Status.STALLED
    assert max(solver.optimality(rest)) < 1e-9
    assert rest.tensions.max() == pytest.approx(15.0, rel=1e-6)
    assert rest.cables_mm == pytest.approx([0.0, 0.0, -0.80056657], abs=1e-6)
