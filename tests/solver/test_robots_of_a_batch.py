"""Rows of a batch with robots of their own: each moves as that robot alone, bit for bit."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from solver import BatchSolver, Cable, Circle, Load, Robot, Scene, Solver
from solver.spatial import SpatialBatchSolver, SpatialRobot, SpatialSolver, Sphere

STEPS, ROBOTS = 8, 24
LENGTHS, OFFSETS, RIGIDITIES = (0.85, 1.1), (0.8, 1.2), (0.5, 2.0)
ARMED = {
    "cables": (Cable(), Cable(angle=np.pi, offset_mm=7.0)),
    "loads": (Load(node=12, force=(0.02, 0.0)),),
    "precurvature": 0.01,
}
KINDS = {
    "rod": Robot.prototype(),
    "paper": Robot.prototype(model="paper"),
    "loaded": Robot.prototype(**ARMED),
    "opposed": Robot.prototype(cables=(Cable(), Cable(angle=np.pi))),
    "sections": Robot.prototype(cables=(Cable(end=9), Cable(angle=np.pi))),
    "rod in space": SpatialRobot.prototype(),
    "paper in space": SpatialRobot.prototype(model="paper"),
}


def drawn(robot, generator):
    """A robot like another, of another size, rigidity and cable limit; now and then the same."""
    if generator.random() < 0.25:
        return robot
    length, offset, rigidity = (generator.uniform(*ends) for ends in (LENGTHS, OFFSETS, RIGIDITIES))
    changes = {
        "length_mm": robot.length_mm * length,
        "offset_mm": robot.offset_mm * offset,
        "rigidity": robot.rigidity * rigidity,
        "max_cable_mm": 12.0 + generator.random(),
        "max_tension": generator.choice([4.0, 15.0]),
    }
    if robot.model == "rod":
        thinner, ends = {"disk_radius_mm": robot.edge_mm * offset}, generator.integers(6, robot.segments + 1)
        cables = [replace(c, offset_mm=None, end=None if c.end is None else int(ends)) for c in robot.cables]
        changes |= thinner | {"cables": tuple(cables)}
    return replace(robot, **changes)


def scene_for(robot, generator):
    spring = 0.01 if generator.random() < 0.3 else None
    if isinstance(robot, Robot):
        center = generator.uniform((38.0, 85.0), (55.0, 125.0))
        return Scene([Circle(center=center, radius=12.0, spring=spring)])
    angle = generator.uniform(0, np.pi / 2)
    center = (45 * np.cos(angle), 45 * np.sin(angle), generator.uniform(90.0, 120.0))
    return Scene([Sphere(center=center, radius=12.0, spring=spring)])


def bending(scene, cables):
    """Displacements of the cables of a unit of pull towards the obstacle; opposite ones are paid out."""
    (obstacle,) = scene
    if obstacle.space == 2:
        return np.array([1.0, -1.0])[:cables]
    towards = np.array(obstacle.center[:2]) / np.linalg.norm(obstacle.center[:2])
    return np.concatenate([towards, -towards])[:cables]


def family(kind, count=ROBOTS):
    generator, nominal = np.random.default_rng(3), KINDS[kind]
    robots = [drawn(nominal, generator) for _ in range(count)]
    scenes = [scene_for(nominal, generator) for _ in range(count)]
    sizes = 1.2 * nominal.offset_mm * np.cumsum(generator.uniform(-0.02, 0.25, (STEPS, count, 1)), axis=0)
    low = max(robot.least_cable_mm for robot in robots)
    return robots, scenes, np.clip(sizes * [bending(scene, len(nominal.cables)) for scene in scenes], low, 11.0)


def batch_of(kind, robots, scenes, threads):
    planar = isinstance(KINDS[kind], Robot)
    batch = (BatchSolver if planar else SpatialBatchSolver)(KINDS[kind], len(robots), 1, threads)
    for k, (robot, scene) in enumerate(zip(robots, scenes, strict=True)):
        batch.assign(k, scene, robot)
    batch.rest(range(len(robots)))
    return batch


def alone(kind, robots, scenes, pulls):
    """Final blocks, statuses and residuals of each robot by its own solver."""
    solver_class = Solver if isinstance(KINDS[kind], Robot) else SpatialSolver
    for k, (robot, scene) in enumerate(zip(robots, scenes, strict=True)):
        solver = solver_class(robot, scene)
        state = solver.rest()
        for step in pulls:
            state = solver.step(state, step[k].tolist())
        yield state, solver.optimality(state)


@pytest.mark.parametrize("kind", KINDS)
def test_rows_move_as_their_robots_alone(kind):
    robots, scenes, pulls = family(kind)
    states, residuals = zip(*alone(kind, robots, scenes, pulls), strict=True)
    expected, generator = np.array([state.block for state in states]), np.random.default_rng(0)
    assert sum(bool(state.contact.any()) for state in states) > ROBOTS // 4
    for threads in (1, 3):
        batch = batch_of(kind, robots, scenes, threads)
        for step in pulls:
            order = generator.permutation(ROBOTS).tolist()
            batch.step(step[order] if batch.cables > 1 else step[order, 0], order)
        assert np.array_equal(batch.blocks, expected)
        assert batch.statuses.tolist() == [state.status for state in states]
        assert np.array_equal(batch.optimality(), np.array(residuals))
        assert [batch.equilibrium(k).robot for k in range(ROBOTS)] == robots


@pytest.mark.parametrize("kind", ["rod", "loaded", "rod in space"])
def test_trial_pulls_and_probes_are_those_of_the_robots(kind):
    robots, scenes, pulls = family(kind, 8)
    batch = batch_of(kind, robots, scenes, 1)
    wanted, ones = np.full(8, 0.05), np.full((8, batch.cables), 1.0)
    found, reached = batch.ramp_reaches_force(range(8), wanted, 0.5, 10.0, ones)
    commands = np.column_stack([pulls[-1], [robot.length_mm for robot in robots]])
    probed = batch.probe(commands)
    for k in range(8):
        own = batch_of(kind, [robots[k]], [scenes[k]], 1)
        single = type(batch)(robots[k], 1, 1)
        single.assign(0, scenes[k])
        single.rest([0])
        for other in (own, single):
            one, force = other.ramp_reaches_force([0], wanted[:1], 0.5, 10.0, ones[:1])
            assert one[0] == found[k]
            assert np.array_equal(force[0], reached[k])
            assert np.array_equal(other.probe(commands[k : k + 1])[0], probed[k])


def test_rows_and_pickles_carry_the_robots():
    robots, scenes, pulls = family("rod", 8)
    batch = batch_of("rod", robots, scenes, 1)
    batch.step(pulls[3][:, 0])
    copied, forks = pickle.loads(pickle.dumps(batch)), BatchSolver(KINDS["rod"], 2, 1)
    forks.set_rows([0, 1], batch.get_rows([5, 2]))
    batch.step(pulls[4][:, 0])
    copied.step(pulls[4][:, 0])
    forks.step(pulls[4][[5, 2], 0])
    assert np.array_equal(copied.blocks, batch.blocks)
    assert np.array_equal(forks.blocks, batch.blocks[[5, 2]])
    assert [copied.robot_of(k) for k in range(8)] == robots
    batch.set_rows([5], forks.get_rows([1]))
    assert batch.robot_of(5) == robots[2]


def test_a_robot_is_given_back():
    nominal, scene = KINDS["rod"], Scene([Circle(center=(45.0, 100.0), radius=12.0)])
    batch = batch_of("rod", [replace(nominal, rigidity=1e4, length_mm=170.0)], [scene], 1)
    batch.assign(0, scene)
    assert batch.robot_of(0) == nominal
    batch.rest([0])
    batch.step(np.array([8.0]))
    solver = Solver(nominal, scene)
    assert np.array_equal(batch.equilibrium(0).block, solver.step(solver.rest(), 8.0).block)


def test_a_robot_that_moves_its_obstacles_keeps_its_own():
    robot, scene = replace(KINDS["rod"], length_mm=170.0), Scene([Circle(center=(45.0, 100.0), radius=12.0)])
    there = Scene([Circle(center=(43.0, 100.0), radius=12.0)])
    batch, solver = batch_of("rod", [robot], [scene], 1), Solver(robot, scene)
    batch.step(np.array([8.0]), scenes=[there])
    assert np.array_equal(batch.equilibrium(0).block, solver.step(solver.rest(), 8.0, scene=there).block)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"segments": 20}, "segments of the robot is 20; robots of this batch must have 18"),
        ({"model": "paper"}, "model of the robot is paper"),
        ({"between": 1}, "positions of the robot is 37"),
        ({"touch": ("backbone",)}, "number of lines that can touch of the robot is 1"),
        ({"cables": (Cable(), Cable(angle=np.pi))}, "number of cables of the robot is 2"),
    ],
)
def test_robots_of_another_layout_are_refused(changes, message):
    scene = Scene([Circle(center=(45.0, 100.0), radius=12.0)])
    batch = BatchSolver(KINDS["rod"], 2, 1)
    with pytest.raises(ValueError, match=message):
        batch.assign(0, scene, replace(KINDS["rod"], **changes))
    with pytest.raises(ValueError, match="has no scene"):
        batch.rest([0])


def test_limits_are_those_of_each_robot():
    scene = Scene([Circle(center=(60.0, 100.0), radius=12.0)])
    batch = batch_of("rod", [KINDS["rod"], replace(KINDS["rod"], max_cable_mm=5.0)], [scene, scene], 1)
    batch.step(np.array([8.0, 5.0]))
    with pytest.raises(ValueError, match="max_cable_mm of each robot"):
        batch.step(np.array([5.0, 8.0]))
    with pytest.raises(ValueError, match="limit_mm is 8"):
        batch.ramp_reaches_force([0, 1], np.ones(2), 0.5, 8.0)


def test_scenes_are_assigned_where_they_leave_the_robot_clear():
    scene, ahead = (Scene([Circle(center=center, radius=9.8)]) for center in ((60.0, 100.0), (0.0, 191.0)))
    batch, longer = batch_of("rod", [KINDS["rod"]], [scene], 1), replace(KINDS["rod"], length_mm=185.0)
    assert not batch.assign_if_clear(0, ahead, longer)
    assert batch.scene(0) is scene
    assert batch.robot_of(0) == KINDS["rod"]
    assert batch.assign_if_clear(0, ahead)
    assert batch.scene(0) is ahead
    batch.rest([0])


@pytest.mark.parametrize("kind", ["rod", "rod in space"])
def test_robots_that_are_copied_move_alike(kind):
    robots, scenes, pulls = family(kind, 8)
    first = batch_of(kind, robots, scenes, 1)
    second = type(first)(KINDS[kind], 8, 1)
    for _ in range(2):  # the second time only scenes change
        second.copy_rows(range(8), first)
        for row in pulls:
            commands = row[:, 0] if first.cables == 1 else row
            first.step(commands)
            second.step(commands)
        assert np.array_equal(first.blocks, second.blocks)
        assert [second.robot_of(k) for k in range(8)] == [first.robot_of(k) for k in range(8)]
        assert [second.scene(k) for k in range(8)] == scenes
        scenes = [scene_for(KINDS[kind], np.random.default_rng(k)) for k in range(8)]
        for index, (robot, scene) in enumerate(zip(robots, scenes, strict=True)):
            first.assign(index, scene, robot)
        first.rest(range(8))


@pytest.mark.parametrize("kind", ["rod", "rod in space"])
def test_rows_are_copied_from_another_batch(kind):
    robots, scenes, pulls = family(kind, 8)
    first = batch_of(kind, robots, scenes, 1)
    second, expected = (batch_of(kind, robots[::-1], scenes[::-1], 1) for _ in range(2))
    first.step(pulls[0][:, 0] if first.cables == 1 else pulls[0])
    some = [6, 1, 3]
    second.copy_rows(some, first)
    expected.set_rows(some, first.get_rows(some))
    for row in pulls[1:]:
        commands = row[:, 0] if first.cables == 1 else row
        for batch in (second, expected):
            batch.step(commands)
        for own, wanted in zip(second.get_rows(range(8)), expected.get_rows(range(8)), strict=True):
            assert np.array_equal(own, wanted) if isinstance(own, np.ndarray) else own == wanted


def test_rows_are_copied_from_batches_of_equal_robots_only():
    robots, scenes, _ = family("rod", 8)
    first, unrested = batch_of("rod", robots, scenes, 1), BatchSolver(KINDS["rod"], 8, 1)
    unrested.assign(2, scenes[2])
    for other, message in (
        (BatchSolver(KINDS["rod"], 8, 2), "other is of another robot or number of obstacles"),
        (BatchSolver(KINDS["paper"], 8, 1), "other is of another robot or number of obstacles"),
        (BatchSolver(KINDS["rod"], 2, 1), "robot index is 2; it must be a whole number from 0 to 1"),
    ):
        before = first.get_rows(range(8))
        with pytest.raises(ValueError, match=message):
            first.copy_rows([2], other)
        assert first.get_rows(range(8)).scenes == before.scenes
    first.copy_rows([2, 5], unrested)
    with pytest.raises(ValueError, match="robot 2 has a new scene"):
        first.move([2])
    with pytest.raises(ValueError, match="robot 5 has no scene"):
        first.move([5])
    first.move([0, 1, 3])
