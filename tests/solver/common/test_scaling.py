"""The scaling law: a robot, its obstacles and commands s times as large do the same, with the same forces."""

import math
from functools import lru_cache

import numpy as np
import pytest
from soak.scale import natural, scale_obstacle, scale_robot, scale_scene
from soak.scenes import MODELS, OVAL, PLANAR_KINDS, SPATIAL_KINDS, make_solver, sample_setting
from soak.walks import Walk, replay, sample_increments, walk

from solver import Cable, Capsule, Circle, Custom, Ellipse, HalfPlane, Load, Polygon, Robot, Scene, spatial
from solver.spatial import SpatialRobot

LOADED = ("loaded rod", "loaded space rod")
STEPS = 60
EPISODES = 10  # of each model, times --soak over its default
POWERS_OF_TWO = [2.0**k for k in (-10, -3, -1, 1, 3, 10)]
OTHERS = [0.01, 0.1, 10.0, 1000.0]
CLOSE = 1e-6  # of the robot's natural units


@lru_cache(maxsize=200)  # every scale is compared with it
def episode(model, index):
    """A solver at s = 1 and a walk in it."""
    if model in LOADED:
        return loaded_episode(model, index)
    generator = np.random.default_rng([15, MODELS.index(model), index])
    solver = sample_setting(generator, model, scales=(1.0,)).solver
    return solver, walk(solver, sample_increments(generator, solver, 1.0, STEPS))


def scaled(solver, commands, s):
    """States of the same walk, s times as large."""
    large = make_solver(scale_robot(solver.robot, s), scale_scene(solver.scene, s))
    bounds = s * np.array([*(commands.shape[1] - 1) * [solver.robot.cable_limit_mm], np.inf])
    commands = np.clip(s * commands, -bounds, bounds)
    return (follow if is_loaded(solver.robot) else lambda *walked: replay(*walked).states)(large, commands)


def is_loaded(robot):
    """Whether it is a rod of :func:`loaded_rod`, which has several cables."""
    return robot.model == "rod" and len(robot.cables) > 2


def loaded_rod(generator, model):
    """A rod with several cables, two sections, segments unlike each other, precurvature, gravity and loads."""
    space, n, ends = 3 if model == "loaded space rod" else 2, 18, (18, 9)
    turns = [2 * math.pi / 3 * k for k in range(3)] if space == 3 else [0.0, math.pi]
    cables = [
        Cable(angle=turn, end=end, offset_mm=offset)
        for end, offset in zip(ends, (None, 6.0), strict=True)
        for turn in turns
    ]
    force, weight = generator.normal(0, 0.02, space), generator.normal(0, 1e-4, space)
    common = {
        "model": "rod",
        "cables": tuple(cables),
        "segment_rigidity": tuple(generator.uniform(3000, 7000, n).tolist()),
        "weight_per_length": tuple(weight.tolist()),
        "disk_radius_mm": 9.0,
        "disk_thickness_mm": 1.0,
        "between": 1,
    }
    if space == 2:
        load = Load(node=n, force=tuple(force.tolist()), moment=float(generator.normal()), at=(8.0, math.pi))
        return Robot.prototype(precurvature=0.01, loads=(load,), length_range_mm=(120, 180), **common)
    load = Load(node=n, force=tuple(force.tolist()), at=(8.0, float(generator.uniform(0, 6))))
    return SpatialRobot.prototype(precurvature=(0.01, -0.005, 0.008), loads=(load,), **common)


def loaded_episode(model, index):
    """A solver of a loaded rod at s = 1 and a walk in it, which pulls one cable after the other."""
    generator = np.random.default_rng([16, LOADED.index(model), index])
    robot = loaded_rod(generator, model)
    kinds = SPATIAL_KINDS if isinstance(robot, SpatialRobot) else PLANAR_KINDS
    while True:
        try:
            solver = make_solver(robot, Scene(kinds[str(generator.choice(("shapes", "springs")))](generator, robot)))
            break
        except ValueError:  # an obstacle in the way
            continue
    count, goal, rest = len(robot.cables), np.zeros(len(robot.cables)), solver.rest().cables_mm
    present, commands = np.array([*rest, robot.length_mm]), []
    for k in range(STEPS):
        if k % 15 == 0:
            goal = np.where(np.arange(count) == generator.integers(count), generator.uniform(3, 10), -8.0)
        change = 0.1 * (goal - present[:-1]) + generator.normal(0, 0.1, count)
        inserted = generator.uniform(-2, 1) if isinstance(robot, Robot) else 0.0
        shortest = robot.shortest_mm
        present = np.array([*(present[:-1] + change), np.clip(present[-1] + inserted, shortest, robot.longest_mm)])
        commands.append(present)
    commands = np.array(commands)
    return solver, Walk(follow(solver, commands), commands)


