"""An obstacle that breathes: where it is at every step, and what the robot feels."""

import gymnasium
import numpy as np
import pytest

from ccr_gym import MovingObstacle
from ccr_gym.task import PROFILE_STEPS
from solver import Circle, Robot, Status

ID = "CCR/MovingObstacle-v1"


def motion_of(seed=0, **fields):
    """Return the motion of a sampled obstacle [mm]."""
    return MovingObstacle(**fields).sample(Robot.prototype(), np.random.default_rng(seed)).motion


def test_breaths_have_the_depth_and_period_that_were_asked_for():
    for seed in range(20):
        moved = np.linalg.norm(motion_of(seed, depth=(0.01, 0.01), period=(20, 20), variation=(0, 0)), axis=1)
        assert moved[0] == pytest.approx(0, abs=1e-9)
        assert moved.max() == pytest.approx(1.8)
        assert moved[:120] == pytest.approx(np.tile(1.8 * np.sin(np.pi * np.arange(20) / 20) ** 4, 6), abs=1e-9)


def test_single_breaths_deviate_within_their_bounds():
    deepest, fields = [], {"depth": (0.01, 0.01), "period": (16, 16), "variation": (0.25, 0.15)}
    for seed in range(20):
        moved = np.linalg.norm(motion_of(seed, **fields), axis=1)
        inner = moved[1:-1]
        deepest += inner[(inner > moved[:-2]) & (inner >= moved[2:]) & (inner > 0.5)].tolist()
    assert 0.9 * 1.8 * 0.75 <= min(deepest) < 1.8 * 0.9
    assert 1.8 * 1.1 < max(deepest) <= 1.8 * 1.25


def test_a_drift_ends_where_it_was_asked_to():
    motion = motion_of(depth=(0, 0), drift=(0.05, 0.05))
    assert np.linalg.norm(motion[-1]) == pytest.approx(9 * (PROFILE_STEPS - 1) / PROFILE_STEPS)
    steps = np.diff(motion, axis=0)
    assert np.abs(steps - steps[0]).max() < 1e-12


def test_info_says_how_far_the_obstacle_has_moved():
    env = gymnasium.make(ID).unwrapped
    _, info = env.reset(seed=3)
    assert not info["obstacle_mm"].any()
    start = env.equilibrium.scene.obstacles[0]
    furthest = 0.0
    for _ in range(PROFILE_STEPS):
        *_, info = env.step(np.zeros(1, np.float32))
        now = env.equilibrium.scene.obstacles[0]
        assert info["obstacle_mm"] == pytest.approx(np.subtract(now.center, start.center), abs=1e-12)
        assert now.radius == start.radius
        furthest = max(furthest, np.linalg.norm(info["obstacle_mm"]))
    assert 0.7 <= furthest <= 2.5


def test_a_resting_robot_feels_the_obstacle_breathe():
    env = gymnasium.make(ID, task={"depth": (0.011, 0.011), "variation": (0, 0)}).unwrapped
    _, info = env.reset(seed=0)
    while np.linalg.norm(info["force_true"]) < 0.1:
        *_, info = env.step(np.ones(1, np.float32))
    forces = []
    for _ in range(80):
        *_, info = env.step(np.zeros(1, np.float32))
        forces.append(np.linalg.norm(info["force_true"]))
        assert info["solver_status"] in (Status.CONVERGED, Status.SNAPPED, Status.STALLED)
    assert max(forces) - min(forces) > 0.01


def test_a_given_scene_stays_where_it_is():
    env = gymnasium.make(ID).unwrapped
    env.reset(options={"scene": [Circle(center=(44, 104), radius=15)], "desired_force": 0.2})
    for _ in range(20):
        *_, info = env.step(np.ones(1, np.float32))
    assert not info["obstacle_mm"].any()


@pytest.mark.parametrize(
    "task", [{"variation": (1.0, 0)}, {"variation": 0.2}, {"depth": (0, 1)}, {"period": (1, 20)}, {"drift": (-0.1, 0)}]
)
def test_impossible_motions_are_refused(task):
    with pytest.raises(ValueError, match=next(iter(task))):
        gymnasium.make(ID, task=task)
