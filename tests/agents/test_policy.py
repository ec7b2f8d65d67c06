import gymnasium
import numpy as np
import pytest

from agents.benchmark.suite import CONTROLLERS, Entry
from agents.learning.pretrained import trained
from agents.policy import set_points
from ccr_gym import AHEAD, FORCE_SPAN


def test_set_points_stay_as_they_are_unless_they_are_previewed():
    now = {"desired_force": np.array([0.3, -0.4])}
    assert set_points(now, 3, FORCE_SPAN) == pytest.approx(np.full(3, 0.5 * FORCE_SPAN))
    previewed = {"desired_force": np.array([0.1]), "desired_ahead": 0.1 + 0.02 * np.array(AHEAD)}
    steps = np.arange(1, max(AHEAD) + 3)
    found = set_points(previewed, len(steps), FORCE_SPAN)
    assert found == pytest.approx(FORCE_SPAN * (0.1 + 0.02 * np.minimum(steps, max(AHEAD))))


@pytest.mark.parametrize("name", [*CONTROLLERS, "PPO"])
def test_flat_observations_are_refused_with_the_mode_that_policies_need(name):
    env_id = "CCR/PushObstacle-v1"
    env = gymnasium.make(env_id, sensing="realistic")
    (policy,) = Entry(name, env_id, "realistic", trained(name, env_id)[:1]).load()
    observation, _ = env.reset(seed=0)
    policy.reset(env)
    with pytest.raises(ValueError, match='obs_mode="dict"'):
        policy.act(observation)
