"""Validation of the arguments of environments: messages name argument, value and bound."""

import math
import os
from dataclasses import fields

import gymnasium
import numpy as np
import pytest

import ccr_gym
from ccr_gym import RewardWeights, Sensing
from solver import Cable

PUSH = "CCR/PushObstacle-v1"
EVERY_ID = pytest.mark.parametrize("env_id", sorted(ccr_gym.ENV_IDS))
NAN, INF = float("nan"), float("inf")


def make(env_id=PUSH, **kwargs):
    return gymnasium.make(env_id, disable_env_checker=True, **kwargs)


def make_vec(env_id=PUSH, count=3, **kwargs):
    return gymnasium.make_vec(env_id, count, vectorization_mode="vector_entry_point", **kwargs)


@pytest.mark.parametrize(
    ("env_id", "task", "message"),
    [
        (PUSH, {"force": (0.0, -0.1)}, r"force is \(0.0, -0.1\); it must be two numbers from 1e-05 to 10"),
        (PUSH, {"force": (0.0, 0.0)}, "force is"),
        (PUSH, {"force": (0.1, 11)}, "to 10"),
        (PUSH, {"force": (-0.1, 0.1)}, "force is"),
        (PUSH, {"force": 0.1}, "two numbers"),
        (PUSH, {"force": (0.1, True)}, "two numbers"),
        (PUSH, {"force": (0.1, 0.2, 0.3)}, "two numbers"),
        (PUSH, {"force": "ab"}, "two numbers"),
        (PUSH, {"force": (0.1, 0.1 + 0j)}, "two numbers"),
        (PUSH, {"x": (75, 35)}, r"x is \(75, 35\).*the smaller one first"),
        (PUSH, {"y": (75, INF)}, "y is"),
        (PUSH, {"y": (75, 10**400)}, "y is"),
        (PUSH, {"radius": (-1, 12)}, "radius is"),
        (PUSH, {"radius": (0.03, 0.07)}, "Circle.*could slip between points.*between=1"),
        ("CCR/LoadCell-v1", {"distance": (-51, -24)}, "distance is"),
        ("CCR/LoadCell-v1", {"distance": (1e9, 1e10)}, r"distance is \(.*\); it must be two numbers from .* to 10"),
        ("CCR/LoadCell-v1", {"height": 11.0}, "height is 11.0; it must be a number from -10 to 10"),
        (PUSH, {"x": (0.2, 1e3)}, "x is"),
        ("CCR/BracedPush-v1", {"goal": ((0.3, 52), (0.7, 0.8), (0.06, 0.09))}, r"goal\[0\] is"),
        ("CCR/SpatialPush-v1", {"distance": (0.2, 1e9)}, "distance is"),
        ("CCR/SpatialPush-v1", {"height": (-1e9, 0.5)}, "height is"),
        ("CCR/LoadCell-v1", {"height": NAN}, "height is nan"),
        ("CCR/LoadCell-v1", {"height": (1, 2)}, "height is"),
        ("CCR/TrackForce-v1", {"swing": (5, 5)}, r"swing is \(5, 5\).*from 0 to below 1"),
        ("CCR/TrackForce-v1", {"swing": (0.5, 1)}, "swing is"),
        ("CCR/TrackForce-v1", {"period": (0, 64)}, "period is.*from 1"),
        ("CCR/TrackForce-v1", {"changes": 2.5}, "changes is 2.5; it must be a whole number from 0 to 128"),
        ("CCR/TrackForce-v1", {"changes": -1}, "changes is -1"),
        ("CCR/TrackForce-v1", {"changes": True}, "changes is True"),
        ("CCR/TrackForce-v1", {"ramp": 0}, "ramp is 0; it must be a whole number from 1 to 128"),
        ("CCR/TrackForce-v1", {"force": (0, 1)}, "force is"),
        ("CCR/BracedPush-v1", {"brace": ((38, 27), (75, 95), (10, 14))}, r"brace\[0\] is"),
        ("CCR/BracedPush-v1", {"goal": ((0.3, 0.4), (0.7, 0.8), (0, 16))}, r"goal\[2\] is"),
        ("CCR/BracedPush-v1", {"goal": ((52, 72), (125, 150))}, "3 ranges of two numbers"),
        ("CCR/BracedPush-v1", {"brace": ((0.15, 0.21), (0.4, 0.5), (0.006, 0.08))}, "could slip"),
        ("CCR/SoftObstacle-v1", {"spring": (0, 0.1)}, "spring is"),
        ("CCR/SoftObstacle-v1", {"spring": (0.1, INF)}, "spring is"),
        (
            "CCR/SoftObstacle-v1",
            {"spring": (10, 1e11)},
            r"spring is \(10, .*\); it must be two numbers from .* to 1000000,",
        ),
        ("CCR/SoftObstacle-v1", {"spring": (1e-11, 10)}, "spring is"),
        (PUSH, {"radius": (0.06, 1e5)}, r"radius is \(0.06, .*\); it must be two numbers from .* to 10,"),
        ("CCR/BracedPush-v1", {"goal": ((0.3, 0.4), (0.7, 0.8), (0.07, 200))}, r"goal\[2\] is"),
        ("CCR/InsertAndPush-v1", {"radius": (0.07, 200)}, "radius is"),
        ("CCR/SpatialPush-v1", {"radius": (0.07, 200)}, "radius is"),
        ("CCR/InsertAndPush-v1", {"y": (130, 75)}, "y is"),
        ("CCR/SpatialPush-v1", {"cylinder_fraction": 7}, "cylinder_fraction is 7; it must be a number from 0 to 1"),
        ("CCR/SpatialPush-v1", {"max_tilt": -0.1}, "max_tilt is"),
        ("CCR/SpatialPush-v1", {"max_ramp_angle": 2}, "max_ramp_angle is"),
        ("CCR/SpatialPush-v1", {"distance": (-1, 60)}, "distance is"),
        ("CCR/SpatialPush-v1", {"height": (1, NAN)}, "height is"),
        ("CCR/SpatialPush-v1", {"radius": (0.014, 0.09), "cylinder_fraction": 0}, "Sphere.*could slip"),
        ("CCR/SpatialPush-v1", {"radius": (0.014, 0.09), "cylinder_fraction": 1}, "Cylinder.*could slip"),
        ("CCR/SpatialPush-v1", {"force_vector": "no"}, "force_vector is 'no'; it must be True or False"),
        ("CCR/SpatialPush-v1", {"force_vector": 1}, "force_vector is 1"),
    ],
)
def test_invalid_tasks_are_refused(env_id, task, message):
    for build in (make, make_vec):
        with pytest.raises(ValueError, match=message):
            build(env_id, task=task)


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"weights": {"force_error": NAN}}, "force_error is nan; it must be a number from 0 to 1000000"),
        ({"weights": {"effort": -1}}, "effort is -1"),
        ({"weights": {"approach": "much"}}, "approach is 'much'"),
        ({"weights": {"accuracy": True}}, "accuracy is True"),
        ({"estimator_friction": NAN}, "estimator_friction is nan; it must be a number from 0 to 10"),
        ({"estimator_friction": INF}, "estimator_friction is inf"),
        ({"estimator_friction": -5}, "estimator_friction is -5"),
        ({"estimator_friction": 0.1j}, "estimator_friction is"),
        ({"sensing": {"rigidity_ratio": (1, INF)}}, "rigidity_ratio is"),
        ({"sensing": {"rigidity_ratio": (0, 1)}}, "rigidity_ratio is"),
        ({"sensing": {"tendon_loss": (0, 1)}}, "tendon_loss is.*from 0 to 0.9"),
        ({"sensing": {"latency": (0, 8)}}, "latency is.*whole numbers from 0 to 7"),
        ({"sensing": {"latency": (False, 1)}}, "latency is"),
        ({"sensing": {"latency": 3}}, "latency is 3"),
        ({"sensing": {"force_noise": (0, NAN)}}, "force_noise is"),
        ({"sensing": {"backlash": (-1, 1)}}, "backlash is"),
        ({"sensing": {"force_bias": "a"}}, "force_bias is 'a'"),
        ({"max_increment_mm": NAN}, "max_increment_mm is nan"),
        ({"max_increment_mm": 15}, "max_increment_mm is 15.0; it must be at most 14, the cable_limit_mm"),
        ({"cable_limit_mm": INF}, "cable_limit_mm is inf"),
        ({"cable_limit_mm": 26}, "at most 25.1327, the max_cable_mm of the robot"),
        ({"cable_limit_mm": 0}, "cable_limit_mm is 0"),
        ({"force_limit": NAN}, "force_limit is nan"),
        ({"force_limit": "0.3"}, "force_limit is '0.3'"),
        ({"force_sensor": 1}, "force_sensor is 1; it must be True or False"),
        ({"obs_mode": None}, "obs_mode is None; it must be 'flat' or 'dict' or 'goal'"),
        ({"obs_mode": np.zeros(2)}, "obs_mode is"),
        ({"backend": ["native"]}, "backend is"),
        ({"estimator": "best"}, "estimator is 'best'; it must be 'contact' or 'paper'"),
        ({"regulate": True}, "regulate is True; it must be 'true' or 'estimate'"),
        ({"model": "beam"}, "model is 'beam'"),
        ({"robot": "snake"}, "robot is 'snake'; it must be .* or one of prototype, three_cables"),
        ({"split": 1}, "split is 1; it must be 'all' or 'train' or 'test'"),
    ],
)
def test_invalid_settings_are_refused(kwargs, message):
    for build in (make, make_vec):
        with pytest.raises(ValueError, match=message):
            build(**kwargs)


