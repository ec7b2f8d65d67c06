"""Obstacles and set-points that are moved within an episode, as by a user's hand."""

from dataclasses import asdict, replace

import gymnasium
import numpy as np
import pytest

from ccr_gym import EXACT
from ccr_gym.scales import TENSION_SPAN
from solver import Circle, Robot, Solver


@pytest.mark.parametrize("sensing", ["ideal", "realistic"])
def test_moved_obstacles_are_those_of_the_solver(sensing):
    env = gymnasium.make("CCR/PushObstacle-v1", sensing=sensing).unwrapped
    env.reset(seed=0, options={"scene": [Circle(center=(44, 104), radius=15)], "desired_force": 0.2})
    start = env.equilibrium
    scene = [Circle(center=(20, 104), radius=17)]
    assert env.move_obstacles(scene).obstacles == tuple(scene)
    expected = Solver(start.robot, start.scene).step(start, start.cable_mm, scene=env.equilibrium.scene)
    assert env.equilibrium.nodes == pytest.approx(expected.nodes, abs=1e-12)
    *_, info = env.step(np.zeros(1, np.float32))
    assert np.linalg.norm(info["force_true"]) > 0


def test_a_scene_of_other_obstacles_is_refused():
    env = gymnasium.make("CCR/PushObstacle-v1").unwrapped
    env.reset(seed=0)
    before = env.equilibrium.scene
    with pytest.raises(ValueError, match="must keep its 1"):
        env.move_obstacles([])
    assert env.equilibrium.scene == before


def test_a_moving_obstacle_goes_on_from_where_it_was_put():
    env = gymnasium.make("CCR/MovingObstacle-v1").unwrapped
    env.reset(seed=3)
    for _ in range(10):
        env.step(np.zeros(1, np.float32))
    (obstacle,) = env.equilibrium.scene
    env.move_obstacles([obstacle.shifted((5.0, 0.0))])
    env.step(np.zeros(1, np.float32))
    moved = np.subtract(env.equilibrium.scene.obstacles[0].center, obstacle.center)
    assert moved == pytest.approx([5.0, 0.0], abs=0.5)


def test_the_set_point_can_be_changed():
    env = gymnasium.make("CCR/PushObstacle-v1").unwrapped
    env.reset(seed=0)
    env.set_desired_force(0.123)
    *_, info = env.step(np.zeros(1, np.float32))
    assert info["desired_force"] == pytest.approx(0.123)
    with pytest.raises(ValueError, match="force_n is -1"):
        env.set_desired_force(-1.0)


def test_a_load_cell_reads_that_an_obstacle_has_pulled_a_cable_out():
    """A robot at the limit of its motor gives way: its cable moves out, though its motor stays."""
    loss, robot = 0.2, replace(Robot.prototype(), max_tension=6.0)
    sensing = asdict(EXACT) | {"tendon_loss": (loss, loss)}
    env = gymnasium.make("CCR/PushObstacle-v1", sensing=sensing, robot=robot, obs_mode="dict").unwrapped
    circle = Circle(center=(30.0, 90.0), radius=15.0)
    env.reset(seed=0, options={"scene": [circle], "desired_force": 0.2})
    for _ in range(30):
        pulled, *_, info = env.step(np.ones(1, np.float32))
    unit = TENSION_SPAN * env.settings.scales.tension_n
    assert pulled["tension"] * unit == pytest.approx(info["tension"] / (1 - loss), rel=1e-5)
    env.move_obstacles([circle.shifted((-3.0, 0.0))])
    assert env.equilibrium.cable_mm < info["cable_mm"] - 0.1
    given_way, *_, info = env.step(np.zeros(1, np.float32))
    assert given_way["tension"] * unit == pytest.approx(info["tension"] * (1 - loss), rel=1e-5)


def test_the_known_scene_is_the_one_that_an_obstacle_was_moved_to():
    """Also where the nominal robot, whose cable is at the encoder, cannot give way as the robot does."""
    for seed in range(6):
        env = gymnasium.make("CCR/PushObstacle-v1", sensing="realistic", obs_mode="dict").unwrapped
        env.reset(seed=seed)
        for _ in range(20):
            env.step(np.ones(1, np.float32))
        now = env.move_obstacles([env.equilibrium.scene.obstacles[0].shifted((-25.0, 0.0))])
        assert env.get_state().episodes.model.scenes == (now,)
        observation, *_ = env.step(np.zeros(1, np.float32))
        assert observation["contact"].any()
        assert env.equilibrium.contact.any()
