import numpy as np
import pytest

from agents.evaluate import run_episodes, summarize
from agents.policy import ForceController, NewtonController
from ccr_gym import ENV_IDS


@pytest.mark.parametrize("env_id", sorted(ENV_IDS))
@pytest.mark.parametrize(("policy", "count"), [(ForceController(), 20), (NewtonController(), 2)], ids=("PI", "Newton"))
def test_classical_controllers_reach_the_set_point(env_id, policy, count):
    summary = summarize(policy.name, run_episodes(policy, env_id, seed=50, count=count))
    assert summary.median_error < 0.01
    assert summary.success >= 0.95
    assert summary.contact_losses == 0


def test_it_searches_until_something_touches_and_forgets():
    controller = ForceController()
    seen = {"desired_force": np.array([0.3], np.float32)}
    free = {**seen, "contact": np.zeros(38, np.float32), "force_error": np.array([0.2], np.float32)}
    touching = {**seen, "contact": np.ones(38, np.float32), "force_error": np.array([0.02], np.float32)}
    assert controller.act(free) == 1
    first = controller.act(touching)
    assert 0 < first < 1
    assert controller.act({**touching, "force_error": np.array([0.04], np.float32)}) > 2 * first
    controller.reset()
    assert controller.act(touching) == first
    assert controller.act({**touching, "force_error": np.array([-1.0], np.float32)}) == -1


def test_the_same_episodes_give_the_same_numbers():
    first, second = (run_episodes(ForceController(), "CCR/PushObstacle-v0", seed=9, count=2) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        assert np.array_equal(a.true, b.true)
        assert np.array_equal(a.estimated, b.estimated)
        assert a.statuses == b.statuses
