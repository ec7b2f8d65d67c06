"""Motors of several cables at their limit: each holds its command, or keeps its limit while its cable follows."""

import math

import numpy as np
import pytest

from solver import Cable, Capsule, Circle, Ellipse, Load, Robot, Scene, Solver, Status
from solver.spatial import SpatialRobot, SpatialSolver

CIRCLE = Scene([Circle(center=(44, 104), radius=15)])
SAME_SIDE = Solver(Robot.prototype(between=1, cables=(Cable(), Cable(offset_mm=4, end=9))), CIRCLE)
SECTIONS = SpatialSolver(SpatialRobot.preset("rao_2021"), Scene())
SNAKE = SpatialSolver(SpatialRobot.preset("snake_arm"), Scene())
PAIR = (Cable(), Cable(angle=math.pi))
CASES = [
    (SAME_SIDE, (6.0, 3.5)),
    (Solver(Robot.preset("rao_2021"), Scene()), (6.0, -6.0, 1.0, 1.0)),
    (SECTIONS, (6.0, -6.0, -6.0, 1.0, 1.0, 1.0)),
    (SNAKE, (20.0, -5.0, -25.0, -5.0, 5.0, -5.0, 5.0, -5.0)),
]


def follow(solver, command, steps):
    """Return the state after a command in even steps from rest."""
    state = solver.rest()
    for part in np.linspace(0, 1, steps + 1)[1:]:
        state = solver.step(state, tuple(part * np.array(command)))
    return state


def worst_motor(state, command):
    """Return how far any motor is both short of its command, over the offset, and below its limit, as a fraction."""
    missed, spare = command - state.cables_mm, 1 - state.tensions / state.robot.max_tension
    assert missed.min() > -1e-9
    assert spare.min() >= 0
    return np.minimum(missed / state.robot.offset_mm, spare).max()


@pytest.mark.parametrize(("solver", "command"), CASES)
def test_where_motors_stall_does_not_depend_on_the_size_of_steps(solver, command):
    once, often = (follow(solver, command, steps) for steps in (1, 100))
    assert once.status is often.status is Status.STALLED
    assert often.cables_mm == pytest.approx(once.cables_mm, abs=1e-5 * solver.robot.offset_mm)
    assert often.nodes == pytest.approx(once.nodes, abs=1e-5 * solver.robot.length_mm)
    for state in (once, often):
        assert worst_motor(state, command) < 2e-6
        assert max(solver.optimality(state)) < 1e-9


@pytest.mark.parametrize(("solver", "command"), CASES)
def test_a_stalled_command_that_is_repeated_leads_no_farther(solver, command):
    state = follow(solver, command, 10)
    again = state
    for _ in range(5):
        again = solver.step(again, command)
    assert again.status is Status.STALLED
    assert again.cables_mm == pytest.approx(state.cables_mm, abs=1e-6 * solver.robot.offset_mm)


def test_a_repeated_command_does_not_pass_the_peak_that_stalled_it():
    """Behind it, where node 16 has left, a first sub-step of 0.02 a finds less tension than the limit."""
    robot = Robot(length_mm=18, segments=18, offset_mm=0.8, rigidity=50, max_tension=15, cables=PAIR)
    circles = (((4.300104, 13.533425), 1.498886), ((6.982616, 10.227232), 1.285341))
    solver = Solver(robot, Scene([Circle(center=center, radius=radius) for center, radius in circles]))
    state = solver.step(solver.rest(), (1.15084, -1.26593))
    again = solver.step(state, (1.15084, -1.26593))
    assert state.status is again.status is Status.STALLED
    assert again.cables_mm == pytest.approx(state.cables_mm, abs=1e-9 * robot.offset_mm)


def test_a_motor_at_its_limit_lets_its_cable_out_while_another_pulls():
    stalled = follow(SAME_SIDE, (4.0, 3.5), 1)
    pulled = SAME_SIDE.step(stalled, (6.0, stalled.cables_mm[1]))
    assert stalled.tensions[1] == pytest.approx(15, rel=1e-6)
    assert pulled.cables_mm[0] == pytest.approx(6.0)
    assert pulled.tensions[1] <= 15
    assert worst_motor(pulled, np.array([6.0, stalled.cables_mm[1]])) < 2e-6


