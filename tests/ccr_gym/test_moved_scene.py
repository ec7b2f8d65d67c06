"""Obstacles and set-points that are moved within an episode, as by a user's hand."""

import gymnasium
import numpy as np
import pytest

import ccr_gym  # noqa: F401 - registers the ids
from solver import Circle, Solver


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
