"""The vector environment is bit-identical to Gymnasium's synchronous one."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import ccr_gym

EVERY_ID = pytest.mark.parametrize("env_id", sorted(ccr_gym.ENV_IDS))
EVERY_MODE = pytest.mark.parametrize("mode", list(AutoresetMode))
COUNT = 5


def make_both(env_id, mode, **kwargs):
    ours = gymnasium.make_vec(
        env_id, COUNT, vectorization_mode="vector_entry_point", autoreset_mode=mode, max_episode_steps=17, **kwargs
    )
    theirs = gymnasium.make_vec(
        env_id,
        COUNT,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        max_episode_steps=17,
        **kwargs,
    )
    return ours, theirs


def same(ours, theirs):
    """Assert equal structure, types and bits."""
    if isinstance(theirs, dict):
        assert ours.keys() == theirs.keys()
        for key in theirs:
            same(ours[key], theirs[key])
    elif isinstance(theirs, tuple):
        assert len(ours) == len(theirs)
        for our, their in zip(ours, theirs, strict=True):
            same(our, their)
    elif theirs is None:
        assert ours is None
    elif theirs.dtype == object:
        for our, their in zip(ours, theirs, strict=True):
            same(our, their)
    else:
        assert ours.dtype == theirs.dtype
        assert np.array_equal(ours, theirs)


@EVERY_ID
@EVERY_MODE
@pytest.mark.parametrize("obs_mode", ["dict", "flat"])
def test_results_are_those_of_single_environments(pytestconfig, env_id, mode, obs_mode):
    ours, theirs = make_both(env_id, mode, obs_mode=obs_mode)
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    same(ours.reset(seed=11), theirs.reset(seed=11))
    generator = np.random.default_rng(0)
    for _ in range(pytestconfig.getoption("vector_steps") // COUNT):
        actions = generator.uniform(-0.4, 1, ours.action_space.shape).astype(np.float32)
        our, their = ours.step(actions), theirs.step(actions)
        same(our, their)
        ended = our[2] | our[3]
        if mode is AutoresetMode.DISABLED and ended.any():
            with pytest.raises(gymnasium.error.ResetNeeded, match="reset_mask"):
                ours.step(actions)
            same(*(env.reset(options={"reset_mask": ended}) for env in (ours, theirs)))


@EVERY_ID
def test_results_do_not_depend_on_threads(env_id):
    records = []
    for threads in (1, 2, 3):
        env = gymnasium.make_vec(env_id, 23, vectorization_mode="vector_entry_point", threads=threads, obs_mode="flat")
        record = [env.reset(seed=2)[0]]
        for action in np.random.default_rng(1).uniform(-0.4, 1, (40, *env.action_space.shape)):
            observation, reward, *_ = env.step(action)
            record += [observation, reward]
        records.append(record)
    for record in records[1:]:
        assert all(np.array_equal(a, b) for a, b in zip(records[0], record, strict=True))


def test_unseeded_episodes_differ():
    env = gymnasium.make_vec("CCR/PushObstacle-v1", 3, vectorization_mode="vector_entry_point", obs_mode="dict")
    first, _ = env.reset()
    again, _ = env.reset()
    assert len(set(first["desired_force"].ravel())) == 3
    assert not np.intersect1d(first["desired_force"], again["desired_force"]).size


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"options": {"scene": 1}}, "options is"),
        ({"options": {"reset_mask": np.ones(2, bool)}}, "reset_mask is"),
        ({"options": {"reset_mask": np.zeros(3, bool)}}, "reset_mask is"),
        ({"seed": [1, 2]}, "seed has 2 entries; it must have 3"),
    ],
)
def test_bad_resets_are_refused(arguments, message):
    env = gymnasium.make_vec("CCR/PushObstacle-v1", 3, vectorization_mode="vector_entry_point", obs_mode="dict")
    env.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        env.reset(**arguments)


def test_bad_actions_are_refused_and_change_nothing():
    env, twin = (
        gymnasium.make_vec("CCR/PushObstacle-v1", 3, vectorization_mode="vector_entry_point") for _ in range(2)
    )
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        env.step(np.zeros((3, 1)))
    env.reset(seed=0)
    twin.reset(seed=0)
    for actions in (np.zeros((2, 1)), np.zeros(3), np.array([[0.0], [np.nan], [0.0]])):
        with pytest.raises(ValueError, match="finite numbers of shape"):
            env.step(actions)
    same(env.step(np.ones((3, 1))), twin.step(np.ones((3, 1))))


def test_pictures_of_a_new_episode_show_nothing_of_the_last_one():
    action, pictures = np.ones((2, 1), np.float32), []
    for mode in ("NextStep", "SameStep"):
        env = gymnasium.make_vec(
            "CCR/PushObstacle-v1",
            2,
            vectorization_mode="vector_entry_point",
            autoreset_mode=mode,
            max_episode_steps=5,
            render_mode="rgb_array",
        )
        env.reset(seed=0)
        for _ in range(5 + (mode == "NextStep")):
            env.step(action)
        pictures.append(env.render())
    assert np.array_equal(*pictures)
