"""What the estimator refuses, before it takes any of it in."""

import gymnasium
import numpy as np
import pytest

from agents import RobotEstimator
from ccr_gym import ENV_IDS
from solver import PRESETS


def observed(count=3, env_id="CCR/PushObstacle-v1", **kwargs):
    """Return settings and first observations of environments."""
    envs = gymnasium.make_vec(env_id, count, **{"sensing": "realistic", "obs_mode": "dict"} | kwargs)
    return envs.unwrapped.settings, envs.reset(seed=0)[0]


@pytest.mark.parametrize("sensing", ["ideal", "sensorless"])
@pytest.mark.parametrize("env_id", sorted(ENV_IDS))
def test_observations_of_all_environments_are_taken(env_id, sensing):
    settings, observation = observed(2, env_id, sensing=sensing)
    assert np.isfinite(RobotEstimator(settings, 2).update(observation).rigidity).all()


@pytest.mark.parametrize("preset", sorted(PRESETS))
@pytest.mark.parametrize("task", ["PushObstacle", "SpatialPush"])
def test_observations_of_all_robots_are_taken(preset, task):
    settings, observation = observed(2, f"CCR/{task}-v1", robot=preset)
    assert np.isfinite(RobotEstimator(settings, 2).update(observation).rigidity).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda seen: np.concatenate(list(seen.values()), axis=1), "the observation is a ndarray"),
        (lambda seen: None, "the observation is a NoneType"),
        (lambda seen: {key: entry[0] for key, entry in seen.items()}, r"cable has the shape \(1,\)"),
        (lambda seen: {key: entry[:2] for key, entry in seen.items()}, r"must be \(3, 1\)"),
        (lambda seen: {key: entry for key, entry in seen.items() if key != "nodes"}, "no array 'nodes'"),
        (lambda seen: seen | {"tension": np.full((3, 1), np.nan)}, r"tension is \[\[nan\], .*finite numbers"),
        (lambda seen: seen | {"lever": np.full((3, 2), 0.1)}, r"lever has the shape \(3, 2\)"),
        (lambda seen: seen | {"contact": np.zeros((3, 1))}, r"contact has the shape \(3, 1\)"),
    ],
)
def test_other_observations_are_refused_and_nothing_of_them_is_taken_in(change, message):
    settings, observation = observed()
    estimator, untouched = RobotEstimator(settings, 3), RobotEstimator(settings, 3)
    with pytest.raises(ValueError, match=message):
        estimator.update(change(observation))
    for one, other in zip(estimator.update(observation), untouched.update(observation), strict=True):
        assert np.array_equal(one, other)


@pytest.mark.parametrize("index", [[5, 6, 7], [0, 0, 1], 1, "first", [0.5]])
def test_robots_that_are_not_there_are_refused(index):
    settings, observation = observed()
    estimator = RobotEstimator(settings, 3)
    with pytest.raises(ValueError, match="must choose robots from 0 to 2, each once"):
        estimator.update(observation, index)
    with pytest.raises(ValueError, match="must choose robots"):
        estimator.reset(index)


def test_the_observation_of_one_robot_is_no_batch():
    settings, observation = observed(1)
    with pytest.raises(ValueError, match=r"cable has the shape \(1, 1, 1\)"):
        RobotEstimator(settings, 1).update_one(observation)
