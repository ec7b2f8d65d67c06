"""What environments refuse, and that nothing has changed after a refusal."""

import contextlib
import os
from dataclasses import dataclass, fields

import gymnasium
import numpy as np
import pytest
from comparison import same

import ccr_gym
from ccr_gym import FORCE_SCALE_N, Assignment, ContactEnv, ContactVectorEnv, RewardWeights, Sensing, Task
from ccr_gym.checks import check_range, checked
from ccr_gym.sampling import MAX_SAMPLES
from ccr_gym.tasks import uniform
from solver import Circle, Scene
from solver.spatial import Sphere

PUSH = "CCR/PushObstacle-v0"
EVERY_ID = pytest.mark.parametrize("env_id", sorted(ccr_gym.ENV_IDS))
REFUSED = (ValueError, TypeError)
NAN, INF = float("nan"), float("inf")


def make(env_id=PUSH, **kwargs):
    return gymnasium.make(env_id, disable_env_checker=True, **kwargs)


def make_vec(env_id=PUSH, count=3, **kwargs):
    return gymnasium.make_vec(env_id, count, vectorization_mode="vector_entry_point", **kwargs)


def scene_of(env_id, count=1):
    """A scene that the robot of an environment can be put among."""
    if env_id == "CCR/SpatialPush-v0":
        return Scene([Sphere(center=(50.0, 10.0 - k, 120.0 + 30 * k), radius=12) for k in range(count)])
    return Scene([Circle(center=(44.0 + 10 * k, 104.0 + 25 * k), radius=12) for k in range(count)])


def scenes_of(env_id):
    least = 2 if env_id == "CCR/BracedPush-v0" else 1
    return scene_of(env_id, least), scene_of(env_id, 3)


