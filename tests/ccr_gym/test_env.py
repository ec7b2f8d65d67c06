"""Invariants of every registered environment."""

import json

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as sb3_check_env

import ccr_gym
from agents.policy import search
from ccr_gym import FORCE_SPAN, PushObstacleEnv
from ccr_gym.reward import TERMS
from solver import Cable, Circle, Robot, Scene, Status

EVERY_ID = pytest.mark.parametrize("env_id", sorted(ccr_gym.ENV_IDS))
EVERY_MODE = pytest.mark.parametrize("obs_mode", ["dict", "flat"])


def make(env_id: str, **kwargs):
    return gymnasium.make(env_id, disable_env_checker=True, **kwargs)


def play(env, actions):
    """Return everything an episode returns, as a flat list of arrays."""
    observation, info = env.reset(seed=3)
    record = [observation, info["force_true"], info["force_est"]]
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        record += [observation, reward, info["force_true"], info["force_est"], info["solver_status"]]
        assert not terminated
        if truncated:
            break
    return record


@EVERY_ID
@EVERY_MODE
def test_environment_checkers_pass_without_warnings(env_id, obs_mode):
    env = gymnasium.make(env_id, obs_mode=obs_mode, render_mode="rgb_array")
    check_env(env.unwrapped)
    sb3_check_env(env)


@EVERY_ID
def test_renders_to_an_array_and_to_a_window(env_id, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = make(env_id, render_mode="rgb_array")
    env.reset(seed=0)
    picture = env.render()
    assert picture.shape == (640, 640, 3)
    assert picture.dtype == np.uint8
    window = make(env_id, render_mode="human")
    window.reset(seed=0)
    window.step(np.ones(window.action_space.shape, np.float32))
    window.close()


@EVERY_ID
def test_equal_seeds_give_identical_bits(env_id):
    actions = np.random.default_rng(0).uniform(-0.5, 1, (64, *make(env_id).action_space.shape)).astype(np.float32)
    first, second = (play(make(env_id, obs_mode="flat"), actions) for _ in range(2))
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


@EVERY_ID
def test_flat_observation_concatenates_the_dict(env_id):
    flat, _ = make(env_id, obs_mode="flat").reset(seed=5)
    entries, _ = make(env_id, obs_mode="dict").reset(seed=5)
    assert np.array_equal(flat, np.concatenate(list(entries.values())))
    assert list(entries) == list(make(env_id, obs_mode="dict").observation_space)
    slices = make(env_id).unwrapped.observation_slices
    assert all(np.array_equal(flat[columns], entries[key]) for key, columns in slices.items())


@EVERY_ID
@EVERY_MODE
def test_observations_stay_in_bounds_and_rewards_add_up(env_id, obs_mode):
    env = make(env_id, obs_mode=obs_mode)
    generator = np.random.default_rng(1)
    for seed in range(5):
        env.reset(seed=seed)
        truncated, steps = False, 0
        while not truncated:
            observation, reward, _, truncated, info = env.step(
                generator.uniform(-0.3, 1, env.action_space.shape).astype(np.float32)
            )
            steps += 1
            assert env.observation_space.contains(observation)
            assert reward == pytest.approx(sum(info[f"reward_{term}"] for term in TERMS), abs=1e-12)
            assert info["solver_status"] != Status.GAVE_UP
            assert info["cost"] >= 0
        assert steps == env.unwrapped.task.steps == gymnasium.spec(env_id).max_episode_steps


@EVERY_ID
def test_forces_vanish_without_contact_and_are_copies(env_id):
    env = make(env_id)
    _, info = env.reset(seed=0)
    assert not info["force_true"].any()
    assert not info["force_est"].any()
    info["force_true"][:] = 7.0
    *_, info = env.step(np.zeros(env.action_space.shape, np.float32))
    assert not info["force_true"].any()


@EVERY_ID
def test_a_steady_pull_reaches_every_set_point(env_id):
    env = make(env_id, obs_mode="dict")
    regulated = "force_est" if env.unwrapped.settings.regulate == "estimate" else "force_true"
    for seed in range(20):
        observation, info = env.reset(seed=seed)
        pull = search(observation)
        reached, truncated = 0.0, False
        while reached < info["desired_force"] and not truncated:
            *_, truncated, info = env.step(pull)
            reached = np.linalg.norm(info[regulated])
        assert reached >= info["desired_force"]


@EVERY_ID
def test_bad_actions_are_refused_and_change_nothing(env_id):
    env = make(env_id).unwrapped
    shape = env.action_space.shape
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        env.step(np.zeros(shape))
    env.reset(seed=0)
    env.step(np.ones(shape, np.float32))
    before = env.equilibrium
    for action in (np.full(shape, np.nan), np.zeros(3), np.zeros((1, *shape)), np.float32(0.5)):
        with pytest.raises(ValueError, match="finite numbers of shape"):
            env.step(action)
    assert np.array_equal(env.equilibrium.block, before.block)


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"obs_mode": "pixels"}, "obs_mode"),
        ({"backend": "cuda"}, "backend"),
        ({"cable_limit_mm": 1e3}, "at most 25"),
        ({"max_increment_mm": -1.0}, "max_increment_mm"),
        ({"force_limit": 0.0}, "force_limit"),
        ({"render_mode": "ascii"}, "render_mode"),
    ],
)
def test_bad_arguments_are_refused(kwargs, message):
    with pytest.raises(ValueError, match=message):
        PushObstacleEnv(**kwargs)


