"""Whatever is passed to an environment works, or is refused by name and changes nothing."""

import zlib
from dataclasses import fields

import gymnasium
import numpy as np
import pytest
from comparison import same
from gymnasium.envs.registration import load_env_creator
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as nps

import ccr_gym
import ccr_gym.sampling
from ccr_gym import RewardWeights, Sensing
from solver import Circle, HalfPlane, Scene
from solver.spatial import Sphere

EVERY_ID = pytest.mark.parametrize("env_id", sorted(ccr_gym.ENV_IDS))
EVERY_FORM = pytest.mark.parametrize("count", [None, 3])  # number of environments; None for a single one
fuzz = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
SAMPLES = 20
SLIPS = "could slip between points"
OPTIONS = ("seed", "options", "scene", "desired_force", "reset_mask", "overlaps the unstressed robot", SLIPS)
UNREACHABLE = "widen the task's ranges"
REPEATABLE = settings().derandomize

numbers = (
    st.integers(-3, 3)
    | st.sampled_from([0.0, -0.0, 1.0, 0.1, 0.5, 12.0, 40.0, 100.0, 1e-320, 1e-30, 1e29, 1e300, 10**400])
    | st.floats()
    | st.sampled_from([np.int64(2), np.float32(0.25), np.uint8(3), np.float64("nan"), np.bool_(True)])
)
odd = (
    st.none()
    | st.booleans()
    | st.complex_numbers()
    | st.text(max_size=3)
    | st.binary(max_size=3)
    | st.sampled_from(
        [object(), object, (), [], {}, set(), frozenset([1]), range(3), np.timedelta64(1, "s"), {"a": 1}, [[]]]
    )
    | nps.arrays(st.sampled_from(["f8", "f4", "c16", "i8", "?", "O", "U2"]), nps.array_shapes(max_dims=2, max_side=3))
)
pairs = st.tuples(numbers, numbers) | st.lists(numbers, max_size=3)
ascending = st.tuples(st.floats(0, 100), st.floats(0, 100)).map(sorted)
anything = numbers | odd | pairs | ascending | st.lists(pairs, min_size=3, max_size=3)


def build(env_id, count, /, **kwargs):
    if "render_mode" in kwargs and count is None:  # Gymnasium refuses it with a message of its own
        return load_env_creator(gymnasium.spec(env_id).entry_point)(**kwargs)
    if count is None:
        return gymnasium.make(env_id, disable_env_checker=True, **kwargs).unwrapped
    kwargs = {"count": count} | kwargs
    return gymnasium.make_vec(env_id, kwargs.pop("count"), vectorization_mode="vector_entry_point", **kwargs)


def fuzzed(env_id, count, short, long):
    """Return a decorator for so many examples, the short form where they are the same in every run.

    Those differ between environments then, which share most of their code; by default they would be the same for all.
    """
    if not REPEATABLE:
        return settings(fuzz, max_examples=long)
    own = seed(zlib.crc32(f"{env_id} {count}".encode()))
    return lambda test: own(settings(fuzz, max_examples=short)(test))


def named(error, *words):
    """Assert that a message contains one of some words."""
    assert any(word in str(error) for word in words), error


def check_step(env, step):
    observation, reward, *_ = step
    assert env.observation_space.contains(observation)
    assert np.isfinite(reward).all()


def arguments(env_id, count):
    """Return the paths of all arguments of an environment: names, and names within mappings."""
    env = build(env_id, None)
    names = [field.name for field in fields(env.settings)] + ["task", "render_mode"]
    if count is not None:
        names += ["count", "threads", "max_episode_steps", "autoreset_mode"]
    nested = {"weights": RewardWeights(), "sensing": Sensing(), "task": env.task, "robot": env.settings.robot}
    choices = [(name,) for name in names]
    choices += [(outer, field.name) for outer, inner in nested.items() for field in fields(inner)]
    choices += [(outer, "unheard_of") for outer in nested] + [("unheard_of",)]
    return choices


