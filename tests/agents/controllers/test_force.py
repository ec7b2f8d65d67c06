import numpy as np
import pytest

from agents.benchmark.evaluate import run_episodes
from agents.controllers.force import ForceController
from agents.environment import make_env
from ccr_gym import ENV_IDS


@pytest.mark.parametrize("env_id", sorted(ENV_IDS))
@pytest.mark.parametrize("kind", [ForceController.tuned, ForceController.proportional_only])
def test_with_ideal_sensing_it_reaches_the_set_point(env_id, kind):
    last = np.array([episode.error[-1] for episode in run_episodes(kind(env_id), env_id, seed=50, count=10)])
    median, share = 0.01, 0.8
    if "Track" in env_id:  # a set-point that it follows with a delay
        median, share = 0.15, 0.15
    elif "Moving" in env_id:  # an obstacle that does not wait for it
        median, share = 0.02, 0.6
    assert np.median(last) < median
    assert (last <= 0.05).mean() >= share


def test_it_searches_until_something_touches_and_forgets():
    env, controller = make_env("CCR/PushObstacle-v1"), ForceController()
    observation, _ = env.reset(seed=0)
    controller.reset(env)

    def seen(force, *, touching=True):
        sensor = np.array([0.0, force], np.float32)
        return {**observation, "force_measured": sensor, "contact": np.full_like(observation["contact"], touching)}

    goal = float(observation["desired_force"][0])
    assert controller.act(seen(0.0, touching=False)) == 1
    first = controller.act(seen(goal - 0.02))
    assert 0 < first < 1
    assert controller.act(seen(goal - 0.04)) > 2 * first
    controller.reset(env)
    assert controller.act(seen(goal - 0.02)) == first
    assert controller.act(seen(goal + 1.0)) == -1


def test_it_needs_its_environment():
    with pytest.raises(ValueError, match=r"call reset\(env\)"):
        ForceController().reset()


@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/LoadCell-v1"])
def test_without_a_force_sensor_it_regulates_what_it_knows(env_id):
    kwargs = {"sensing": "sensorless", "split": "train"}
    played = run_episodes(ForceController.tuned(env_id, "sensorless"), env_id, seed=50, count=12, **kwargs)
    assert np.median([np.median(episode.error[-16:]) for episode in played]) < 0.15


def test_the_same_episodes_give_the_same_numbers():
    first, second = (run_episodes(ForceController(), "CCR/PushObstacle-v1", seed=9, count=2) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        assert np.array_equal(a.force, b.force)
        assert np.array_equal(a.estimated, b.estimated)
        assert a.statuses == b.statuses
