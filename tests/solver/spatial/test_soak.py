"""Random walks in space among ordinary and adversarial obstacles; ``python -m soak`` is the long form."""

from dataclasses import replace

import numpy as np
import pytest
from soak.cores import CoreCheck
from soak.ends import holes_meet
from soak.episodes import STEPS, Episode, play, setting_of
from soak.report import Tally
from soak.walks import sample_increments, step, walk

from solver import Cable, Scene, Status
from solver.spatial import Box, Capsule, Cylinder, SpatialRobot, SpatialSolver, Sphere

SHORT = 2000
ROBOT = replace(SpatialRobot.prototype(model="paper"), touch=("backbone",))


def test_nothing_is_found_in_random_episodes():
    """But snaps of eq. 13 in which segments fold over: it has no equilibrium for the robot to come to rest in."""
    tally, cases = Tally(), []
    for index in range(SHORT // STEPS):
        counted, found = play(Episode("space", 1, index))
        tally.add(counted)
        cases += found
    assert {case["kind"] for case in cases} <= {"gave up"}
    assert len({tuple(case["episode"]) for case in cases}) <= SHORT // STEPS // 3
    assert tally.steps > 0.8 * SHORT  # walks end there
    assert tally.contact > SHORT / 10
    assert tally.traced > 0
    assert tally.certified > 0


def test_a_command_is_repeated_while_one_cable_lets_out_for_another():
    """The repeats end where a pair's pulled cable changes in contact, which the first one does not show."""
    tally, cases = play(Episode("space", 1170, 489, 40))
    assert cases == []
    assert tally.reasons == {"crossing": 1}


def test_a_long_descent_ends_where_a_segment_folds_over():
    """It used to go from side to side of a valley until its work was spent."""
    tally, cases = play(Episode("space", 1170, 1052, 380))
    assert cases == []
    assert set(tally.reasons) == {"folded"}
    assert tally.most_factorizations < 4000


def test_of_cables_that_come_in_on_a_descent_the_first_to_get_as_far_as_it_may_is_held():
    """Held together, five of them locked the robot again and again, until the work of the step was spent."""
    tally, cases = play(Episode("space rod", 1190, 995, 500))
    assert cases == []
    assert tally.statuses["GAVE_UP"] == 0


def test_a_cable_that_is_held_on_a_descent_is_one_that_has_come_in_so_far():
    """Two cables in one direction come in together, and neither can be held where both are not yet."""
    tally, cases = play(Episode("space rod", 1195, 965, 500))
    assert cases == []
    assert tally.statuses["GAVE_UP"] == 0


def test_a_robot_that_no_limit_stops_is_blocked_where_its_tension_has_risen_beyond_what_moves_it():
    """Each repeat of the command spent the work of a step at 140 EI/(aL), on descents in ever finer sub-steps."""
    setting, generator = setting_of(Episode("space rod", 1170, 1225, 500))
    taken = walk(setting.solver, sample_increments(generator, setting.solver, setting.scale, 500)[:303])
    robot, far = setting.solver.robot, taken.states[-1]
    assert far.tensions.max() > 100 * robot.rigidity / (robot.offset_mm * robot.length_mm)
    assert step(setting.solver, far, taken.commands[-1]).status is Status.BLOCKED


def test_a_step_among_contacts_that_wedge_the_robot_stalls_when_it_is_repeated():
    """Its tensions double within less than the smallest sub-step, in the course of which no descent leads on."""
    setting, generator = setting_of(Episode("space", 31, 17, 500))
    taken = walk(setting.solver, sample_increments(generator, setting.solver, setting.scale, 500)[:474])
    wedged = taken.states[-1]
    assert wedged.tensions.max() > 1.5 * taken.states[-2].tensions.max()
    assert step(setting.solver, wedged, taken.commands[-1]).status is Status.STALLED


def test_holes_of_a_taut_cable_meet_where_the_disks_of_a_soft_segment_do():
    rigidity = (5000.0,) * 4 + (100.0,) + (5000.0,) * 4
    robot = SpatialRobot.prototype(model="rod", segments=9, cables=(Cable(),), segment_rigidity=rigidity)
    solver = SpatialSolver(robot, Scene())
    states = [solver.rest()]
    for cable in (20.0, 24.0, 24.3, 24.5):
        states.append(solver.step(states[-1], (cable,)))
    assert [holes_meet(state) for state in states] == [False, False, False, False, True]


@pytest.mark.parametrize(
    "obstacle",
    [
        Sphere(center=(30, 0, 100), radius=5.2),
        Capsule(start=(30, -20, 100), end=(30, 20, 100), radius=5.2),
        Cylinder(start=(30, -20, 100), end=(30, 20, 100), radius=5.2, edge=1e-4),
        Box(center=(30, 0, 100), sizes=(12, 40, 12), edge=1e-4, axis=(1, 0.2, 0.1)),
    ],
)
def test_a_line_moved_over_an_obstacle_sweeps_its_core(obstacle):
    line = np.linspace((0, 0.1, 5), (0, 0.1, 185), 19)
    over = np.linspace((0, 0, 0), (60, 0, 0), 16)[:, None]
    still, beside = np.zeros((16, 1, 3)), np.array([0.0, 60.0, 0.0])
    check = CoreCheck(ROBOT, Scene([obstacle]))
    assert check.swept((line + over)[:, None], still).any()
    assert not check.swept((line + over + beside)[:, None], still).any()
    assert not check.swept((line + over)[:, None], over).any()
    assert not check.swept((line + over[:6])[:, None], still[:6]).any()
