import gymnasium
import numpy as np
import pytest

from agents.controllers.lag import LagEstimator, observed_commands
from agents.environment import make_env
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
        assert found == pytest.approx(reached / settings.scales.travel_mm, abs=5e-6)  # single precision


@pytest.mark.parametrize("env_id", sorted(ENV_IDS))
def test_it_finds_latency_and_play_and_where_the_cables_are(env_id):
    kwargs = {"sensing": "realistic", "obs_mode": "dict"}
    envs = gymnasium.make_vec(env_id, 12, vectorization_mode="vector_entry_point", **kwargs)
    sensors, settings = envs._episodes._sensors, envs.settings
    travel = settings.scales.travel_mm
    observation, _ = envs.reset(seed=3)
    lag, generator = LagEstimator(12, observation["cable"].shape[1]), np.random.default_rng(1)
    for step in range(40):
        motors = settings.cable_limit_mm / travel * observation["cable"].astype(float)
        lag.update(motors, observed_commands(observation, settings.robot))
        cables = envs.privileged_state.actuated_mm[:, : lag.cables.shape[1]] / travel
        if step > 20:
            assert lag.cables == pytest.approx(cables, abs=0.0025)
        pull = generator.uniform(-0.6, 1, envs.action_space.shape) if step > 10 else np.ones(envs.action_space.shape)
        observation, *_ = envs.step(pull.astype(np.float32))
    assert np.array_equal(lag.latency, sensors._latency)
    assert lag.half_backlash == pytest.approx(sensors._backlash_mm / 2 / travel, abs=0.00075)  # the step of the grid
    lag.reset([3])
    assert lag._errors[3].max() < 1e-9 < lag._errors[4].max()
