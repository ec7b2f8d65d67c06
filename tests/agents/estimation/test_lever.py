"""Virtual work of the bent robot, against the forces of the equilibria themselves."""

import gymnasium
import numpy as np
import pytest

from agents import RobotEstimator, search
from agents.estimation.lever import BentLevers
from ccr_gym import EXACT
from solver import Status

TASKS = ("LoadCell", "PushObstacle", "SoftObstacle", "InsertAndPush", "SpatialPush")


def pressed(env_id, count=60, steps=50, **kwargs):
    """Return forces of steady pulls, what the estimator says of them, and where these are, ``(steps, robots)`` each."""
    envs = gymnasium.make_vec(env_id, count, sensing=EXACT, force_sensor=False, obs_mode="dict", **kwargs)
    settings = envs.unwrapped.settings
    observation, _ = envs.reset(seed=3)
    estimator = RobotEstimator(settings, count)
    estimator.update(observation)
    rows = []
    for _ in range(steps):
        observation, _, _, _, info = envs.step((0.7 * search(observation)).astype(np.float32))
        force = np.linalg.norm(info["force_true"], axis=1) / settings.scales.force_n / settings.actuation.sections**2
        converged = info["solver_status"] == Status.CONVERGED
        on = observation["contact"].any(axis=1) & converged & (force > 0.1)
        known = estimator.update(observation).force / settings.actuation.sections**2
        rows.append((force, known, on))
    return (np.array(part) for part in zip(*rows, strict=True))


@pytest.mark.parametrize("task", TASKS)
def test_virtual_work_is_the_force_of_the_bent_robot(task):
    """The set-points end at 2.9 EI/L²; on the load cell virtual work of the free robot overshoots by 24 % at 3–4."""
    force, known, on = pressed(f"CCR/{task}-v1")
    error = np.abs(known - force) / np.maximum(force, 0.1)
    below, above = on & (force < 3), on & (force >= 3) & (force < 6)
    assert np.median(error[below]) < 0.003
    assert np.percentile(error[below], 95) < 0.015
    assert np.percentile(error[above], 95) < 0.06


def test_virtual_work_on_one_of_two_obstacles():
    force, known, on = pressed("CCR/BracedPush-v1")
    error = np.abs(known - force) / np.maximum(force, 0.1)
    assert np.median(error[on & (force < 3)]) < 0.003
    assert np.percentile(error[on & (force < 3)], 90) < 0.04


def test_virtual_work_of_a_robot_of_two_sections():
    force, known, on = pressed("CCR/PushObstacle-v1", robot="snake-arm")
    below = on & (force < 3)
    assert np.median(np.abs(known / np.maximum(force, 0.1) - 1)[below]) < 0.02


def test_robots_that_nothing_touches_keep_their_lever():
    envs = gymnasium.make_vec("CCR/PushObstacle-v1", 3, sensing=EXACT, obs_mode="dict")
    observation, _ = envs.reset(seed=0)
    levers = BentLevers(envs.unwrapped.settings)
    assert np.array_equal(levers.change(np.ones(3), observation, np.ones(3)), np.ones(3))