@pytest.mark.parametrize(
    ("env_id", "task", "message"),
    [
        (PUSH, {"force_n": (0.0, -0.1)}, r"force_n is \(0.0, -0.1\); it must be two numbers from 5e-07 to 0.5"),
        (PUSH, {"force_n": (0.0, 0.0)}, "force_n is"),
        (PUSH, {"force_n": (0.1, 0.6)}, "to 0.5"),
        (PUSH, {"force_n": (-0.1, 0.1)}, "force_n is"),
        (PUSH, {"force_n": 0.1}, "two numbers"),
        (PUSH, {"force_n": (0.1, True)}, "two numbers"),
        (PUSH, {"force_n": (0.1, 0.2, 0.3)}, "two numbers"),
        (PUSH, {"force_n": "ab"}, "two numbers"),
        (PUSH, {"force_n": (0.1, 0.1 + 0j)}, "two numbers"),
        (PUSH, {"x_mm": (75, 35)}, r"x_mm is \(75, 35\).*the smaller one first"),
        (PUSH, {"y_mm": (75, INF)}, "y_mm is"),
        (PUSH, {"y_mm": (75, 10**400)}, "y_mm is"),
        (PUSH, {"radius_mm": (-1, 12)}, "radius_mm is"),
        (PUSH, {"radius_mm": (3, 12)}, "Circle.*could slip between points.*between=1"),
        ("CCR/LoadCell-v0", {"distance_mm": (-51, -24)}, "distance_mm is"),
        ("CCR/LoadCell-v0", {"height_mm": NAN}, "height_mm is nan"),
        ("CCR/LoadCell-v0", {"height_mm": (1, 2)}, "height_mm is"),
        ("CCR/TrackForce-v0", {"swing": (5, 5)}, r"swing is \(5, 5\).*from 0 to below 1"),
        ("CCR/TrackForce-v0", {"swing": (0.5, 1)}, "swing is"),
        ("CCR/TrackForce-v0", {"period": (0, 64)}, "period is.*from 1"),
        ("CCR/TrackForce-v0", {"jumps": 2.5}, "jumps is 2.5; it must be a whole number from 0 to 128"),
        ("CCR/TrackForce-v0", {"jumps": -1}, "jumps is -1"),
        ("CCR/TrackForce-v0", {"jumps": True}, "jumps is True"),
        ("CCR/TrackForce-v0", {"force_n": (0, 1)}, "force_n is"),
        ("CCR/BracedPush-v0", {"brace_mm": ((38, 27), (75, 95), (10, 14))}, r"brace_mm\[0\] is"),
        ("CCR/BracedPush-v0", {"goal_mm": ((52, 72), (125, 150), (0, 16))}, r"goal_mm\[2\] is"),
        ("CCR/BracedPush-v0", {"goal_mm": ((52, 72), (125, 150))}, "3 ranges of two numbers"),
        ("CCR/BracedPush-v0", {"brace_mm": ((27, 38), (75, 95), (1, 14))}, "could slip"),
        ("CCR/SoftObstacle-v0", {"spring": (0, 0.1)}, "spring is"),
        ("CCR/SoftObstacle-v0", {"spring": (0.1, INF)}, "spring is"),
        ("CCR/InsertAndPush-v0", {"y_mm": (130, 75)}, "y_mm is"),
        ("CCR/SpatialPush-v0", {"cylinder_fraction": 7}, "cylinder_fraction is 7; it must be a number from 0 to 1"),
        ("CCR/SpatialPush-v0", {"max_tilt": -0.1}, "max_tilt is"),
        ("CCR/SpatialPush-v0", {"max_ramp_angle": 2}, "max_ramp_angle is"),
        ("CCR/SpatialPush-v0", {"distance_mm": (-1, 60)}, "distance_mm is"),
        ("CCR/SpatialPush-v0", {"height_mm": (1, NAN)}, "height_mm is"),
        ("CCR/SpatialPush-v0", {"radius_mm": (2.5, 16), "cylinder_fraction": 0}, "Sphere.*could slip"),
        ("CCR/SpatialPush-v0", {"radius_mm": (2.5, 16), "cylinder_fraction": 1}, "Cylinder.*could slip"),
        ("CCR/SpatialPush-v0", {"force_vector": "no"}, "force_vector is 'no'; it must be True or False"),
        ("CCR/SpatialPush-v0", {"force_vector": 1}, "force_vector is 1"),
    ],
)
def test_tasks_are_refused(env_id, task, message):
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
        ({"sensing": {"noise_n": (0, NAN)}}, "noise_n is"),
        ({"sensing": {"backlash_mm": (-1, 1)}}, "backlash_mm is"),
        ({"sensing": {"bias_n": "a"}}, "bias_n is 'a'"),
        ({"max_increment_mm": NAN}, "max_increment_mm is nan"),
        ({"max_increment_mm": 15}, "max_increment_mm is 15.0; it must be at most 14, the cable_limit_mm"),
        ({"cable_limit_mm": INF}, "cable_limit_mm is inf"),
        ({"cable_limit_mm": 26}, "at most 25.1327, the max_cable_mm of the robot"),
        ({"cable_limit_mm": 0}, "cable_limit_mm is 0"),
        ({"force_limit": NAN}, "force_limit is nan"),
        ({"force_limit": "0.3"}, "force_limit is '0.3'"),
        ({"force_sensor": 1}, "force_sensor is 1; it must be True or False"),
        ({"obs_mode": None}, "obs_mode is None; it must be 'dict' or 'flat'"),
        ({"obs_mode": np.zeros(2)}, "obs_mode is"),
        ({"backend": ["native"]}, "backend is"),
        ({"split": 1}, "split is 1; it must be 'all' or 'train' or 'test'"),
    ],
)
def test_settings_are_refused(kwargs, message):
    for build in (make, make_vec):
        with pytest.raises(ValueError, match=message):
            build(**kwargs)


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"forse_limit": 1.0}, "does not take 'forse_limit'; it takes task, .*, force_limit, "),
        ({"task": {"forse_n": (0.1, 0.2)}}, "task does not take 'forse_n'; it takes x_mm, y_mm, radius_mm, force_n"),
        ({"weights": {"forse_error": 1.0}}, "weights does not take 'forse_error'; it takes force_error, "),
        ({"sensing": {"latenzy": (1, 2)}}, "sensing does not take 'latenzy'; it takes latency, "),
        ({"robot": {"lenght_mm": 180.0}}, "robot does not take 'lenght_mm'; it takes length_mm, "),
        ({"task": {3: 4}}, "task does not take 3; it takes"),
        ({"task": "PushObstacle"}, "task is 'PushObstacle'; it must be a PushObstacle or a mapping of its fields"),
        ({"task": 0}, "task is 0"),
        ({"robot": 180.0}, "robot is 180.0; it must be a Robot or a mapping of its fields"),
        ({"weights": [1, 1]}, r"weights is \[1, 1\]; it must be a RewardWeights or a mapping"),
        ({"sensing": None}, "sensing is None; it must be 'ideal', 'realistic' or the fields of a Sensing"),
    ],
)
def test_names_and_classes_are_refused(kwargs, message):
    for build in (make, make_vec):
        with pytest.raises(TypeError, match=message):
            build(**kwargs)


