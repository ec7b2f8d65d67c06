"""Every preset plays every task with no argument but its name."""

import gymnasium
import numpy as np
import pytest

import ccr_gym
from solver import PRESETS, Status
from solver.spatial import SpatialRobot

EVERY_ID = pytest.mark.parametrize("env_id", sorted(ccr_gym.ENV_IDS))
EVERY_PRESET = pytest.mark.parametrize("preset", sorted(PRESETS))


@EVERY_ID
@EVERY_PRESET
@pytest.mark.parametrize("sensing", ["ideal", "realistic"])
def test_a_preset_plays_a_task_by_its_name(env_id, preset, sensing):
    env = gymnasium.make(env_id, robot=preset.replace("_", "-"), sensing=sensing)
    robot, columns = env.unwrapped.settings.robot, env.unwrapped.observation_slices
    assert robot.length_mm == PRESETS[preset].length_mm
    env.action_space.seed(0)
    for seed in range(2):
        env.reset(seed=seed)
        for _ in range(12):
            observation, reward, _, _, info = env.step(env.action_space.sample())
            assert env.observation_space.contains(observation)
            assert np.isfinite(reward)
            assert info["solver_status"] != Status.GAVE_UP
    used = observation[columns["nodes"]]
    assert np.abs(used).max() > 0.8  # the straight robot is as long as the scale


@EVERY_PRESET
def test_each_section_has_an_action_of_its_own(preset):
    sections = PRESETS[preset].sections
    plane, space = (gymnasium.make(f"CCR/{task}-v1", robot=preset) for task in ("PushObstacle", "SpatialPush"))
    assert plane.action_space.shape == (sections,)
    assert space.action_space.shape == (2 * sections,)
    opposed = PRESETS[preset].cables > 0
    low = plane.unwrapped.action_spec.low_mm
    assert (low < 0).all() if opposed else (low == 0).all()


def test_a_command_bends_its_section_alone():
    env = gymnasium.make("CCR/PushObstacle-v1", robot="snake-arm").unwrapped
    env.reset(seed=0)
    for _ in range(8):
        env.step(np.array([0.0, -1.0], np.float32))
    angles = env.equilibrium.nodes[:, 2]
    assert abs(angles[20]) < 0.02
    assert angles[-1] > 0.2  # towards −x


def test_the_papers_model_takes_a_presets_sizes():
    robot = gymnasium.make("CCR/SpatialPush-Paper-v1", robot="guidewire").unwrapped.settings.robot
    assert (robot.model, robot.length_mm, len(robot.cables)) == ("paper", 20.0, 2)


def test_a_robot_in_space_needs_no_opposed_cables():
    robot = SpatialRobot.prototype()  # cables at 0° and 90° only
    env = gymnasium.make("CCR/SpatialPush-v1", robot=robot).unwrapped
    assert (env.action_spec.low_mm == 0).all()
    for seed in range(3):
        env.reset(seed=seed)
        x, y, _ = env.equilibrium.scene.obstacles[0].extent.center
        assert x > -20
        assert y > -20


def test_tensions_of_two_sections_stay_within_their_scale():
    """Even where motors are at their limit and the robot is twice as stiff as it is thought to be."""
    env = gymnasium.make("CCR/PushObstacle-v1", robot="neuroendoscope", sensing={"rigidity_ratio": (2, 2)}).unwrapped
    env.reset(seed=0)
    steps = [env.step(np.ones(2, np.float32)) for _ in range(32)]
    tensions = np.array([observation[env.observation_slices["tension"]] for observation, *_ in steps])
    assert steps[-1][-1]["solver_status"] == Status.STALLED
    assert 0.5 < tensions.max() < 1
