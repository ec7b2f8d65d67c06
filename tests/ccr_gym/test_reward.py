import numpy as np
import pytest

from ccr_gym.reward import RewardWeights, reward_terms


def terms(force, desired=0.1, clearance=0.0, touching=True, action=0.0):
    values = (np.float64(force), np.float64(desired), np.float64(clearance), np.bool_(touching), np.float64(action))
    return reward_terms(RewardWeights(), *values)


def test_the_set_point_is_the_best_place():
    at = sum(terms(0.1).values())
    assert at == pytest.approx(1.0)
    assert all(sum(terms(force).values()) < at for force in (0.0, 0.09, 0.099, 0.101, 0.11, 0.5))


def test_each_term_reads_what_it_names():
    assert terms(0.12)["overshoot"] == pytest.approx(-0.1)
    assert terms(0.08)["overshoot"] == 0
    assert terms(0.0, clearance=50.0, touching=False)["approach"] == pytest.approx(-0.5)
    assert terms(0.0, clearance=50.0)["approach"] == 0
    assert terms(0.1, action=-1.0)["effort"] == pytest.approx(-0.02)
    assert terms(10.0)["force_error"] == -1


def test_arrays_give_the_scalars_of_each_entry():
    forces = np.array([0.0, 0.08, 0.1, 0.2])
    batch = reward_terms(RewardWeights(), forces, np.full(4, 0.1), np.zeros(4), np.ones(4, bool), np.zeros(4))
    for i, force in enumerate(forces):
        assert {name: value[i] for name, value in batch.items()} == terms(force)
