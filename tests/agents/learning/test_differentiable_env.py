"""Gradients through several steps of an environment, against differences of the same steps played again."""

import gymnasium
import numpy as np
import pytest
import torch

from agents import DifferentiableVectorEnv
from ccr_gym import Sensing

COUNT, STEPS, WINDOW, CHANGE, WAYS = 6, 14, 5, 1e-3, 6
SMOOTH = Sensing(force_resolution=(0.0, 0.0))  # realistic but for the steps of the force sensor


def make(env_id, **kwargs):
    kwargs = {"max_episode_steps": 10**6, "derivatives": True, **kwargs}
    return gymnasium.make_vec(env_id, COUNT, vectorization_mode="vector_entry_point", **kwargs)


def approach(env, observation, generator):
    """Return actions that bring robots into contact, in space towards the obstacle, then more at random."""
    size, slices = env.action_space.shape[1], env.unwrapped.observation_slices
    way = np.full((COUNT, size), 0.9)
    if "obstacle" in slices:
        way = observation.numpy()[:, slices["obstacle"]][:, :2]
        way = way / np.abs(way).max(axis=1, keepdims=True)
    pulls = way * generator.uniform(0.7, 1, (STEPS, COUNT, 1))
    return pulls, generator.uniform(-0.6, 0.6, (WINDOW, COUNT, size))


def play(env, pulls, window):
    """Return what the steps of a window lead to, from the same start."""
    wrapped = DifferentiableVectorEnv(env, torch.float64)
    wrapped.reset(seed=5)
    for pull in pulls:
        wrapped.step(torch.as_tensor(pull))
    wrapped.detach()
    return [wrapped.step(actions) for actions in window]


def losses(env, generator):
    """Return random sums of what steps lead to, one number for each environment; contact flags do not count."""
    columns, space = env.single_observation_space.shape[0], 3 if "obstacle" in env.unwrapped.observation_slices else 2
    force, estimate, observed = (torch.as_tensor(generator.normal(size=size)) for size in (space, space, columns))
    observed[env.unwrapped.observation_slices["contact"]] = 0
    return {
        "force": lambda steps: sum((step.force * force).sum(dim=1) for step in steps),
        "estimate": lambda steps: sum((step.force_est * estimate).sum(dim=1) for step in steps),
        "reward": lambda steps: sum(step.reward for step in steps),
        "observation": lambda steps: sum((step.observation * observed).sum(dim=1) for step in steps),
    }


@pytest.mark.parametrize(
    ("env_id", "sensing"),
    [
        ("CCR/PushObstacle-v1", "ideal"),
        ("CCR/PushObstacle-v1", SMOOTH),
        ("CCR/InsertAndPush-v1", SMOOTH),
        ("CCR/MovingObstacle-v1", SMOOTH),
        ("CCR/SpatialPush-v1", SMOOTH),
        ("CCR/LoadCell-Paper-v1", SMOOTH),
    ],
)
def test_gradients_go_through_latency_and_backlash(env_id, sensing):
    env, generator = make(env_id, sensing=sensing), np.random.default_rng(1)
    pulls, window = approach(env, DifferentiableVectorEnv(env).reset(seed=5), generator)
    ways = [torch.as_tensor(generator.normal(size=window.shape)) for _ in range(WAYS)]
    ends = [[play(env, pulls, torch.as_tensor(window) + side * CHANGE * way) for side in (1, -1)] for way in ways]
    for name, loss in losses(env, generator).items():
        actions = torch.tensor(window, requires_grad=True)
        loss(play(env, pulls, actions)).sum().backward()
        found = np.array([(actions.grad * way).sum(dim=(0, 2)).numpy() for way in ways])
        expected = np.array([((loss(up) - loss(down)) / (2 * CHANGE)).numpy() for up, down in ends])
        errors = np.abs(found - expected) / np.abs(expected).max()
        assert np.abs(expected).max() > 1e-3, name
        # Observations are float32 numbers, and some differences reach beyond the end of a contact or of the backlash.
        assert np.quantile(errors, 0.75) < (2e-3 if name == "observation" else 1e-5), name


def test_the_observations_are_those_of_the_environment():
    env, twin = (make("CCR/PushObstacle-v1", sensing="realistic", max_episode_steps=6) for _ in range(2))
    wrapped = DifferentiableVectorEnv(env)
    assert np.array_equal(wrapped.reset(seed=3).numpy(), twin.reset(seed=3)[0])
    generator = np.random.default_rng(0)
    for _ in range(20):  # with restarts
        actions = generator.uniform(-0.2, 1, (COUNT, 1)).astype(np.float32)
        step, (observation, reward, _, truncated, _) = wrapped.step(torch.as_tensor(actions)), twin.step(actions)
        assert np.array_equal(step.observation.numpy(), observation)
        assert step.reward.numpy() == pytest.approx(reward, rel=1e-6)
        assert np.array_equal(step.truncated, truncated)


def test_no_gradient_goes_through_a_restart():
    env = make("CCR/PushObstacle-v1", max_episode_steps=3)
    wrapped = DifferentiableVectorEnv(env, torch.float64)
    wrapped.reset(seed=3)
    actions = torch.full((6, COUNT, 1), 0.8, dtype=torch.float64, requires_grad=True)
    steps = [wrapped.step(action) for action in actions]
    steps[-1].observation.sum().backward()
    assert not actions.grad[:4].any()  # the fourth step is the restart
    assert actions.grad[4:].all()


def test_other_environments_are_refused():
    with pytest.raises(ValueError, match="derivatives is False"):
        DifferentiableVectorEnv(make("CCR/PushObstacle-v1", derivatives=False))
    with pytest.raises(ValueError, match="obs_mode"):
        DifferentiableVectorEnv(make("CCR/PushObstacle-v1", obs_mode="dict"))
    with pytest.raises(ValueError, match="autoreset_mode"):
        DifferentiableVectorEnv(make("CCR/PushObstacle-v1", autoreset_mode="SameStep"))
    with pytest.raises(TypeError, match="env"):
        DifferentiableVectorEnv(gymnasium.make("CCR/PushObstacle-v1"))


def test_what_no_gradient_can_be_of_is_refused():
    env = make("CCR/PushObstacle-v1")
    env.reset(seed=0)  # by another hand: the wrapper has not seen the first observation
    wrapped = DifferentiableVectorEnv(env)
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        wrapped.step(torch.zeros(COUNT, 1))
    wrapped.reset(seed=0)
    with pytest.raises(TypeError, match="must be a tensor"):
        wrapped.step(np.zeros((COUNT, 1)))
    with pytest.raises(ValueError, match="dtype"):
        DifferentiableVectorEnv(env, torch.int32)
