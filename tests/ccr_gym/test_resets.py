"""Resets with given scenes and seeds; a reset, step or sample that raises changes nothing."""

from dataclasses import dataclass

import gymnasium
import numpy as np
import pytest
from comparison import same

import ccr_gym
from ccr_gym import FORCE_SPAN, Assignment, ContactEnv, ContactVectorEnv, Task
from ccr_gym.checks import check_range, checked
from ccr_gym.sampling import MAX_SAMPLES
from ccr_gym.task import uniform
from solver import Circle, Scene
from solver.spatial import Sphere

PUSH = "CCR/PushObstacle-v1"
EVERY_ID = pytest.mark.parametrize("env_id", sorted(ccr_gym.ENV_IDS))
REFUSED = (ValueError, TypeError)
NAN, INF = float("nan"), float("inf")


def make(env_id=PUSH, **kwargs):
    return gymnasium.make(env_id, disable_env_checker=True, **kwargs)


def make_vec(env_id=PUSH, count=3, **kwargs):
    return gymnasium.make_vec(env_id, count, vectorization_mode="vector_entry_point", **kwargs)


def scene_of(env_id, count=1):
    """Obstacles that leave the robot of an environment clear."""
    if "Spatial" in env_id:
        return Scene([Sphere(center=(50.0, 10.0 - k, 120.0 + 30 * k), radius=12) for k in range(count)])
    return Scene([Circle(center=(44.0 + 10 * k, 104.0 + 25 * k), radius=12) for k in range(count)])


def scenes_of(env_id):
    least = 2 if env_id == "CCR/BracedPush-v1" else 1
    return scene_of(env_id, least), scene_of(env_id, 3)


@EVERY_ID
def test_sampled_episodes_do_not_depend_on_given_ones_before(env_id):
    env, twin = make(env_id, obs_mode="flat"), make(env_id, obs_mode="flat")
    for scene in scenes_of(env_id):
        force = (0.05, 0.0, 0.0) if env.unwrapped.task.force_vector else 0.05
        observation, _ = env.reset(options={"scene": scene, "desired_force": force})
        assert env.observation_space.contains(observation)
        assert env.unwrapped.equilibrium.scene == scene
        env.step(np.ones(env.action_space.shape, np.float32))
        same(env.reset(seed=7), twin.reset(seed=7))
        action = np.full(env.action_space.shape, 0.5, np.float32)
        for _ in range(20):
            same(env.step(action), twin.step(action))
        same(env.reset(), twin.reset())


BAD_RESETS = [
    ({"seed": -1}, "seed is -1; it must be None or a whole number from 0 on"),
    ({"seed": True}, "seed is True"),
    ({"seed": 1.0}, "seed is 1.0"),
    ({"seed": "1"}, "seed is '1'"),
    ({"seed": [1]}, r"seed is \[1\]"),
    ({"seed": {}}, "seed is"),
    ({"seed": 5, "options": {"scene": 0}}, "mapping of both 'scene' and 'desired_force'"),
    ({"seed": 5, "options": {"scene": scene_of(PUSH)}}, "both"),
    ({"seed": 5, "options": {"desired_force": 0.1}}, "both"),
    ({"seed": 5, "options": {"seen": 1, "desired_force": 0.1}}, "both"),
    ({"seed": 5, "options": {3: 1, "desired_force": 0.1}}, "both"),
    ({"seed": 5, "options": [1]}, "options is"),
    ({"seed": 5, "options": []}, "options is"),
    ({"seed": 5, "options": 0}, "options is 0"),
    ({"seed": 5, "options": {"scene": [1], "desired_force": 0.1}}, "an entry of obstacles is 1"),
    ({"seed": 5, "options": {"scene": None, "desired_force": 0.1}}, "scene is None; it must be a Scene"),
    *(
        ({"seed": 5, "options": {"scene": scene_of(PUSH), "desired_force": force}}, "desired_force is")
        for force in (-0.1, 0.0, 1.6, NAN, INF, "0.1", True, 0.1j, None, [0.1], (0.1, 0.1), 1e300)
    ),
    (
        {"seed": 5, "options": {"scene": Scene([]), "desired_force": 0.1}},
        "the scene has 0 obstacles; it must have at least 1",
    ),
    (
        {"seed": 5, "options": {"scene": Scene([Circle(center=(0, 90), radius=15)]), "desired_force": 0.1}},
        "overlaps the unstressed robot",
    ),
    ({"seed": 5, "options": {"scene": scene_of("CCR/SpatialPush-v1"), "desired_force": 0.1}}, "Sphere"),
]


