import numpy as np
import pytest

from agents.benchmark.evaluate import run_episodes, scores
from agents.controllers.force import ForceController
from agents.controllers.mpc import PredictiveController, plan
from ccr_gym import ENV_IDS


def solve(gain, force, goals, effort=0.0):
    return np.array(plan(len(goals), effort)(p=[gain, force, *goals], lbx=-1.0, ubx=1.0)["x"]).ravel()


def test_the_plan_is_exact_where_moves_suffice_and_full_where_they_do_not():
    assert solve(0.01, 0.05, [0.055, 0.06, 0.06]) == pytest.approx([0.5, 0.5, 0], abs=1e-6)
    assert solve(0.01, 0.05, [0.09] * 3) == pytest.approx([1, 1, 1], abs=1e-6)
    assert solve(0.01, 0.05, [0.0] * 3)[0] == pytest.approx(-1)


def test_the_plan_begins_before_the_set_point_jumps():
    assert solve(0.01, 0.05, [0.05, 0.08, 0.08])[0] > 0.3


def test_effort_makes_it_gentler():
    eager, gentle = (solve(0.01, 0.05, [0.055] * 4, effort)[0] for effort in (0.0, 1.0))
    assert 0 < gentle < eager


@pytest.mark.parametrize("env_id", sorted(env_id for env_id in ENV_IDS if "Paper" not in env_id))
def test_it_regulates_with_realistic_sensing(env_id):
    kwargs = {"sensing": "realistic", "split": "train"}
    planned, integral = (
        scores(policy, env_id, 50, 8, **kwargs) for policy in (PredictiveController(), ForceController.tuned(env_id))
    )
    assert np.median(planned) < np.median(integral) / 2


def test_it_forgets_the_episode_before():
    controller = PredictiveController()
    first, second = (run_episodes(controller, "CCR/PushObstacle-v1", 7, 1, sensing="realistic")[0] for _ in range(2))
    assert np.array_equal(first.force, second.force)
