import numpy as np
import pytest

from agents.benchmark.statistics import cvar, iqm, iqm_interval, profile


def test_the_interquartile_mean_is_that_of_the_middle_half():
    assert iqm(np.array([0.0, 1, 2, 3, 4, 5, 6, 1000])) == pytest.approx(3.5)
    assert iqm(np.array([[0.0, 1, 2, 90], [4, 4, 4, 4]])) == pytest.approx([1.5, 4])


def test_the_interval_covers_the_true_mean_as_often_as_it_says():
    generator = np.random.default_rng(1)
    covered = []
    for k in range(120):
        seeds, scenes = 0.3 * generator.normal(size=(5, 1)), generator.normal(size=40)
        low, high = iqm_interval(seeds + scenes + 0.3 * generator.normal(size=(5, 40)), seed=k)
        covered.append(low < 0 < high)
    assert 0.88 <= np.mean(covered) <= 0.99


def test_scenes_that_all_seeds_play_are_no_more_than_those_of_one():
    scenes = np.random.default_rng(2).normal(size=(1, 60))
    one, five = (np.subtract(*iqm_interval(np.repeat(scenes, count, axis=0))) for count in (1, 5))
    assert five == pytest.approx(one, rel=0.1)


def test_seeds_that_differ_widen_the_interval_and_single_ones_are_taken():
    low, high = iqm_interval(np.arange(5.0)[:, None] + np.zeros(40))
    assert low < 1.5 < 2.5 < high
    assert iqm_interval(np.array([[3.0]])) == (3, 3)


def test_the_tail_mean_and_the_profile():
    samples = np.arange(1.0, 101.0)
    assert cvar(samples) == pytest.approx(95.5)
    assert cvar(np.array([1.0, 5.0])) == 5
    assert profile(samples, np.array([0.0, 50.0, 100.0])) == pytest.approx([0, 0.5, 1])