@pytest.mark.parametrize(
    ("env_id", "cables", "where"),
    [
        (PUSH, (Cable(angle=math.pi),), r"towards \+x"),
        (PUSH, (Cable(end=9), Cable(angle=math.pi)), r"towards \+x"),
        ("CCR/SpatialPush-v1", (Cable(),), "towards x and y"),
        ("CCR/SpatialPush-v1", (Cable(), Cable(angle=math.pi)), "towards x and y"),
    ],
)
def test_robots_that_cannot_bend_to_the_obstacles_are_refused(env_id, cables, where):
    robot = {"length_mm": 180.0, "segments": 18, "offset_mm": 8.0, "cables": cables}
    for build in (make, make_vec):
        with pytest.raises(ValueError, match=f"cannot bend every section {where}; give it cables that do"):
            build(env_id, robot=robot)


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"forse_limit": 1.0}, "got an unexpected keyword argument 'forse_limit'; it takes task, .*, force_limit, "),
        ({"task": {"forse": (0.1, 0.2)}}, "task does not take 'forse'; it takes x, y, radius, force"),
        ({"weights": {"forse_error": 1.0}}, "weights does not take 'forse_error'; it takes force_error, "),
        ({"sensing": {"latenzy": (1, 2)}}, "sensing does not take 'latenzy'; it takes latency, "),
        ({"robot": {"lenght_mm": 180.0}}, "robot does not take 'lenght_mm'; it takes length_mm, "),
        ({"task": {3: 4}}, "task does not take 3; it takes"),
        ({"task": "PushObstacle"}, "task is 'PushObstacle'; it must be a PushObstacle or a mapping of its fields"),
        ({"task": 0}, "task is 0"),
        ({"robot": 180.0}, "robot is 180.0; it must be a Robot, a mapping of its fields, or the name of a preset"),
        ({"weights": [1, 1]}, r"weights is \[1, 1\]; it must be a RewardWeights or a mapping"),
        (
            {"sensing": None},
            "sensing is None; it must be 'ideal', 'realistic', 'sensorless' or the fields of a Sensing",
        ),
    ],
)
def test_unknown_names_and_wrong_classes_are_refused(kwargs, message):
    for build in (make, make_vec):
        with pytest.raises(TypeError, match=message):
            build(**kwargs)


