"""What controllers refuse, by names that tell what to do."""

import gymnasium
import pytest

from agents import ForceController, HarmonicController, NewtonController, PredictiveController
from agents.benchmark.evaluate import run_episodes
from agents.environment import make_env

EVERY_KIND = pytest.mark.parametrize(
    "make", [ForceController, PredictiveController, HarmonicController, NewtonController, NewtonController.knowing]
)


@EVERY_KIND
def test_acting_before_a_reset_is_refused(make):
    observation, _ = make_env("CCR/PushObstacle-v1").reset(seed=0)
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"call reset\(env\) before act"):
        make().act(observation)


@EVERY_KIND
@pytest.mark.parametrize(
    "env",
    [
        lambda: "CCR/PushObstacle-v1",
        lambda: gymnasium.make("CartPole-v1"),
        lambda: gymnasium.make_vec("CCR/PushObstacle-v1", 2, obs_mode="dict"),
    ],
)
def test_other_environments_are_refused(make, env):
    with pytest.raises(TypeError, match="a single environment of ccr_gym"):
        make().reset(env())


def test_episodes_may_be_longer_than_usual():
    (played,) = run_episodes(ForceController(), "CCR/PushObstacle-v1", 0, 1, max_episode_steps=100)
    assert len(played.error) == 100
    assert played.error[-1] < 1e-3
