"""The goal-conditioned form: its reward can be computed anew for any goal."""

import gymnasium
import numpy as np
import pytest
from stable_baselines3.common.env_checker import check_env

import ccr_gym
from ccr_gym import FORCE_SPAN
from ccr_gym.goals import compute_reward

EVERY_ID = pytest.mark.parametrize("env_id", sorted(ccr_gym.ENV_IDS))


@EVERY_ID
def test_rewards_follow_from_the_goals(env_id):
    env = gymnasium.make(env_id, obs_mode="goal").unwrapped
    check_env(env)
    unit = FORCE_SPAN * env.settings.scales.force_n
    regulated = "force_est" if env.settings.regulate == "estimate" else "force_true"
    env.reset(seed=1)
    for _ in range(30):
        observation, reward, _, _, info = env.step(np.full(env.action_space.shape, 0.5, np.float32))
        achieved, desired = observation["achieved_goal"], observation["desired_goal"]
        assert reward == env.compute_reward(achieved, desired, info)
        force = np.linalg.norm(info[regulated])
        assert unit * achieved == pytest.approx(force, rel=1e-6, abs=1e-9)
        wanted = -min(abs(force - info["desired_force"]) / info["desired_force"], 1)
        assert reward == pytest.approx(wanted, abs=1e-5)
    assert env.compute_reward(np.array([[0.2], [0.3]]), np.array([[0.2], [0.2]])) == pytest.approx([0, -0.5])


def test_goals_may_be_zero():
    achieved, desired = np.array([[0.0], [0.1], [0.1]], np.float32), np.array([[0.0], [0.0], [0.2]], np.float32)
    assert compute_reward(achieved, desired).tolist() == [0, -1, -0.5]
    assert compute_reward(achieved[0], desired[0]).shape == ()


@pytest.mark.parametrize("obs_mode", ["flat", "dict"])
def test_other_forms_are_not_taken_for_goal_conditioned_ones(obs_mode):
    check_env(gymnasium.make("CCR/PushObstacle-v1", obs_mode=obs_mode).unwrapped)
    envs = gymnasium.make_vec("CCR/PushObstacle-v1", 2, vectorization_mode="vector_entry_point", obs_mode=obs_mode)
    assert not hasattr(envs, "compute_reward")


def test_vector_environments_agree_with_single_ones():
    modes = ("vector_entry_point", "sync")
    envs = [
        gymnasium.make_vec("CCR/PushObstacle-v1", 3, vectorization_mode=mode, obs_mode="goal", max_episode_steps=9)
        for mode in modes
    ]
    seen = [env.reset(seed=3)[0] for env in envs]
    for _ in range(25):
        assert all(np.array_equal(seen[0][key], seen[1][key]) for key in seen[1])
        steps = [env.step(np.full((3, 1), 0.7, np.float32)) for env in envs]
        seen = [step[0] for step in steps]
        assert np.array_equal(steps[0][1], steps[1][1])


def test_force_vectors_are_goals_of_as_many_numbers():
    env = gymnasium.make("CCR/SpatialPush-v1", obs_mode="goal", task={"force_vector": True}).unwrapped
    observation, info = env.reset(seed=0)
    assert observation["desired_goal"].shape == (3,)
    unit = FORCE_SPAN * env.settings.scales.force_n
    assert unit * observation["desired_goal"] == pytest.approx(info["desired_force"], abs=1e-6)


@pytest.mark.parametrize("sensing", ["realistic", "sensorless"])
def test_what_is_observed_beside_the_goals_is_what_sensors_tell(sensing):
    goal, flat = (
        gymnasium.make("CCR/PushObstacle-v1", obs_mode=mode, sensing=sensing).unwrapped for mode in ("goal", "flat")
    )
    seen, row, pressed = goal.reset(seed=1)[0], flat.reset(seed=1)[0], 0
    for _ in range(28):
        assert np.array_equal(seen["observation"], row)
        pressed += bool(seen["achieved_goal"] > 0)
        assert seen["achieved_goal"] in (0, 1) or seen["achieved_goal"] not in row  # what sensors tell is not exact
        seen, row = (env.step(np.array([0.8], np.float32))[0] for env in (goal, flat))
    assert pressed > 5