@pytest.mark.parametrize(("kwargs", "message"), BAD_RESETS)
def test_a_refused_reset_changes_nothing(kwargs, message):
    env, twin = (make(sensing="realistic", obs_mode="flat").unwrapped for _ in range(2))
    with pytest.raises(REFUSED, match=message):
        env.reset(**kwargs)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.zeros(1, np.float32))
    for each in (env, twin):
        each.reset(seed=3)
        each.step(np.ones(1, np.float32))
    with pytest.raises(REFUSED, match=message):
        env.reset(**kwargs)
    assert env.np_random_seed == twin.np_random_seed
    action = np.ones(1, np.float32)
    for _ in range(20):
        same(env.step(action), twin.step(action))
    same(env.reset(), twin.reset())


@dataclass(frozen=True, slots=True)
class Fickle(Task):
    """A user's task whose next samples can be spoilt."""

    spoil: list  # functions of the next samples, consumed one by one
    x: tuple[float, float] = checked((40.0, 50.0), check_range, low=0)

    def sample(self, robot, generator):
        x, force = uniform(generator, self.x, (0.05, 0.1))
        valid = Assignment(Scene([Circle(center=(x, 104.0), radius=15)]), force)
        return self.spoil.pop()(valid) if self.spoil else valid


class Odd(Exception):
    """An error that a user's task raises."""


def raising(_):
    raise Odd("odd")


SPOILT = {
    "no assignment": (lambda valid: None, TypeError, "what the task samples is None; it must be an Assignment"),
    "no scene": (lambda valid: valid._replace(scene=[]), TypeError, "sampled scene is"),
    "two obstacles": (lambda valid: valid._replace(scene=scene_of(PUSH, 2)), ValueError, "a Scene of 1 obstacles"),
    "no force": (lambda valid: valid._replace(desired_force=NAN), ValueError, "sampled desired_force is nan"),
    "large force": (lambda valid: valid._replace(desired_force=1.55), ValueError, "sampled desired_force is 1.55"),
    "no direction": (lambda valid: valid._replace(direction=(1.0, 2.0)), ValueError, "sampled direction"),
    "short profile": (lambda valid: valid._replace(profile=np.ones(3)), ValueError, "sampled profile"),
    "wild profile": (lambda valid: valid._replace(profile=np.full(128, 2.0)), ValueError, "sampled profile"),
    "an error": (raising, Odd, "odd"),
}


@pytest.mark.parametrize("name", sorted(SPOILT))
def test_an_invalid_sample_changes_nothing(name):
    spoil, error, message = SPOILT[name]
    task = Fickle([])
    env, twin = (ContactEnv(t, sensing="realistic", obs_mode="flat") for t in (task, Fickle([])))
    vector, vector_twin = (
        ContactVectorEnv(t, 3, max_episode_steps=4, sensing="realistic", obs_mode="flat") for t in (task, Fickle([]))
    )
    for one, other, action in ((env, twin, np.ones(1)), (vector, vector_twin, np.ones((3, 1)))):
        same(one.reset(seed=1), other.reset(seed=1))
        for _ in range(2):
            same(one.step(action), other.step(action))
        for seed in (None, 9):
            task.spoil.append(spoil)
            with pytest.raises(error, match=message):
                one.reset(seed=seed)
        for _ in range(2):
            same(one.step(action), other.step(action))
        if one is vector:  # at the end of the episodes a step samples the next ones
            task.spoil.append(spoil)
            with pytest.raises(error, match=message):
                one.step(action)
            same(one.step(action), other.step(action))
        same(one.reset(), other.reset())


def out_of_reach(sample):
    """The same sample with an obstacle out of reach."""
    return sample._replace(scene=Scene([Circle(center=(44.0, 400.0), radius=15)]))


def test_finding_no_feasible_scene_changes_nothing():
    task, action = Fickle([]), np.ones((3, 1))
    env, twin = (ContactVectorEnv(t, 3, sensing="realistic", obs_mode="flat") for t in (task, Fickle([])))
    same(env.reset(seed=1), twin.reset(seed=1))
    for _ in range(30):
        same(env.step(action), twin.step(action))
    for kwargs in ({}, {"seed": 4}, {"options": {"reset_mask": np.array([True, False, True])}}):
        task.spoil[:] = 3 * MAX_SAMPLES * [out_of_reach]
        with pytest.raises(RuntimeError, match="widen"):
            env.reset(**kwargs)
        task.spoil.clear()
        same(env.step(action), twin.step(action))
    same(env.reset(), twin.reset())


@pytest.mark.parametrize(
    "declared", [{"obstacles": 0}, {"obstacles": 1.5}, {"steps": 0}, {"target": 1}, {"target": -1}]
)
def test_attributes_of_a_users_task_are_checked(declared):
    kind = type("Declared", (Fickle,), declared)
    with pytest.raises(ValueError, match=f"{next(iter(declared))} of the task is"):
        ContactEnv(kind([]))
    with pytest.raises(ValueError, match="x is"):
        kind([], x=(50, 40))


