"""The commands that a seen shape tells, against those of the robots that have it."""

import numpy as np
import pytest

from agents.environment import make_env
from agents.estimation.shape import observed_commands
from ccr_gym import ENV_IDS


@pytest.mark.parametrize("env_id", sorted(ENV_IDS))
@pytest.mark.parametrize("robot", ["prototype", "snake-arm"])
def test_a_shape_tells_the_commands_of_the_sections(env_id, robot):
    env = make_env(env_id, robot=robot)
    env.reset(seed=1)
    settings, generator = env.get_wrapper_attr("settings"), np.random.default_rng(0)
    direction = generator.uniform(0.3, 1, env.action_space.shape)  # of bending, which no cable is slack in
    for _ in range(20):
        observation, *_ = env.step(direction.astype(np.float32))
        reached = env.get_wrapper_attr("privileged_state").actuated_mm[: observation["cable"].size]
        found = observed_commands(observation, settings.robot)
        assert found == pytest.approx(reached / settings.scales.travel_mm, abs=2e-3)


def test_errors_of_places_take_themselves_out():
    env = make_env("CCR/PushObstacle-v1")
    env.reset(seed=1)
    robot = env.get_wrapper_attr("settings").robot
    for _ in range(12):
        observation, *_ = env.step(np.ones(1, np.float32))
    told = observed_commands(observation, robot)
    noise = np.random.default_rng(0).normal(0, 0.002, (200, 19, 3)) * [1, 1, 0]
    noisy = observed_commands({"nodes": observation["nodes"] + noise.reshape(200, -1)}, robot)
    assert np.abs(noisy - told).max() < 0.01  # that of a chord alone would be 0.045 a at two standard deviations
    assert np.std(noisy) < 0.003
