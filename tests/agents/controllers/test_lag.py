import gymnasium
import numpy as np
import pytest

from agents.controllers.lag import LagEstimator, observed_cables
from ccr_gym import ENV_IDS


@pytest.mark.parametrize("env_id", sorted(ENV_IDS))
def test_a_shape_tells_the_displacement_of_the_cables(env_id):
    env = gymnasium.make(env_id, disable_env_checker=True)
    env.reset(seed=1)
    generator = np.random.default_rng(0)
    for _ in range(40):
        observation, _, _, _, info = env.step(generator.uniform(-0.3, 1, env.action_space.shape).astype(np.float32))
        found = observed_cables(observation, env.get_wrapper_attr("settings").robot)
        assert found == pytest.approx(np.atleast_1d(info["cable_mm"]), abs=2e-5)  # single precision


@pytest.mark.parametrize("env_id", sorted(ENV_IDS))
def test_it_finds_latency_and_play_and_where_the_cables_are(env_id):
    envs = gymnasium.make_vec(env_id, 12, vectorization_mode="vector_entry_point", sensing="realistic")
    sensors, settings = envs._episodes._sensors, envs.settings
    observation, _ = envs.reset(seed=3)
    lag, generator = LagEstimator(12, observation["cable"].shape[1]), np.random.default_rng(1)
    for step in range(40):
        lag.update(
            settings.cable_limit_mm * observation["cable"].astype(float), observed_cables(observation, settings.robot)
        )
        cables = envs.privileged_state.actuated_mm[:, : lag.cables.shape[1]]
        if step > 20:
            assert lag.cables == pytest.approx(cables, abs=0.02)
        pull = generator.uniform(-0.6, 1, envs.action_space.shape) if step > 10 else np.ones(envs.action_space.shape)
        observation, *_ = envs.step(pull.astype(np.float32))
    assert np.array_equal(lag.latency, sensors._latency)
    assert lag.half_backlash == pytest.approx(sensors._backlash_mm / 2, abs=0.006)  # the step of the grid
    lag.reset([3])
    assert lag._errors[3].max() == 0 < lag._errors[4].max()
