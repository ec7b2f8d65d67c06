"""Reward terms of single steps."""

from dataclasses import astuple

import numpy as np
import pytest

from ccr_gym.reward import TERMS, RewardWeights
from solver.common.operations import ARRAYS, NUMBERS
from solver.common.transition_laws import reward_terms

WEIGHTS = astuple(RewardWeights())


def terms(force, desired=0.1, clearance=0.0, effort=0.0):
    error = abs(force - desired) / desired
    return dict(zip(TERMS, reward_terms(WEIGHTS, force, desired, error, clearance, effort, NUMBERS), strict=True))


def test_reward_is_largest_at_the_set_point():
    at = sum(terms(0.1).values())
    assert at == pytest.approx(1.0)
    assert all(sum(terms(force).values()) < at for force in (0.0, 0.09, 0.099, 0.101, 0.11, 0.5))


def test_each_term_measures_what_it_names():
    assert terms(0.12)["overshoot"] == pytest.approx(-0.1)
    assert terms(0.08)["overshoot"] == 0
    assert terms(0.0, clearance=5 / 18)["approach"] == pytest.approx(-0.5)
    assert terms(0.0, clearance=5.0)["approach"] == -1
    assert terms(0.1, clearance=5 / 18)["approach"] == 0
    assert terms(0.1, effort=1.0)["effort"] == pytest.approx(-0.02)
    assert terms(10.0)["force_error"] == -1


def test_weights_scale_their_terms():
    doubled = RewardWeights(force_error=2, accuracy=2, overshoot=1, approach=2, effort=0.04)
    for force in (0.0, 0.05, 0.15):
        once, twice = (
            reward_terms(astuple(weights), force, 0.1, 0.3, 3.0, 0.5, NUMBERS) for weights in (RewardWeights(), doubled)
        )
        assert twice == pytest.approx([2 * term for term in once])


def test_arrays_agree_with_numbers():
    forces = np.array([0.0, 0.08, 0.1, 0.2])
    desired, clearance = np.full(4, 0.1), np.full(4, 3.0)
    errors = np.abs(forces - desired) / desired
    batch = reward_terms(WEIGHTS, forces, desired, errors, clearance, np.zeros(4), ARRAYS)
    for i, force in enumerate(forces.tolist()):
        assert dict(zip(TERMS, (term[i] for term in batch), strict=True)) == terms(force, clearance=3.0)