SNAPS = [
    (
        Robot(
            length_mm=18.0,
            segments=18,
            offset_mm=0.8,
            rigidity=50.0,
            max_tension=15.0,
            between=1,
            cables=(
                Cable(end=8),
                Cable(angle=math.pi, end=8),
                Cable(offset_mm=0.48699609065305727),
                Cable(angle=math.pi, offset_mm=0.22841475990863686),
            ),
        ),
        [
            Capsule(
                start=(4.157833160246933, 18.41595810641984),
                end=(2.908549591938397, 17.81231489813668),
                radius=1.165208210762463,
            )
        ],
        [
            (-0.06285169091410282, 0.06285169091410282, 0.45577451986669737, -0.21377097173043266, 18.0),
            (0.08702642885063708, -0.08702642885063708, 0.6063498710161583, -0.28439501438925824, 18.0),
            (0.03017991317451999, -0.03017991317451999, 0.4629118358943021, -0.21711857216938327, 18.0),
        ],
    ),
    (
        Robot(
            length_mm=1311.3226180252539,
            segments=9,
            offset_mm=80.0,
            rigidity=500000.0,
            max_tension=15.0,
            length_range_mm=(1000.0, 1800.0),
            between=1,
            cables=(Cable(), Cable(angle=math.pi)),
        ),
        [
            Ellipse(
                center=(302.99935369478027, 1091.9190466220377),
                radii=(120.88154251278115, 138.71342327958587),
                axis=(-0.340334484390377, 0.9403044393890396),
                spring=1.7155760861205547,
            ),
            Circle(center=(415.4391313408832, 859.9453700360573), radius=114.75274863659435, spring=8.330515053340376),
        ],
        [
            (90.9803773837657, -100.07841512214227, 1000.0),
            (91.98037738376567, -101.17841512214224, 1300.6923564088638),
        ],
    ),
]


@pytest.mark.parametrize(("robot", "obstacles", "commands"), SNAPS, ids=["let out", "fed"])
def test_motors_that_a_snap_would_overload_let_their_cables_out_on_the_way(robot, obstacles, commands):
    solver = Solver(robot, Scene(obstacles))
    state = solver.rest()
    for command in commands:
        state = solver.step(state, command[:-1], command[-1])
    assert state.status is Status.STALLED
    assert state.length_mm == command[-1]
    assert worst_motor(state, np.array(command[:-1])) < 2e-6
    assert state.factorizations < 1000
    assert max(solver.optimality(state)) < 1e-9


def test_two_cables_of_one_direction_yield_to_the_weight_at_rest():
    cables = Cable(offset_mm=2.2), Cable(offset_mm=2.9)
    robot = SpatialRobot.prototype(model="rod", cables=cables, weight_per_length=(-0.02, 0, 0))
    solver = SpatialSolver(robot, Scene())
    rest = solver.rest()
    assert rest.status is Status.STALLED
    assert worst_motor(rest, np.zeros(2)) < 2e-6
    assert max(solver.optimality(rest)) < 1e-9
    assert solver.step(rest, (0.0, 0.0)).cables_mm == pytest.approx(rest.cables_mm, abs=1e-6)


@pytest.mark.parametrize("seed", range(12))
def test_no_motor_of_a_random_robot_stops_below_its_limit(seed):
    generator = np.random.default_rng(seed)
    cables = tuple(
        Cable(angle=float(generator.uniform(0, 2 * math.pi)), end=int(generator.choice([9, 18])))
        for _ in range(generator.integers(2, 7))
    )
    robot = SpatialRobot.prototype(model="rod", cables=cables, max_tension=float(generator.choice([4.0, 15.0])))
    solver = SpatialSolver(robot, Scene())
    command = generator.normal(0, 4, len(cables))
    once, often = (follow(solver, command, steps) for steps in (1, 20))
    for state in (once, often):
        assert state.status <= Status.STALLED
        assert worst_motor(state, command) < 2e-6
        assert (state.status is Status.STALLED) == (np.max(command - state.cables_mm) > 1e-9)
    assert often.nodes == pytest.approx(once.nodes, abs=1e-4 * robot.length_mm)


