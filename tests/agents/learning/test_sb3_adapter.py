"""The adapter keeps Stable-Baselines3's contract, which is not Gymnasium's."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

import ccr_gym  # noqa: F401 - registers the ids
from agents.learning.sb3_adapter import SB3VecEnv

ENV_ID, COUNT = "CCR/PushObstacle-v1", 4


def test_equals_the_environments_that_sb3_makes():
    ours = SB3VecEnv(ENV_ID, COUNT, seed=5)
    theirs = DummyVecEnv([lambda: gymnasium.make(ENV_ID, obs_mode="flat", disable_env_checker=True)] * COUNT)
    theirs.seed(5)
    assert ours.observation_space == theirs.observation_space
    assert np.array_equal(ours.reset(), theirs.reset())
    generator = np.random.default_rng(0)
    for step in range(1, 131):
        actions = generator.uniform(-0.4, 1, (COUNT, 1)).astype(np.float32)
        (our, our_rewards, our_dones, our_infos) = ours.step(actions)
        (their, their_rewards, their_dones, their_infos) = theirs.step(actions)
        assert np.array_equal(our, their)
        assert np.array_equal(our_rewards, their_rewards)
        assert np.array_equal(our_dones, their_dones)
        assert our_dones.any() == (step % 64 == 0)
        for done, info, other in zip(our_dones, our_infos, their_infos, strict=True):
            if not done:
                assert info == {}
                continue
            assert info["TimeLimit.truncated"] is other["TimeLimit.truncated"] is True
            assert np.array_equal(info["terminal_observation"], other["terminal_observation"])
            assert info["is_success"] == other["is_success"]
            assert np.array_equal(info["force_true"], other["force_true"])


def test_monitor_and_learner_take_it():
    environments = VecMonitor(SB3VecEnv(ENV_ID, COUNT, seed=0))
    PPO("MlpPolicy", environments, n_steps=64, batch_size=64, n_epochs=1, device="cpu").learn(256)
    environments.reset()
    for _ in range(64):
        *_, infos = environments.step(np.ones((COUNT, 1), np.float32))
    assert [info["episode"]["l"] for info in infos] == [64] * COUNT


def test_attributes_are_those_of_all():
    environments = SB3VecEnv(ENV_ID, COUNT)
    assert environments.get_attr("autoreset_mode") == [AutoresetMode.SAME_STEP] * COUNT
    assert environments.get_attr("max_episode_steps", [1, 2]) == [64, 64]
    assert environments.env_is_wrapped(gymnasium.Wrapper) == [False] * COUNT
    with pytest.raises(AttributeError, match="force_limit cannot be set"):
        environments.set_attr("force_limit", 1.0)
    environments.close()


@pytest.mark.parametrize("seed", [1.5, -1, True, "7", 2**63])
def test_a_seed_that_is_none_is_refused_at_once(seed):
    environments = SB3VecEnv(ENV_ID, COUNT, seed=3)
    with pytest.raises(ValueError, match=r"seed is .*; it must be a whole number from 0"):
        environments.seed(seed)
    with pytest.raises(ValueError, match="seed is"):
        SB3VecEnv(ENV_ID, COUNT, seed=seed)
    assert np.array_equal(environments.reset(), SB3VecEnv(ENV_ID, COUNT, seed=3).reset())