def test_given_scene_and_set_point_are_used():
    env = make("CCR/PushObstacle-v1", obs_mode="dict")
    scene = Scene([Circle(center=(44, 104), radius=15)])
    observation, info = env.reset(options={"scene": scene, "desired_force": 0.05})
    assert env.unwrapped.equilibrium.scene == scene
    assert info["desired_force"] == 0.05
    assert observation["desired_force"] == pytest.approx(0.05 / (FORCE_SPAN * 5000 / 180**2))
    listed, _ = env.reset(options={"scene": list(scene), "desired_force": 0.05})
    assert all(np.array_equal(listed[key], entry) for key, entry in observation.items())
    with pytest.raises(ValueError, match="both"):
        env.reset(options={"scene": scene})
    with pytest.raises(ValueError, match="desired_force"):
        env.reset(options={"scene": scene, "desired_force": -1.0})


def test_arguments_are_json_able():
    kwargs = json.loads(
        json.dumps(
            {
                "task": {"radius": [0.07, 0.08]},
                "robot": {"length_mm": 180.0, "segments": 24, "offset_mm": 8.0},
                "weights": {"effort": 0.0},
            }
        )
    )
    env = make("CCR/PushObstacle-v1", obs_mode="dict", **kwargs)
    observation, _ = env.reset(seed=0)
    assert observation["nodes"].shape == (75,)
    assert 12.6 <= env.unwrapped.equilibrium.scene.obstacles[0].radius <= 14.4


def test_an_infeasible_task_names_the_remedy():
    env = make("CCR/LoadCell-v1", task={"force": [1.0, 1.5], "distance": [0.95, 0.99]})
    with pytest.raises(RuntimeError, match="widen"):
        env.reset(seed=0)


def test_without_force_sensor_only_the_estimate_is_observed():
    env = make("CCR/PushObstacle-v1", force_sensor=False, obs_mode="dict")
    observation, _ = env.reset(seed=0)
    assert "force_est" in observation
    assert not {"force_measured", "force_error"} & observation.keys()


def test_the_reference_backend_agrees():
    native, reference = (make("CCR/PushObstacle-v1", backend=backend) for backend in ("native", "casadi"))
    scene = Scene([Circle(center=(44, 104), radius=15)])
    for env in (native, reference):
        env.reset(options={"scene": scene, "desired_force": 0.05})
    for _ in range(14):
        *_, native_info = native.step(np.ones(1, np.float32))
        *_, reference_info = reference.step(np.ones(1, np.float32))
    assert native_info["force_true"].any()
    assert reference_info["force_true"] == pytest.approx(native_info["force_true"], rel=1e-4)
    assert reference_info["force_est"] == pytest.approx(native_info["force_est"], rel=1e-3)


@pytest.mark.parametrize(
    "changes",
    [
        {"weight_per_length": (4e-4, 0.0)},
        {"segment_rigidity": (6000.0,) * 9 + (4000.0,) * 9},
        {"cables": (Cable(offset_mm=6.0),)},
    ],
    ids=["weight", "unlike segments", "nearer cable"],
)
def test_robots_that_do_not_bend_evenly_are_pulled_to_contact_and_estimated(changes):
    """Like the prototype: a full pull brings them to the obstacle, and eq. 11 is off by no more than with it."""
    env = make("CCR/PushObstacle-v1", robot=Robot.prototype(**changes), estimator="paper")
    env.reset(seed=0)
    ratios = []
    for _ in range(30):
        *_, info = env.step(env.action_space.high)
        force = np.linalg.norm(info["force_true"])
        if force > 0.1:
            ratios.append(np.linalg.norm(info["force_est"]) / force)
    assert len(ratios) >= 3
    assert 0.5 < np.median(ratios) < 1.5
