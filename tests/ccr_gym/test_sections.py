"""The estimate of the contact force of robots of several sections."""

import gymnasium
import numpy as np
import pytest

from ccr_gym import EXACT
from solver.spatial import Sphere

ACTIONS = {"alike": (0.7, 0.7), "nearly alike": (0.7, 0.699), "most at the base": (0.7, 0.35)}


def quotients(env, action):
    """Estimated over true force [-] of a steady pull, where virtual work is near it: between 0.3 and 1.5 EI/L²."""
    scale, found = env.unwrapped.settings.scales.force_n, []
    for _ in range(60):
        *_, info = env.step(np.array(action, np.float32))
        if 0.3 < np.linalg.norm(info["force_true"]) / scale < 1.5:
            found.append(np.linalg.norm(info["force_est"]) / np.linalg.norm(info["force_true"]))
    return found


@pytest.mark.parametrize("action", ACTIONS.values(), ids=ACTIONS)
@pytest.mark.parametrize("robot", ["snake_arm", "neuroendoscope", "rao_2021"])
def test_in_the_plane(robot, action):
    """Bent alike, sections are where the cables of some just become slack, and slopes differ from side to side."""
    env, found = gymnasium.make("CCR/PushObstacle-v1", robot=robot, sensing=EXACT, force_sensor=False), []
    for seed in range(4):
        env.reset(seed=seed)
        found += quotients(env, action)
    assert len(found) > 4
    assert np.median(found) == pytest.approx(1, abs=0.05)


@pytest.mark.parametrize("robot", ["snake_arm", "neuroendoscope", "rao_2021"])
def test_in_space(robot):
    env = gymnasium.make("CCR/SpatialPush-v1", robot=robot, sensing=EXACT, force_sensor=False)
    length = env.unwrapped.settings.robot.length_mm
    ahead = Sphere(center=(0.25 * length, 0.08 * length, 0.6 * length), radius=0.1 * length)
    env.reset(seed=0, options={"scene": [ahead], "desired_force": env.unwrapped.settings.scales.force_n})
    found = quotients(env, (0.5, 0.16, 0.5, 0.16))
    assert len(found) > 1
    assert np.median(found) == pytest.approx(1, abs=0.05)