def follow(solver, commands):
    """States of commands ``(T, cables + 1)`` from rest."""
    states = [solver.rest()]
    for command in commands:
        length = (command[-1],) if isinstance(solver.robot, Robot) else ()
        states.append(solver.step(states[-1], command[:-1], *length))
    return states


@pytest.fixture(name="episodes")
def episodes_fixture(pytestconfig):
    return range(max(1, EPISODES * pytestconfig.getoption("soak") // 10_000))


@pytest.mark.parametrize("s", POWERS_OF_TWO)
@pytest.mark.parametrize("model", [*MODELS, *LOADED])
def test_powers_of_two_give_the_same_bits(model, s, episodes):
    for index in episodes:
        _, expected, found = both(model, index, s)
        for name, value in found.items():
            np.testing.assert_array_equal(value, expected[name], f"{name}, episode {index}, by step")


def both(model, index, s):
    """A solver at s = 1, and the numbers of its walk there and s times as large, by name; their statuses are equal."""
    solver, taken = episode(model, index)
    large = scaled(solver, taken.commands, s)
    assert [state.status.name for state in large] == [state.status.name for state in taken.states], index
    return solver, unscaled(model, index), natural(large, s)


@lru_cache(maxsize=200)
def unscaled(model, index):
    return natural(episode(model, index)[1].states)


def share_holes(robot, numbers):
    """Return numbers with the tensions of cables through the same holes added up: only their sum is determinate."""
    if "tensions" not in numbers:
        return numbers
    holes = [(round(math.cos(c.angle), 9), round(math.sin(c.angle), 9), c.offset_mm, c.end) for c in robot.cables]
    alike = np.array([[hole == other for other in holes] for hole in holes], float)
    return numbers | {"tensions": numbers["tensions"] @ alike}


@pytest.mark.parametrize("s", OTHERS)
@pytest.mark.parametrize("model", [*MODELS, *LOADED])
def test_other_scales_give_the_same_robot(model, s, episodes):
    for index in episodes:
        solver, *walks = both(model, index, s)
        expected, found = (share_holes(solver.robot, walked) for walked in walks)
        for name, unit in (("points", solver.robot.length_mm), ("forces", 1.0), ("tension", 1.0), ("tensions", 1.0)):
            if name in found:
                np.testing.assert_allclose(
                    found[name],
                    expected[name],
                    rtol=CLOSE,
                    atol=CLOSE * unit,
                    err_msg=f"{name}, episode {index}, by step",
                )


@pytest.mark.parametrize(
    "obstacle",
    [
        Circle(center=(40, 90), radius=9, spring=2),
        HalfPlane(point=(40, 90), normal=(-1, 0.3)),
        Ellipse(center=(40, 90), radii=(12, 7), axis=(1, 2)),
        Capsule(start=(40, 90), end=(50, 80), radius=7),
        Polygon(corners=((30, 80), (50, 80), (40, 100)), radius=3),
        Custom(family=OVAL, sizes=(9, 7), center=(40, 90), reach=14, spring=((1, 0.2), (0.2, 3))),
        spatial.Sphere(center=(40, 0, 90), radius=9),
        spatial.HalfSpace(point=(40, 0, 90), normal=(-1, 0, 0.3)),
        spatial.Capsule(start=(40, 0, 90), end=(50, 3, 80), radius=7),
        spatial.Cylinder(start=(40, 0, 90), end=(50, 3, 80), radius=7, edge=2),
        spatial.Box(center=(40, 0, 90), sizes=(9, 12, 10), edge=1, axis=(1, 2, 0)),
    ],
)
@pytest.mark.parametrize("s", [2.0**-5, 8.0])
def test_gaps_scale_to_the_last_bit(obstacle, s):
    points = np.random.default_rng(0).uniform(0, 120, (200, obstacle.space))
    large = scale_obstacle(obstacle, s)
    np.testing.assert_array_equal(large.gap(s * points), s * obstacle.gap(points))
    np.testing.assert_array_equal(large.spring_matrix, obstacle.spring_matrix / s)
    assert large.extent.radius == s * obstacle.extent.radius
