"""Controllers suit robots of any size: all of their settings are in the robot's natural units."""

from dataclasses import replace

import numpy as np
import pytest

from agents.benchmark.suite import CONTROLLERS
from agents.environment import make_env
from solver import Robot
from solver.spatial import SpatialRobot


def scaled(robot, s):
    """Return a robot s times as large, with s² times its rigidity: it moves alike under the same forces."""
    cables = tuple(replace(cable, offset_mm=cable.offset_mm and s * cable.offset_mm) for cable in robot.cables)
    sizes = {name: s * getattr(robot, name) for name in ("length_mm", "offset_mm")}
    return replace(robot, cables=cables, rigidity=s**2 * robot.rigidity, **sizes)


def played(name, env_id, robot, steps=40):
    """Return the actions of an episode."""
    env, policy = make_env(env_id, robot=robot, sensing="realistic"), CONTROLLERS[name](env_id, "realistic")
    observation, _ = env.reset(seed=3)
    policy.reset(env)
    actions = []
    for _ in range(steps):
        actions.append(policy.act(observation))
        observation, *_ = env.step(actions[-1])
    return np.array(actions)


@pytest.mark.parametrize("name", sorted(CONTROLLERS))
@pytest.mark.parametrize(
    ("env_id", "robot"),
    [
        ("CCR/PushObstacle-v1", Robot.preset("prototype")),
        ("CCR/PushObstacle-v1", Robot.preset("rao_2021")),
        ("CCR/SpatialPush-v1", SpatialRobot.preset("snake_arm")),
    ],
    ids=["prototype", "two sections", "in space"],
)
def test_a_robot_of_another_size_gets_the_same_actions(name, env_id, robot):
    expected = played(name, env_id, robot)
    assert np.abs(np.diff(expected, axis=0)).max() > 0.1  # it regulates, after the search
    for s in (0.1, 10.0):
        assert played(name, env_id, scaled(robot, s)) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("name", sorted(CONTROLLERS))
@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/SpatialPush-v1"])
@pytest.mark.parametrize("robot", ["snake-arm", "rao-2021", "neuroendoscope"])
def test_robots_of_several_sections_are_regulated(name, env_id, robot):
    env, policy = make_env(env_id, robot=robot), CONTROLLERS[name](env_id, None)
    errors = []
    for seed in range(3):
        observation, _ = env.reset(seed=seed)
        policy.reset(env)
        truncated = False
        while not truncated:
            observation, _, _, truncated, info = env.step(policy.act(observation))
        errors.append(abs(np.linalg.norm(info["force_true"]) / info["desired_force"] - 1))
    assert np.median(errors) < 0.05