@pytest.mark.parametrize("given", [None, {}])
@EVERY_ID
def test_none_and_empty_mappings_mean_the_defaults(env_id, given):
    default = make(env_id).unwrapped
    env = make(env_id, task=given, robot=given, weights=given).unwrapped
    assert (env.task, env.settings) == (default.task, default.settings)


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"count": 0}, "num_envs is 0; it must be a whole number from 1 to 65536"),
        ({"count": -1}, "num_envs is -1"),
        ({"count": 2.0}, "num_envs is 2.0"),
        ({"count": "3"}, "num_envs is '3'"),
        ({"count": True}, "num_envs is True"),
        ({"count": 10**9}, "num_envs is 1000000000"),
        ({"threads": 100_000}, r"threads is 100000; it must be .* 4 for each core of this machine"),
        ({"threads": 0}, "threads is 0"),
        ({"threads": -1}, "threads is -1"),
        ({"threads": 1.5}, "threads is 1.5"),
        ({"max_episode_steps": 2.5}, "max_episode_steps is 2.5"),
        ({"max_episode_steps": 0}, "max_episode_steps is 0"),
        ({"max_episode_steps": -1}, "max_episode_steps is -1"),
        ({"max_episode_steps": True}, "max_episode_steps is True"),
        ({"autoreset_mode": "nextstep"}, "autoreset_mode is 'nextstep'; it must be 'NextStep' or"),
        ({"autoreset_mode": 0}, "autoreset_mode is 0"),
        ({"render_mode": "human"}, "render_mode is 'human'; it must be 'rgb_array'"),
    ],
)
def test_invalid_vector_arguments_are_refused(kwargs, message):
    with pytest.raises(ValueError, match=message):
        make_vec(**kwargs)


def test_numpy_numbers_are_accepted():
    env = make_vec(
        count=np.int64(2),
        threads=np.int32(4 * (os.cpu_count() or 1)),
        max_episode_steps=np.uint8(9),
        estimator_friction=np.float32(0.5),
        force_sensor=np.bool_(False),
        task={"radius": np.array([0.07, 0.08]), "force": [np.float64(0.5), np.float32(1.25)]},
    )
    assert env.reset(seed=np.uint16(3))[0].shape == (2, 99)
    assert (env.max_episode_steps, env.settings.estimator_friction, env.settings.force_sensor) == (9, 0.5, False)
    assert env.task.radius == (0.07, 0.08)
    assert all(type(end) is float for end in env.task.force)


def test_every_field_declares_a_check():
    tasks = [make(env_id).unwrapped.task for env_id in ccr_gym.ENV_IDS]
    settings = [make(env_id).unwrapped.settings for env_id in ccr_gym.ENV_IDS]
    for instance in (*tasks, *settings, RewardWeights(), Sensing()):
        assert all("check" in field.metadata for field in fields(instance)), instance