HEAVY = Robot.prototype(
    segments=12,
    length_range_mm=(60, 180),
    cables=(
        Cable(offset_mm=5.532, end=4),
        Cable(offset_mm=3.2799),
        Cable(angle=math.pi, offset_mm=4.3883, end=6),
        Cable(angle=math.pi, offset_mm=7.8788, end=4),
    ),
    weight_per_length=(-0.000429, 0.0004265),
    loads=(Load(node=10, force=(0.0893, 0.0269), moment=-0.7193),),
)
WEAK = Robot.prototype(
    cables=(
        Cable(offset_mm=7.812776, end=9),
        Cable(angle=math.pi, offset_mm=4.943345, end=9),
        Cable(angle=math.pi, offset_mm=5.381867, end=9),
    ),
    max_tension=8.0,
    precurvature=-0.008863154,
    weight_per_length=(-8.9934e-05, -3.691471e-05),
)
JUMPS = [
    (HEAVY, (-3.16046, 1.72238, -10.69353, 0.9737, 173.95867), (3.04125, 2.4714, 5.90427, 0.31431, 73.91011)),
    (WEAK, (8.26312, -5.76662, -9.09543), (6.69359, 3.15854, -9.70981)),
]


def put(solver, state, target):
    """Return the state under a command of cables [mm], and a length [mm] after them where the robot has one."""
    cables = len(solver.robot.cables)
    return solver.step(state, tuple(target[:cables]), *target[cables:])


@pytest.mark.parametrize(("robot", "first", "second"), JUMPS)
def test_a_tension_that_jumps_over_its_limit_holds_up_no_other_motor(robot, first, second):
    """Just below its limit, outside its band, one motor made all others wait, even one of a slack cable."""
    solver = Solver(robot, Scene())
    start = put(solver, solver.rest(), first)
    once = put(solver, start, second)
    often, way = start, np.array([*start.cables_mm, *first[len(robot.cables) :]])
    for part in np.linspace(0, 1, 21)[1:]:
        often = put(solver, often, way + part * (np.array(second) - way))
    command = np.array(second[: len(robot.cables)])
    for state in (once, often):
        assert state.status is Status.STALLED
        assert worst_motor(state, command) < 2e-6
    assert often.nodes == pytest.approx(once.nodes, abs=1e-5 * robot.length_mm)


@pytest.mark.parametrize("name", ["rao_2021", "snake_arm", "neuroendoscope", "guidewire"])
@pytest.mark.parametrize(("robots", "solvers"), [(Robot, Solver), (SpatialRobot, SpatialSolver)])
def test_stalled_cables_that_are_let_out_to_zero_have_met_their_command(robots, solvers, name):
    robot = robots.preset(name)
    solver, generator = solvers(robot, Scene()), np.random.default_rng(1)
    for _ in range(30):
        stalled = solver.step(solver.rest(), tuple(generator.normal(0, robot.offset_mm / 2, len(robot.cables))))
        released = solver.step(stalled, (0.0,) * len(robot.cables))
        assert released.status <= Status.SNAPPED
        assert released.cables_mm == pytest.approx(0, abs=1e-11)
        assert max(solver.optimality(released)) < 1e-9


def test_a_robot_whose_cables_are_let_out_retracts_all_the_way():
    cables = tuple(
        Cable(offset_mm=offset, end=end) for offset, end in ((5.250245, 3), (4.635192, 2), (6.219038, 3), (5.464825, 6))
    )
    load = Load(node=6, force=(-0.184509, -0.0476642), moment=0.650204)
    robot = Robot.prototype(
        segments=6,
        length_range_mm=(60, 180),
        max_tension=2.0,
        between=2,
        cables=cables,
        weight_per_length=(-0.0001873, -0.000479189),
        loads=(load,),
    )
    solver = Solver(robot, Scene())
    out = solver.step(solver.rest(), (-0.4309975, -0.2605176, -0.2702091, -0.0692769), 179.00083)
    back = solver.step(out, (-3.784854, -7.473656, -11.235263, -4.298593), 76.031027)
    assert back.status is Status.CONVERGED
    assert back.length_mm == pytest.approx(76.031027)


