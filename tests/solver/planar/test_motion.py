"""Obstacles that move within a step: the robot follows as if its cable had been pulled among them where they are."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from soak.scale import scale_robot, scale_scene

from solver import (
    BatchSolver,
    Capsule,
    Circle,
    Ellipse,
    HalfPlane,
    Polygon,
    ReferenceBatch,
    Robot,
    Rows,
    Scene,
    Solver,
    Status,
    TransitionMemo,
)
from solver.common.robot import MODELS

EVERY_MODEL = pytest.mark.parametrize("model", MODELS)
FEASIBLE, OPTIMAL, BAND = 1e-12, 1e-8, 1e-6
DISC = Circle(center=(45.0, 110.0), radius=12.0)
SHAPES = {
    "circle": DISC,
    "wall": HalfPlane(point=(40.0, 110.0), normal=(-1.0, 0.1)),
    "ellipse": Ellipse(center=(48.0, 110.0), radii=(14.0, 10.0), axis=(1.0, 0.3)),
    "capsule": Capsule(start=(45.0, 105.0), end=(60.0, 120.0), radius=10.0),
    "polygon": Polygon(corners=((40.0, 100.0), (60.0, 100.0), (60.0, 120.0), (40.0, 120.0)), radius=5.0),
    "sprung": replace(DISC, spring=0.4),
}


def robot_of(model, **kwargs):
    return Robot.prototype(model=model, between=1, **kwargs)


def pulled(solver, target, steps=20):
    state = solver.rest()
    for k in range(1, steps + 1):
        state = solver.step(state, target * k / steps)
        assert state.status is Status.CONVERGED
    return state


def shifted(scene, by):
    return Scene(obstacle.shifted(by) for obstacle in scene)


def checked(robot, state):
    """Check an equilibrium in its own scene; return its status."""
    assert state.gaps.min() >= -FEASIBLE * robot.length_mm
    assert optimality(robot, state).max() <= OPTIMAL
    assert state.tension <= robot.max_tension
    if state.status is Status.STALLED:
        assert state.tension >= robot.max_tension * (1 - BAND)
    return state.status


def optimality(robot, state):
    """Return the residuals of an equilibrium in its own scene, which may overlap the straight robot."""
    batch, none = BatchSolver(robot, 1, len(state.scene)), np.zeros(1, np.int64)
    command = state.block[None, : len(robot.cables) + 1]
    rows = Rows(robot, (None,), (state.scene,), np.ones(1, bool), state.block[None], none, none, none, command)
    batch.set_rows([0], rows)
    return batch.optimality()


@EVERY_MODEL
@pytest.mark.parametrize("shape", SHAPES)
def test_moving_a_scene_leads_where_pulling_in_the_moved_scene_does(model, shape):
    robot, scene = robot_of(model), Scene([SHAPES[shape]])
    there = shifted(scene, (-4.0, 3.0))
    moved = Solver(robot, scene).step(pulled(Solver(robot, scene), 6.5), 6.5, scene=there)
    direct = pulled(Solver(robot, there), 6.5)
    assert moved.status is Status.CONVERGED
    assert moved.scene == there
    assert moved.contact.any()
    assert np.abs(moved.nodes - direct.nodes).max() <= 1e-8 * robot.length_mm
    assert np.abs(moved.forces - direct.forces).max() <= 1e-7
    assert moved.tension == pytest.approx(direct.tension, rel=1e-7)


@EVERY_MODEL
def test_contacts_come_and_go(model):
    robot, scene = robot_of(model), Scene([DISC])
    solver = Solver(robot, scene)
    state = pulled(solver, 6.5)
    away = solver.step(state, 6.5, scene=shifted(scene, (25.0, 0.0)))
    assert state.contact.any()
    assert not away.contact.any()
    back = solver.step(away, 6.5, scene=scene)
    assert np.abs(back.nodes - state.nodes).max() <= 1e-8 * robot.length_mm
    assert back.onset_tension > 0


@EVERY_MODEL
def test_an_obstacle_grows(model):
    robot, scene, larger = robot_of(model), Scene([DISC]), Scene([replace(DISC, radius=15.0)])
    grown = Solver(robot, scene).step(pulled(Solver(robot, scene), 6.5), 6.5, scene=larger)
    direct = pulled(Solver(robot, larger), 6.5)
    assert np.abs(grown.nodes - direct.nodes).max() <= 1e-8 * robot.length_mm


@EVERY_MODEL
def test_a_cable_is_pulled_while_the_scene_moves(model):
    robot, scene = robot_of(model), Scene([DISC])
    there = shifted(scene, (-4.0, 3.0))
    moved = Solver(robot, scene).step(pulled(Solver(robot, scene), 5.0), 7.0, scene=there)
    assert np.abs(moved.nodes - pulled(Solver(robot, there), 7.0).nodes).max() <= 1e-8 * robot.length_mm


@EVERY_MODEL
def test_a_scene_that_stays_is_a_step(model):
    solver = Solver(robot_of(model), Scene([DISC]))
    state = pulled(solver, 6.0)
    assert np.array_equal(solver.step(state, 6.5, scene=solver.scene).block, solver.step(state, 6.5).block)


@EVERY_MODEL
@pytest.mark.parametrize("max_tension", [15.0, 4.0])
def test_random_motions_keep_every_promise(model, max_tension):
    robot, seen = robot_of(model, max_tension=max_tension), Counter()
    for seed in range(6):
        generator = np.random.default_rng(seed)
        scene = sampled_scene(generator, robot)
        solver = Solver(robot, scene)
        state, target = solver.rest(), 0.0
        for k in range(40):
            if k % 10 == 0:
                motion = generator.normal(size=(len(scene), 2))
            target = float(np.clip(target + generator.uniform(-0.3, 0.8), 0, 12))
            there = Scene(obstacle.shifted(by) for obstacle, by in zip(state.scene, motion, strict=True))
            state = solver.step(state, target, scene=there)
            seen[checked(robot, state)] += 1
            assert (state.scene == there) == (state.status not in (Status.BLOCKED, Status.GAVE_UP))
            if state.scene != there:
                motion = -motion
    assert seen[Status.CONVERGED] > 40
    assert seen[Status.STALLED] > (40 if max_tension == 4.0 else -1)


def sampled_scene(generator, robot):
    while True:
        circles = [
            Circle(center=tuple(generator.uniform((38, 75), (75, 150))), radius=generator.uniform(10, 16))
            for _ in range(generator.integers(1, 4))
        ]
        try:
            return Solver(robot, Scene(circles)).scene
        except ValueError:
            continue


def test_a_cable_pays_out_at_its_limit_and_is_pulled_again():
    robot, scene = robot_of("rod", max_tension=2.6), Scene([DISC])
    solver = Solver(robot, scene)
    state = pulled(solver, 5.0)
    pressed = solver.step(state, 5.0, scene=shifted(scene, (-8.0, 0.0)))
    assert pressed.status is Status.STALLED
    assert pressed.cable_mm < 5.0
    assert robot.max_tension * (1 - BAND) <= pressed.tension <= robot.max_tension
    released = solver.step(pressed, 5.0, scene=scene)
    assert released.status is Status.CONVERGED
    assert np.abs(released.nodes - state.nodes).max() <= 1e-8 * robot.length_mm


def test_obstacles_stop_where_they_would_crush_the_robot():
    robot = robot_of("rod", max_tension=4.0)
    walls = Scene([HalfPlane(point=(-10.0, 0.0), normal=(1.0, 0.0)), HalfPlane(point=(30.0, 0.0), normal=(-1.0, 0.0))])
    solver = Solver(robot, walls)
    state = pulled(solver, 1.5)
    there = Scene([walls.obstacles[0], walls.obstacles[1].shifted((-25.0, 0.0))])
    pressed = solver.step(state, 1.5, scene=there)
    assert pressed.status is Status.BLOCKED
    reached = pressed.scene.obstacles[1].point[0]
    assert robot.offset_mm - 1e-6 <= reached < 30.0
    checked(robot, pressed)
    back = solver.step(pressed, 1.5, scene=walls)
    assert back.status is Status.CONVERGED
    assert back.scene == walls


@pytest.mark.parametrize("parts", [1, 10, 200])
def test_obstacles_stop_where_the_cable_of_the_papers_model_would_push(parts):
    """Between two circles that close in, the tension falls from 1.2 N; that model knows no slack cable."""
    solver = Solver(
        Robot.prototype(model="paper", max_tension=6.0),
        Scene(
            [
                Circle(center=(34.83596032732177, 131.95657732709188), radius=12.331042199286625),
                Circle(center=(-34.37504537371748, 125.79977166646958), radius=10.376749748180693),
            ]
        ),
    )
    there = Scene(o.shifted((dx, 0.0)) for o, dx in zip(solver.scene, (-20.9589253, 21.246699), strict=True))
    state = solver.step(solver.rest(), 2.7623959207524678)
    for k in range(1, parts + 1):
        state = solver.step(state, state.cable_mm, scene=solver.scene.moved_towards(there, k / parts))
        assert checked(solver.robot, state) in (Status.CONVERGED, Status.BLOCKED)
        assert state.tension >= 0
    assert state.status is Status.BLOCKED
    assert state.scene.obstacles[0].center[0] == pytest.approx(14.8267, abs=2e-4)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("spring", [None, 5.0])
@pytest.mark.parametrize("parts", [1, 20])
def test_a_slack_robot_gives_way_to_an_obstacle(model, spring, parts):
    """All its segments may shear or bend by -0.12 rad, which leaves 4 mm of clearance at no change in cable length."""
    disc = Circle(center=(-25.0, 100.0), radius=12.0, spring=spring)
    solver = Solver(robot_of(model), Scene([disc]))
    there, state = shifted(solver.scene, (21.0, 0.0)), solver.rest()
    for k in range(1, parts + 1):
        state = solver.step(state, 0.0, scene=solver.scene.moved_towards(there, k / parts))
        assert checked(solver.robot, state) in (Status.CONVERGED, Status.SNAPPED)
    assert state.scene == there
    assert state.nodes[:, 0].max() > 4.0
    assert state.cable_mm <= 0.00625 * solver.robot.offset_mm  # the pretension of the paper's model
    away = solver.step(state, 0.0, scene=solver.scene)
    assert away.cable_mm == 0.0
    assert abs(away.nodes[:, 0]).max() < 1e-9


@EVERY_MODEL
@pytest.mark.parametrize("across", [-90.0, -60.0, 90.0])
def test_no_obstacle_passes_through_the_robot(model, across):
    robot = robot_of(model)
    disc = Circle(center=(math.copysign(45.0, -across), 110.0), radius=12.0)
    solver = Solver(robot, Scene([disc]))
    state = solver.step(solver.rest(), 1.0)
    moved = solver.step(state, 1.0, scene=Scene([disc.shifted((across, 0.0))]))
    assert moved.gaps.min() >= -FEASIBLE * robot.length_mm
    if moved.status not in (Status.BLOCKED, Status.GAVE_UP):
        assert moved.scene.obstacles[0].center[0] * across > 0
    (x, y), backbone = moved.scene.obstacles[0].center, moved.nodes[:, :2]
    if y < backbone[:, 1].max():  # the robot stays on the side that the obstacle comes from
        crossing = np.interp(y, backbone[:, 1], backbone[:, 0])
        assert (crossing - x) * across > 0


@EVERY_MODEL
@pytest.mark.parametrize("threads", [1, 2])
def test_batch_moves_scenes_as_solvers_do(model, threads):
    robot, generator, seen = robot_of(model, max_tension=2.5), np.random.default_rng(2), set()
    scenes = [Scene([DISC.shifted(by), DISC.shifted((by[0], -60.0))]) for by in generator.uniform(-3, 8, (20, 2))]
    batch = BatchSolver(robot, len(scenes), 2, threads)
    for k, scene in enumerate(scenes):
        batch.assign(k, scene)
    batch.rest(range(len(scenes)))
    solvers = [Solver(robot, scene) for scene in scenes]
    alone = [solver.rest() for solver in solvers]
    for _ in range(12):
        commands = np.clip(batch.blocks[:, 0] + generator.uniform(-0.2, 1.2, len(scenes)), 0, 12)
        motions = [(0.0, 0.0) if generator.random() < 0.3 else generator.normal(size=2) for _ in scenes]
        there = [shifted(state.scene, by) for state, by in zip(alone, motions, strict=True)]
        batch.step(commands, scenes=there)
        for k, solver in enumerate(solvers):
            alone[k] = solver.step(alone[k], commands[k], scene=there[k])
            assert np.array_equal(batch.blocks[k], alone[k].block)
            assert batch.statuses[k] == alone[k].status
            assert batch.scene(k) == alone[k].scene
            seen.add(alone[k].status)
    assert {Status.CONVERGED, Status.STALLED} <= seen
    rows = batch.get_rows([3])
    batch.step(commands + 0.1)
    batch.set_rows([3], rows)
    assert batch.scene(3) == alone[3].scene


@EVERY_MODEL
@pytest.mark.parametrize("s", [2.0**-10, 0.5, 2.0**10])
def test_scaling_by_a_power_of_two_gives_the_same_bits(model, s):
    robot = robot_of(model, max_tension=4.0)
    scene = Scene([DISC, SHAPES["sprung"].shifted((0.0, -60.0))])
    states = []
    for factor in (1.0, s):
        solver = Solver(scale_robot(robot, factor), scale_scene(scene, factor))
        state, walked = solver.rest(), []
        for k in range(1, 13):
            there = scale_scene(shifted(scene, (-k, 0.5 * k)), factor)
            state = solver.step(state, factor * 0.5 * k, scene=there)
            walked.append(state)
        states.append(walked)
    for here, there in zip(*states, strict=True):
        assert there.status is here.status
        assert np.array_equal(there.nodes[:, :2] / s, here.nodes[:, :2])
        assert np.array_equal(there.tensions, here.tensions)


def test_a_memo_tells_motions_apart():
    solver = Solver(robot_of("rod"), Scene([DISC]))
    memo, there = TransitionMemo(solver), shifted(Scene([DISC]), (-3.0, 0.0))
    state = pulled(solver, 6.5)
    steps = [memo.step(state, 6.5), memo.step(state, 6.5, scene=there), memo.step(state, 6.5, scene=there)]
    assert memo.statistics.hits == 1
    assert steps[1] is steps[2]
    assert steps[0].scene != steps[1].scene


@pytest.mark.parametrize(
    "other",
    [
        replace(SHAPES["ellipse"], axis=(1.0, 0.4)),
        DISC,
        replace(SHAPES["ellipse"], nodes=(3, 4)),
        replace(SHAPES["ellipse"], spring=0.2),
    ],
)
def test_obstacles_neither_turn_nor_become_others(other):
    solver = Solver(robot_of("rod"), Scene([SHAPES["ellipse"]]))
    with pytest.raises(ValueError, match="is no motion of"):
        solver.step(solver.rest(), 1.0, scene=Scene([other]))


def test_motions_are_checked_before_anything_moves():
    capsule = SHAPES["capsule"]
    solver = Solver(robot_of("rod"), Scene([capsule]))
    with pytest.raises(ValueError, match="is no motion of"):
        solver.step(solver.rest(), 1.0, scene=Scene([replace(capsule, end=(61.0, 120.0))]))
    with pytest.raises(ValueError, match="must keep its 1"):
        solver.step(solver.rest(), 1.0, scene=Scene())
    batch = BatchSolver(robot_of("rod"), 2, 1)
    for k in range(2):
        batch.assign(k, Scene([capsule]))
    batch.rest([0, 1])
    with pytest.raises(ValueError, match="one for each of 2 robots"):
        batch.step(np.ones(2), scenes=[Scene([capsule])])
    with pytest.raises(ValueError, match="is no motion of"):
        batch.step(np.ones(2), scenes=[Scene([capsule.shifted((1.0, 0.0))]), Scene([DISC])])
    assert not batch.commands[:, 0].any()


def test_a_reference_batch_does_not_move_scenes():
    batch = ReferenceBatch(robot_of("paper"), 1, 1)
    batch.assign(0, Scene([DISC]))
    batch.rest([0])
    with pytest.raises(ValueError, match="use a BatchSolver"):
        batch.step(np.ones(1), scenes=[shifted(Scene([DISC]), (1.0, 0.0))])
    assert batch.scene(0) == Scene([DISC])
