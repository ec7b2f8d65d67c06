"""Random walks in the plane among ordinary and adversarial obstacles; ``python -m soak`` is the long form."""

from dataclasses import replace

import numpy as np
import pytest
from soak.cores import CoreCheck, windings
from soak.ends import is_wedged
from soak.episodes import STEPS, Episode, play
from soak.report import Tally

from solver import Capsule, Circle, Robot, Scene, Solver, Status
from solver.common.robot import MODELS

SHORT = 3000
ROBOT = Robot.prototype(model="paper")
LINE = replace(ROBOT, touch=("backbone",))


@pytest.mark.parametrize("model", MODELS)
def test_nothing_is_found_in_random_episodes(model):
    tally, cases = Tally(), []
    for index in range(SHORT // STEPS):
        counted, found = play(Episode(model, 1, index))
        tally.add(counted)
        cases += found
    assert cases == []
    assert tally.steps == SHORT
    assert tally.contact > SHORT / 10
    assert tally.traced > 0
    assert tally.certified > 0
    assert {"CONVERGED", "SNAPPED", "STALLED"} <= set(tally.statuses)


def test_every_step_given_up_on_is_looked_at():
    """One episode of eq. 13 that is given up on at several ends of its branch, most of them again and again."""
    tally, cases = play(Episode("space", 61, 36, 500))
    assert cases == []
    assert tally.statuses["GAVE_UP"] > 10
    assert tally.reasons.total() == tally.statuses["GAVE_UP"]
    assert tally.reasons["not looked at"] == 0


def test_an_episode_follows_from_its_seed():
    first, again = (play(Episode("paper", 3, 4))[0] for _ in range(2))
    assert first == again


def test_a_robot_that_its_cable_pushes_between_circles_is_wedged():
    """It can go back, but no farther, by the slopes of the closed gaps alone; in ordinary contact both is open."""
    robot = Robot.prototype(model="paper", length_mm=155.13360802275173, between=1, length_range_mm=(100.0, 180.0))
    circles = (
        Circle(center=(40.92822065361144, 136.2802478659636), radius=3.019327553383534),
        Circle(center=(32.92933167426361, 127.59814622765555), radius=3.067062362197335),
    )
    solver = Solver(robot, Scene(circles))
    states = [solver.rest()]
    for command in ((4.48, 141.97), (14.34, 143.33), (0.05, 144.16), (3.7028190119548805, 180.0), (0.0, 180.0)):
        states.append(solver.step(states[-1], *command))
    wedged = states[-1]
    assert wedged.status is Status.GAVE_UP
    assert is_wedged(wedged, np.array([0.0, 180.0]))
    assert not is_wedged(wedged, np.array([1.0, 180.0]))
    assert solver.step(wedged, 1.0, 180.0).status < Status.BLOCKED
    assert not any(is_wedged(state, np.array(command)) for state in states[:-1] for command in ((0, 180), (9, 150)))


PLACE = np.array([[0.0, 0.0]])


@pytest.mark.parametrize(
    ("before", "after", "turns"),
    [
        ([(-1, -3), (-1, -1), (-1, 1), (-1, 3)], [(1, -3), (1, -1), (1, 1), (1, 3)], -1),  # an edge sweeps over it
        ([(-1, -3), (-1, -1), (-1, 1)], [(1, -3), (1, -2.5), (1, -2)], 0),  # the free end passes it
        ([(-1, -3), (-1, -1), (-1, 1)], [(-0.1, -3), (-0.1, -1), (-0.1, 1)], 0),  # it comes near
        ([(-1, -3), (-1, 3), (5, 3)], [(1, -3), (1, -1), (5, -1)], -1),  # all of it pulled through
    ],
)
def test_windings_tell_a_sweep_from_a_free_end_that_passes(before, after, turns):
    assert windings(np.array([before], float), np.array([after], float), PLACE) == [[turns]]


@pytest.mark.parametrize(
    "obstacle",
    [Circle(center=(30, 100), radius=6), Capsule(start=(30, 90), end=(50, 100), radius=5.2)],
)
def test_a_robot_moved_over_an_obstacle_sweeps_its_core(obstacle):
    line = np.column_stack([np.zeros(19), np.linspace(0, 180, 19)])
    over = np.linspace((0, 0), (60, 0), 16)[:, None]
    points = (line + over)[:, None]
    still = np.zeros((16, 1, 2))
    swept = CoreCheck(LINE, Scene([obstacle])).swept(points, still)
    assert swept.any()
    assert not swept[:10].all()
    with_it = over * [1.0, 0.0]
    assert not CoreCheck(LINE, Scene([obstacle])).swept(points, with_it).any()


def test_the_check_sees_the_one_step_that_passed_a_circle():
    """The end that a step of 11.3 mm came to when both neighbours of an edge passed a circle of 1.05 × the spacing."""
    circle = Circle(center=(30.6, 160.8), radius=5.25)
    free = Solver(ROBOT, Scene())
    states = [free.step(free.rest(), cable) for cable in np.linspace(0.01, 11.3, 200)]
    points = np.stack([state.points for state in states])
    assert CoreCheck(ROBOT, Scene([circle])).swept(points, np.zeros((200, 1, 2))).any()


def test_a_robot_whose_disks_meet_at_a_corner_is_wedged():
    """Drawn back, it cannot bend on round the corner between two of its points: BLOCKED, as its closed gaps confirm.

    The base has no limit, and what the closed gaps confirm is no finding.
    """
    tally, cases = play(Episode("rod", 1150, 1761, 500))
    assert cases == []
    assert tally.blocked == 3
    assert tally.blocked_unconfirmed == 0


def test_opposed_cables_that_have_come_in_as_far_as_they_may_are_let_out_again_one_at_a_time():
    """Let out together, they came in together and locked the robot again, until the work of the step was spent."""
    tally, cases = play(Episode("pair", 1190, 347, 500))
    assert cases == []
    assert tally.statuses["GAVE_UP"] == 0