def test_cables_that_lock_a_straight_robot_to_first_order_do_not_block_it():
    """Three of the cables surround the backbone; what one of them lets out lets the others bend the robot."""
    cables = (
        Cable(angle=3.8658719, offset_mm=5.3210395),
        Cable(angle=4.9840911, offset_mm=7.5964209),
        Cable(angle=0.8266089, offset_mm=5.4431837, end=4),
        Cable(angle=0.9217387, offset_mm=4.9405651),
    )
    command = (0.278, -11.632, -13.399, 2.126)
    ends = []
    for limit in (30.0, math.inf):
        robot = SpatialRobot(
            length_mm=180, segments=8, offset_mm=7.753542, cables=cables, max_tension=limit, torsion_ratio=0.95054
        )
        solver = SpatialSolver(robot, Scene())
        ends.append(solver.step(solver.rest(), command))
        assert ends[-1].status <= Status.SNAPPED
        assert ends[-1].cables_mm == pytest.approx(command)
        assert max(solver.optimality(ends[-1])) < 1e-9
    assert ends[1].nodes == pytest.approx(ends[0].nodes, abs=1e-6)


def test_a_motor_that_has_no_more_to_let_out_holds_and_stops_the_others():
    cables = tuple(Cable(angle=angle) for angle in (5.47, 1.8, 3.79, 4.89))
    robot = SpatialRobot.prototype(model="rod", cables=cables, max_tension=40.0, max_cable_mm=6.0)
    solver = SpatialSolver(robot, Scene())
    command = (5.72, -2.26, 2.15, 1.25)
    once, often = (follow(solver, command, steps) for steps in (1, 10))
    for state in (once, often):
        assert state.status is Status.STALLED
        assert state.cables_mm[1] == pytest.approx(-6.0, abs=1e-3)
        assert state.tensions[1] == pytest.approx(40.0, rel=2e-6)
        assert state.cables_mm.min() > -6 - 1e-9
        assert max(solver.optimality(state)) < 1e-9
    assert often.cables_mm == pytest.approx(once.cables_mm, abs=1e-3)


@pytest.mark.parametrize(
    ("angles", "command"),
    [
        ((0.0, 0.0, math.pi), (0.75, 0.75, 3.84)),
        ((0.0, 2 * math.pi / 3, 4 * math.pi / 3, 0.0, 2 * math.pi / 3), (-0.79, 3.84, 0.63, -0.79, 3.84)),
    ],
)
def test_cables_through_the_same_holes_stall_together(angles, command):
    """Only the sum of their tensions is determined; the lengths that follow differ by rounding from those held."""
    robot = SpatialRobot.prototype(model="rod", cables=tuple(Cable(angle=angle) for angle in angles))
    solver = SpatialSolver(robot, Scene())
    once, often = (follow(solver, command, steps) for steps in (1, 20))
    for state in (once, often):
        assert state.status is Status.STALLED
        assert worst_motor(state, command) < 2e-6
        assert max(solver.optimality(state)) < 1e-9
    assert often.nodes == pytest.approx(once.nodes, abs=1e-5 * robot.length_mm)


def test_a_load_goes_over_to_the_cable_beside_that_is_let_out_a_little_less():
    """Which of both holds it is not resolved in the smallest parts of the way."""
    offsets = 0.6380095137318265, 0.6589530728663991, 0.6712696651734419, 0.7151570307259687, 0.7097536187655864
    cables = tuple(Cable(angle=2 * math.pi * k / 3, offset_mm=offset) for k, offset in enumerate(offsets))
    robot = SpatialRobot(
        length_mm=18.0,
        segments=18,
        offset_mm=0.8,
        rigidity=50.0,
        max_tension=15.0,
        torsion_ratio=1.5225191413837418,
        cables=(*cables, Cable(angle=10 / 3 * math.pi, offset_mm=0.5620087480869443)),
    )
    solver = SpatialSolver(robot, Scene())
    pulled = np.array([-2.05510381, -2.51327412, 2.51327412, -2.30360506, -2.51327412, 2.26620688])
    released = np.array([-2.0355047, -1.67617808, 1.92456281, -2.28163603, -1.80539936, 1.61130644])
    stalled = solver.step(solver.rest(), pulled)
    assert stalled.tensions[[2, 5]].min() > 1  # both hold the robot
    state = solver.step(stalled, released)
    assert state.status is Status.CONVERGED
    assert state.cables_mm == pytest.approx(released, abs=1e-9)
    assert state.factorizations < 300