@pytest.mark.parametrize("given", [None, {}])
@EVERY_ID
def test_nothing_and_an_empty_mapping_stand_for_the_defaults(env_id, given):
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
        ({"threads": 100_000}, r"threads is 100000; it must be .* \(4 for each core of this machine\)"),
        ({"threads": 0}, "threads is 0"),
        ({"threads": -1}, "threads is -1"),
        ({"threads": 1.5}, "threads is 1.5"),
        ({"max_episode_steps": 2.5}, "max_episode_steps is 2.5"),
        ({"max_episode_steps": 0}, "max_episode_steps is 0"),
        ({"max_episode_steps": -1}, "max_episode_steps is -1"),
        ({"max_episode_steps": True}, "max_episode_steps is True"),
        ({"autoreset_mode": "nextstep"}, "autoreset_mode is 'nextstep'; it must be 'NextStep' or"),
        ({"autoreset_mode": 0}, "autoreset_mode is 0"),
        ({"render_mode": "rgb_array"}, "render_mode is 'rgb_array'; use vectorization_mode='sync'"),
    ],
)
def test_arguments_of_vector_environments_are_refused(kwargs, message):
    with pytest.raises(ValueError, match=message):
        make_vec(**kwargs)


def test_numpy_numbers_are_numbers():
    env = make_vec(
        count=np.int64(2),
        threads=np.int32(4 * (os.cpu_count() or 1)),
        max_episode_steps=np.uint8(9),
        estimator_friction=np.float32(0.5),
        force_sensor=np.bool_(False),
        task={"radius_mm": np.array([12, 13]), "force_n": [np.float64(0.1), np.float32(0.25)]},
    )
    assert env.reset(seed=np.uint16(3))[0]["nodes"].shape == (2, 57)
    assert (env.max_episode_steps, env.settings.estimator_friction, env.settings.force_sensor) == (9, 0.5, False)
    assert env.task.radius_mm == (12.0, 13.0)
    assert all(type(end) is float for end in env.task.force_n)


def test_checked_fields_are_all_of_them():
    tasks = [make(env_id).unwrapped.task for env_id in ccr_gym.ENV_IDS]
    settings = [make(env_id).unwrapped.settings for env_id in ccr_gym.ENV_IDS]
    for instance in (*tasks, *settings, RewardWeights(), Sensing()):
        assert all("check" in field.metadata for field in fields(instance)), instance


@EVERY_ID
def test_after_given_obstacles_the_task_goes_on(env_id):
    """However many obstacles were given, the next episode is that of an environment that was given none."""
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
    ({"seed": 5, "options": {"scene": [1], "desired_force": 0.1}}, "scene is"),
    ({"seed": 5, "options": {"scene": None, "desired_force": 0.1}}, "scene is None; it must be a Scene"),
    *(
        ({"seed": 5, "options": {"scene": scene_of(PUSH), "desired_force": force}}, "desired_force is")
        for force in (-0.1, 0.0, 0.6, NAN, INF, "0.1", True, 0.1j, None, [0.1], (0.1, 0.1), 1e300)
    ),
    (
        {"seed": 5, "options": {"scene": Scene([]), "desired_force": 0.1}},
        "the scene has 0 obstacles; it must have at least 1",
    ),
    (
        {"seed": 5, "options": {"scene": Scene([Circle(center=(0, 90), radius=15)]), "desired_force": 0.1}},
        "overlaps the straight robot",
    ),
    ({"seed": 5, "options": {"scene": scene_of("CCR/SpatialPush-v0"), "desired_force": 0.1}}, "Sphere"),
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
    """A user's task, which draws what its mood is."""

    mood: list  # the next draws, consumed one by one; a circle when none is left
    x_mm: tuple[float, float] = checked((40.0, 50.0), check_range, low=0)

    def sample(self, robot, generator):
        x, force = uniform(generator, self.x_mm, (0.05, 0.1))
        plain = Assignment(Scene([Circle(center=(x, 104.0), radius=15)]), force)
        return self.mood.pop()(plain) if self.mood else plain


class Odd(Exception):
    """What a user's task raises."""


def raising(_):
    raise Odd("odd")


