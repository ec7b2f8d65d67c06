import numpy as np
import pytest

from agents import ForceController, NewtonController
from agents.benchmark.evaluate import run_episodes, scores
from agents.controllers.newton import closest
from agents.tuned import sensing_of
from ccr_gym import ENV_IDS


@pytest.mark.parametrize("env_id", sorted(ENV_IDS))
def test_what_is_hidden_is_enough_to_be_exact(env_id):
    played = run_episodes(NewtonController.knowing(), env_id, seed=50, count=3, sensing=sensing_of(env_id))
    assert np.median([np.median(episode.error[-20:]) for episode in played]) < 0.01


@pytest.mark.parametrize(
    "env_id", ["CCR/PushObstacle-v1", pytest.param("CCR/InsertAndPush-v1", marks=pytest.mark.long)]
)
def test_without_what_is_hidden_newton_is_exact_if_nothing_is_and_far_from_the_oracle_else(env_id):
    (ideal,) = run_episodes(NewtonController(), env_id, seed=50, count=1)
    assert ideal.error[-1] < 1e-6
    kwargs = {"sensing": "realistic", "split": "train"}
    blind, oracle, integral = (
        np.median(scores(policy, env_id, 50, 6, **kwargs))
        for policy in (NewtonController(), NewtonController.knowing(), ForceController.tuned(env_id))
    )
    assert 5 * oracle < blind < 0.7 * integral


@pytest.mark.parametrize("seed", [1_000_000, 1_000_006, 1_000_029, 1_000_050, 1_000_070])
def test_the_oracle_alternates_neither_across_kinks_nor_around_a_least_force(seed):
    kwargs = {"sensing": "realistic", "split": "test"}
    (played,) = run_episodes(NewtonController.knowing(), "CCR/PushObstacle-v1", seed, 1, **kwargs)
    assert played.error[-16:].max() < 1e-6


def test_a_search_finds_the_nearest_zero_or_what_misses_least():
    assert closest(lambda x: (x - 2.25) * (x + 5.5), 10) == pytest.approx(2.25, abs=1e-9)
    assert closest(lambda x: (x - 7.0) * (x + 1.5), 10) == pytest.approx(-1.5, abs=1e-9)
    assert closest(lambda x: 1 + (x - 3) ** 2, 10) == 3
    assert closest(lambda x: 1 + x**2, 10) == 0
    assert closest(lambda x: 1.0 if x < 1.5 else -4.0, 10) == 0  # a jump is no zero


def test_it_needs_its_environment():
    with pytest.raises(ValueError, match=r"call reset\(env\)"):
        NewtonController().reset()
