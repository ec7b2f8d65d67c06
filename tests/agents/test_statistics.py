import numpy as np
import pytest

from agents.statistics import cvar, iqm, iqm_interval, profile


def test_the_interquartile_mean_is_that_of_the_middle_half():
    assert iqm(np.array([0.0, 1, 2, 3, 4, 5, 6, 1000])) == pytest.approx(3.5)
    assert iqm(np.array([[0.0, 1, 2, 90], [4, 4, 4, 4]])) == pytest.approx([1.5, 4])


def test_the_interval_covers_the_true_mean_as_often_as_it_says():
    generator = np.random.default_rng(1)
    covered = []
    for k in range(120):
        low, high = iqm_interval(list(generator.normal(size=(2, 40))), seed=k)
        covered.append(low < 0 < high)
    assert 0.88 <= np.mean(covered) <= 0.99


def test_strata_are_resampled_alone():
    low, high = iqm_interval([np.zeros(40), np.ones(40)])
    assert low == high == 0.5


def test_the_tail_mean_and_the_profile():
    samples = np.arange(1.0, 101.0)
    assert cvar(samples) == pytest.approx(95.5)
    assert cvar(np.array([1.0, 5.0])) == 5
    assert profile(samples, np.array([0.0, 50.0, 100.0])) == pytest.approx([0, 0.5, 1])