MOODS = {
    "no assignment": (lambda plain: None, TypeError, "what the task samples is None; it must be an Assignment"),
    "no scene": (lambda plain: plain._replace(scene=[]), TypeError, "sampled scene is"),
    "two obstacles": (lambda plain: plain._replace(scene=scene_of(PUSH, 2)), ValueError, "a Scene of 1 obstacles"),
    "no force": (lambda plain: plain._replace(desired_force=NAN), ValueError, "sampled desired_force is nan"),
    "large force": (lambda plain: plain._replace(desired_force=0.51), ValueError, "sampled desired_force is 0.51"),
    "no pull": (lambda plain: plain._replace(pull=(1.0, 2.0)), ValueError, "sampled pull"),
    "short profile": (lambda plain: plain._replace(profile=np.ones(3)), ValueError, "sampled profile"),
    "wild profile": (lambda plain: plain._replace(profile=np.full(128, 2.0)), ValueError, "sampled profile"),
    "an error": (raising, Odd, "odd"),
}


@pytest.mark.parametrize("mood", sorted(MOODS))
def test_a_draw_that_fails_changes_nothing(mood):
    draw, error, message = MOODS[mood]
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
            task.mood.append(draw)
            with pytest.raises(error, match=message):
                one.reset(seed=seed)
        for _ in range(2):
            same(one.step(action), other.step(action))
        if one is vector:  # at its end a step draws the next episodes
            task.mood.append(draw)
            with pytest.raises(error, match=message):
                one.step(action)
            same(one.step(action), other.step(action))
        same(one.reset(), other.reset())


def far(plain):
    """A draw whose obstacle is out of reach."""
    return plain._replace(scene=Scene([Circle(center=(44.0, 400.0), radius=15)]))


def test_when_no_scene_is_found_nothing_has_changed():
    task, action = Fickle([]), np.ones((3, 1))
    env, twin = (ContactVectorEnv(t, 3, sensing="realistic", obs_mode="flat") for t in (task, Fickle([])))
    same(env.reset(seed=1), twin.reset(seed=1))
    for _ in range(30):
        same(env.step(action), twin.step(action))
    for kwargs in ({}, {"seed": 4}, {"options": {"reset_mask": np.array([True, False, True])}}):
        task.mood[:] = 3 * MAX_SAMPLES * [far]
        with pytest.raises(RuntimeError, match="widen"):
            env.reset(**kwargs)
        task.mood.clear()
        same(env.step(action), twin.step(action))
    same(env.reset(), twin.reset())


def test_a_scene_that_is_never_of_a_split_is_refused():
    narrow = {"x_mm": (44, 44), "y_mm": (104, 104), "radius_mm": (15, 15)}
    found = []
    for split in ("train", "test"):
        env = make(task=narrow, split=split).unwrapped
        with contextlib.suppress(RuntimeError):
            env.reset(seed=0)
            found.append(split)
        assert (env.np_random_seed == 0) == (split in found)
    assert len(found) == 1


@pytest.mark.parametrize(
    "declared", [{"obstacles": 0}, {"obstacles": 1.5}, {"steps": 0}, {"target": 1}, {"target": -1}]
)
def test_what_a_user_declares_of_a_task_is_checked(declared):
    kind = type("Declared", (Fickle,), declared)
    with pytest.raises(ValueError, match=f"{next(iter(declared))} of the task is"):
        ContactEnv(kind([]))
    with pytest.raises(ValueError, match="x_mm is"):
        kind([], x_mm=(50, 40))


@pytest.mark.parametrize(
    "seed", [np.int64(0), np.int64(5), np.uint8(5), [np.int64(5), 6, 7], np.arange(5, 8), (5, 6, 7)]
)
def test_seeds_of_numpy_are_seeds(seed):
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
def test_a_refused_reset_of_many_changes_nothing(kwargs, message):
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
def test_nothing_is_asked_before_a_reset_and_closing_is_harmless(env_id):
    for build in (make, make_vec):
        env = build(env_id).unwrapped
        places = np.zeros(env.action_space.shape)
        for ask in (lambda env=env, places=places: env.probe(places), lambda env=env: env.privileged_state):
            with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
                ask()
        env.reset(seed=0)
        for wrong in (places[..., :0], np.full(places.shape, NAN), "here", None):
            with pytest.raises(ValueError, match="actuated_mm is"):
                env.probe(wrong)
        assert np.isfinite(env.probe(places)).all()
        env.close()
        env.close()
        env.step(places)


def test_the_set_point_is_what_the_observation_can_show():
    env = make("CCR/SpatialPush-v0", task={"force_vector": True, "force_n": (0.4, FORCE_SCALE_N)}, cable_limit_mm=12)
    for seed in range(10):
        observation, info = env.reset(seed=seed)
        assert np.linalg.norm(info["desired_force"]) <= FORCE_SCALE_N
        assert FORCE_SCALE_N * observation["desired_force"] == pytest.approx(info["desired_force"], abs=1e-7)
