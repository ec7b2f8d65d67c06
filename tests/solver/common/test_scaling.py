"""The scaling law: a robot, its obstacles and commands s times as large do the same, with the same forces."""

import numpy as np
import pytest
from soak.scale import natural, scale_obstacle, scale_robot, scale_scene
from soak.scenes import MODELS, OVAL, make_solver, sample_setting
from soak.walks import replay, sample_increments, walk

from solver import Capsule, Circle, Custom, Ellipse, HalfPlane, Polygon, spatial

STEPS = 60
EPISODES = 10  # of each model, times --soak over its default
POWERS_OF_TWO = [2.0**k for k in (-10, -3, -1, 1, 3, 10)]
OTHERS = [0.01, 0.1, 10.0, 1000.0]
CLOSE = 1e-6  # of the robot's natural units


def episode(model, index):
    """A solver at s = 1 and a walk in it."""
    generator = np.random.default_rng([15, MODELS.index(model), index])
    solver = sample_setting(generator, model, scales=(1.0,)).solver
    return solver, walk(solver, sample_increments(generator, solver, 1.0, STEPS))


def scaled(solver, commands, s):
    """States of the same walk, s times as large."""
    robot = scale_robot(solver.robot, s)
    bounds = s * np.array([*(commands.shape[1] - 1) * [solver.robot.cable_limit_mm], np.inf])
    return replay(make_solver(robot, scale_scene(solver.scene, s)), np.minimum(s * commands, bounds)).states


@pytest.fixture(name="episodes")
def episodes_fixture(pytestconfig):
    return range(max(1, EPISODES * pytestconfig.getoption("soak") // 10_000))


@pytest.mark.parametrize("s", POWERS_OF_TWO)
@pytest.mark.parametrize("model", MODELS)
def test_powers_of_two_give_the_same_bits(model, s, episodes):
    for index in episodes:
        solver, taken = episode(model, index)
        for k, (state, large) in enumerate(zip(taken.states, scaled(solver, taken.commands, s), strict=True)):
            assert large.status.name == state.status.name, (index, k)
            expected = natural(state)
            for name, value in natural(large, s).items():
                np.testing.assert_array_equal(value, expected[name], f"{name}, episode {index}, step {k}")


@pytest.mark.parametrize("s", OTHERS)
@pytest.mark.parametrize("model", MODELS)
def test_other_scales_give_the_same_robot(model, s, episodes):
    for index in episodes:
        solver, taken = episode(model, index)
        length = solver.robot.length_mm
        for k, (state, large) in enumerate(zip(taken.states, scaled(solver, taken.commands, s), strict=True)):
            assert large.status.name == state.status.name, (index, k)
            expected, found = natural(state), natural(large, s)
            for name, unit in (("points", length), ("forces", 1.0), ("tension", 1.0), ("tensions", 1.0)):
                if name in found:
                    np.testing.assert_allclose(
                        found[name], expected[name], rtol=CLOSE, atol=CLOSE * unit, err_msg=f"{name} {index} {k}"
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