def given_as(env_id, name, value):
    """Return keyword arguments with a value at a path; a robot has no defaults, so it keeps its other fields."""
    if len(name) == 1:
        return {name[0]: value}
    robot = build(env_id, None).settings.robot
    others = {field.name: getattr(robot, field.name) for field in fields(robot)} if name[0] == "robot" else {}
    return {name[0]: others | {name[1]: value}}


def words(name, kwargs):
    """Return what a message may name: the argument, or another field of the same robot."""
    if name[0] == "robot" and len(name) == 2:
        return tuple(kwargs["robot"])
    return ("num_envs" if name == ("count",) else name[0], *name[1:])


@EVERY_FORM
@EVERY_ID
def test_arguments(env_id, count, monkeypatch):
    monkeypatch.setattr(ccr_gym.sampling, "MAX_SAMPLES", SAMPLES)

    @fuzzed(env_id, count, short=40, long=150)
    @given(st.sampled_from(arguments(env_id, count)), anything)
    def run(name, value):
        kwargs = given_as(env_id, name, value)
        try:
            env = build(env_id, count, **kwargs)
            env.reset(seed=0)
        except (ValueError, TypeError) as error:
            named(error, *words(name, kwargs))
            return
        except RuntimeError as error:
            named(error, UNREACHABLE)
            return
        for _ in range(4):
            check_step(env, env.step(np.ones(env.action_space.shape, np.float32)))

    run()


def scenes(space):
    place = st.floats(-200, 200)
    if space == 3:
        obstacle = st.builds(Sphere, center=st.tuples(place, place, place), radius=st.floats(1, 30))
    else:
        obstacle = st.builds(Circle, center=st.tuples(place, place), radius=st.floats(1, 30))
        obstacle |= st.builds(HalfPlane, point=st.tuples(place, place), normal=st.just((-1.0, 0.0)))
    return st.lists(obstacle, max_size=3).map(Scene)


def operations(env_id, count):
    """Return resets and steps, most of them with odd arguments."""
    env = build(env_id, count)
    shape = env.action_space.shape
    single = scenes(env.task.adapter.space) | scenes(2) | odd
    given_scene = st.fixed_dictionaries({}, optional={"scene": single, "desired_force": numbers | odd, "seen": odd})
    mask = st.fixed_dictionaries({}, optional={"reset_mask": nps.arrays("?", st.integers(0, 4)) | odd, "a": odd})
    seeds = st.integers(0, 9) | numbers | odd | st.lists(st.integers(0, 9) | st.none() | numbers, max_size=4)
    reset = st.fixed_dictionaries({}, optional={"seed": seeds, "options": given_scene | mask | odd})
    good = nps.arrays("f4", shape, elements=st.floats(-1, 1, width=32))
    action = good | nps.arrays("f8", shape) | nps.arrays("i8", shape) | odd | numbers | pairs
    return st.tuples(st.just("reset"), reset) | st.tuples(st.just("step"), action) | st.tuples(st.just("step"), good)


@EVERY_FORM
@EVERY_ID
def test_resets_and_steps(env_id, count):
    @fuzzed(env_id, count, short=10, long=40)
    @given(st.lists(operations(env_id, count), min_size=1, max_size=6), st.sampled_from(["ideal", "realistic"]))
    def run(sequence, sensing):
        env, twin = (build(env_id, count, sensing=sensing) for _ in range(2))
        same(env.reset(seed=0), twin.reset(seed=0))
        for name, value in sequence:
            apply = (lambda e, v=value: e.reset(**v)) if name == "reset" else (lambda e, v=value: e.step(v))
            try:
                result = apply(env)
            except (ValueError, TypeError) as error:
                words = ("action",) if name == "step" else OPTIONS
                named(error, *words)
                continue
            same(result, apply(twin))
            assert env.observation_space.contains(result[0])
            if name == "step":
                check_step(env, result)
        action = np.ones(env.action_space.shape, np.float32)
        same(env.step(action), twin.step(action))
        same(env.reset(), twin.reset())

    run()
