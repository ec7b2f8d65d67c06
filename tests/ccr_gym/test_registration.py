"""Registered ids: their specs, entry points and docstrings."""

import pydoc
import re
from dataclasses import fields

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

import ccr_gym

EVERY_ID = pytest.mark.parametrize("env_id", sorted(ccr_gym.ENV_IDS))


@EVERY_ID
def test_ids_make_the_exported_classes(env_id):
    env_class = ccr_gym.ENV_IDS[env_id]
    env, vector = gymnasium.make(env_id), gymnasium.make_vec(env_id, 2)
    assert type(env.unwrapped) is env_class is getattr(ccr_gym, env_class.__name__)
    assert type(vector.unwrapped) is ccr_gym.ContactVectorEnv
    assert env.unwrapped.task == vector.task == env_class.task_class()


@EVERY_ID
def test_specs_survive_json(env_id):
    env = gymnasium.make(env_id, task={"force": [0.5, 0.6]}, obs_mode="flat", sensing="realistic")
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.task == env.unwrapped.task
    assert again.unwrapped.settings == env.unwrapped.settings
    assert np.array_equal(env.reset(seed=1)[0], again.reset(seed=1)[0])


@EVERY_ID
def test_vector_environments_take_the_kwargs_of_single_ones(env_id):
    kwargs = {"task": {"force": [0.5, 0.6]}, "force_sensor": False}
    env, vector = gymnasium.make(env_id, **kwargs).unwrapped, gymnasium.make_vec(env_id, 2, **kwargs)
    assert (env.task, env.settings) == (vector.task, vector.settings)


def test_classes_need_no_registration():
    env = ccr_gym.PushObstacleEnv(obs_mode="flat")
    env.reset(seed=0)
    assert env.task == ccr_gym.PushObstacle()
    assert ccr_gym.PushObstacleEnv(ccr_gym.LoadCell()).task == ccr_gym.LoadCell()


def test_the_name_of_another_task_is_refused():
    with pytest.raises(ValueError, match="task_name is 'LoadCell'; it must be 'PushObstacle'"):
        gymnasium.make("CCR/PushObstacle-v1", task_name="LoadCell")
    with pytest.raises(ValueError, match="task_name is 'Push'; it must be 'LoadCell' or"):
        ccr_gym.make_vector_env("Push")


@EVERY_ID
def test_help_prints_the_docstring_with_the_numbers_of_the_fields(env_id):
    env_class = ccr_gym.ENV_IDS[env_id]
    text = " ".join(pydoc.plain(pydoc.render_doc(env_class)).replace("|", "").split())
    low, high = env_class.task_class().force
    assert f"{low:.3g}–{high:.3g} EI/L²" in text
    for field in fields(ccr_gym.RewardWeights):
        assert re.search(rf"`{field.name}` −?{field.default:g} ", text)
    assert f"truncated after {gymnasium.spec(env_id).max_episode_steps} steps" in text