@pytest.mark.parametrize(
    "seed", [np.int64(0), np.int64(5), np.uint8(5), [np.int64(5), 6, 7], np.arange(5, 8), (5, 6, 7)]
)
def test_numpy_seeds_are_accepted(seed):
    first = int(np.ravel(seed)[0])
    same(make_vec().reset(seed=seed), make_vec().reset(seed=first))
    same(make().reset(seed=np.int64(first)), make().reset(seed=first))


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"seed": []}, "seed has 0 entries; it must have 3"),
        ({"seed": ()}, "seed has 0 entries"),
        ({"seed": {}}, "seed is {}; it must be None or a whole number from 0 on"),
        ({"seed": set()}, "seed is"),
        ({"seed": {1: 2, 3: 4, 5: 6}}, "seed is"),
        ({"seed": "abc"}, "seed is 'abc'"),
        ({"seed": False}, "seed is False"),
        ({"seed": -1}, "seed is -1"),
        ({"seed": 1.0}, "seed is 1.0"),
        ({"seed": np.array(1)}, "seed is"),
        ({"seed": np.zeros(3)}, r"seed\[0\] is"),
        ({"seed": [1, 2, -3]}, r"seed\[2\] is -3"),
        ({"seed": [1, True, 3]}, r"seed\[1\] is True"),
        ({"seed": [1, 2, 3, 4]}, "seed has 4 entries"),
        ({"seed": 5, "options": []}, "options is"),
        ({"seed": 5, "options": {"reset_mask": [[True], [True, False], []]}}, "reset_mask is"),
        ({"seed": 5, "options": {"reset_mask": [1, 0, 1]}}, "reset_mask is"),
        ({"seed": 5, "options": {"reset_mask": np.zeros(3, bool)}}, "reset_mask is"),
        ({"seed": 5, "options": {"reset_mask": np.ones(2, bool)}}, "reset_mask is"),
        ({"seed": 5, "options": {"reset_mask": True}}, "reset_mask is"),
        ({"seed": 5, "options": {"reset_mask": None}}, "reset_mask is"),
        ({"seed": 5, "options": {"scene": scene_of(PUSH), "desired_force": 0.1}}, "options is"),
    ],
)
def test_a_refused_vector_reset_changes_nothing(kwargs, message):
    env, twin = (make_vec(sensing="realistic", obs_mode="flat") for _ in range(2))
    action = np.ones((3, 1))
    for each in (env, twin):
        each.reset(seed=3)
        each.step(action)
    with pytest.raises(REFUSED, match=message):
        env.reset(**kwargs)
    same(env.step(action), twin.step(action))
    same(env.reset(), twin.reset())


@EVERY_ID
def test_bad_actions_are_refused_and_change_nothing(env_id):
    for build in (make, make_vec):
        env, twin = build(env_id).unwrapped, build(env_id).unwrapped
        shape = env.action_space.shape
        for each in (env, twin):
            each.reset(seed=0)
        bad = [np.full(shape, kind) for kind in (1j, NAN, INF, True, None, "1", 10**30, np.timedelta64(1), b"1")]
        bad += [np.ones(shape, np.longdouble), np.ones((*shape, 1)), np.ones(shape)[..., :0], 0.5, None, "ab", {}, []]
        for action in bad:
            with pytest.raises(ValueError, match=r"(?s)actions? is .*it must be finite numbers of shape"):
                env.step(action)
        for kind in (np.float16, np.float64, np.int8, np.uint64):
            same(env.step(np.ones(shape, kind)), twin.step(np.ones(shape, np.float32)))
        same(env.step(np.ones(shape).tolist()), twin.step(np.ones(shape)))


@EVERY_ID
def test_state_needs_a_reset_and_closing_twice_is_harmless(env_id):
    for build in (make, make_vec):
        env = build(env_id).unwrapped
        positions = np.zeros(env.action_space.shape)
        for ask in (lambda env=env, positions=positions: env.probe(positions), lambda env=env: env.privileged_state):
            with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
                ask()
        env.reset(seed=0)
        for wrong in (positions[..., :0], np.full(positions.shape, NAN), "here", None):
            with pytest.raises(ValueError, match="actuated_mm is"):
                env.probe(wrong)
        assert np.isfinite(env.probe(positions)).all()
        env.close()
        env.close()
        env.step(positions)


def test_sampled_vector_set_points_stay_within_the_observation():
    env = make("CCR/SpatialPush-v1", task={"force_vector": True, "force": (6.0, FORCE_SPAN)}, obs_mode="dict")
    most = FORCE_SPAN * env.unwrapped.settings.scales.force_n
    for seed in range(10):
        observation, info = env.reset(seed=seed)
        assert np.linalg.norm(info["desired_force"]) <= most
        assert most * observation["desired_force"] == pytest.approx(info["desired_force"], abs=1e-6)
