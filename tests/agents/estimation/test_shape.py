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
        found = observed_commands(observation, settings)
        assert found == pytest.approx(reached / settings.scales.travel_mm, abs=2e-3)


def test_errors_of_places_take_themselves_out():
    env = make_env("CCR/PushObstacle-v1")
    env.reset(seed=1)
    settings = env.get_wrapper_attr("settings")
    for _ in range(12):
        observation, *_ = env.step(np.ones(1, np.float32))
    told = observed_commands(observation, settings)
    noise = np.random.default_rng(0).normal(0, 0.002, (200, 19, 3)) * [1, 1, 0]
    noisy = observed_commands({"nodes": observation["nodes"] + noise.reshape(200, -1)}, settings)
    assert np.abs(noisy - told).max() < 0.01  # that of a chord alone would be 0.045 a at two standard deviations
    assert np.std(noisy) < 0.003


@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/SpatialPush-v1", "CCR/SpatialPush-Paper-v1"])
def test_shapes_of_random_robots_tell_their_commands(env_id):
    env = make_env(env_id, randomize={"offset": (0.8, 1.25), "length": (0.9, 1.1)})
    settings = env.get_wrapper_attr("settings")
    for seed in range(4):
        env.reset(seed=seed)
        for _ in range(14):
            observation, *_ = env.step(np.full(env.action_space.shape, 0.6, np.float32))
        reached = env.get_wrapper_attr("privileged_state").actuated_mm[: observation["cable"].size]
        offset_mm = env.get_wrapper_attr("equilibrium").robot.offset_mm
        assert observed_commands(observation, settings) == pytest.approx(reached / offset_mm, abs=2e-3)
