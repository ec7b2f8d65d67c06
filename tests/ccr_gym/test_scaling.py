"""The scaling law: an environment of a robot s times as large, with s² times the rigidity, is the same environment."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

import ccr_gym
from solver import PRESETS

EVERY_ID = pytest.mark.parametrize("env_id", sorted(ccr_gym.ENV_IDS))
EVERY_SENSING = pytest.mark.parametrize("sensing", ["ideal", "realistic"])
CLOSE = 1e-5


def scaled(robot, s):
    """Return a robot s times as large."""
    lengths = {name: s * getattr(robot, name) for name in ("length_mm", "offset_mm")}
    if robot.model == "rod":
        offsets = [cable.offset_mm or robot.offset_mm for cable in robot.cables]
        lengths["cables"] = tuple(replace(c, offset_mm=s * a) for c, a in zip(robot.cables, offsets, strict=True))
    if getattr(robot, "length_range_mm", None):
        lengths["length_range_mm"] = tuple(s * length for length in robot.length_range_mm)
    return replace(robot, rigidity=s * s * robot.rigidity, **lengths)


def play(env, seed, steps):
    """Return observations, rewards and statuses of an episode that mostly pulls, row by row."""
    generator = np.random.default_rng(seed)
    record = [(env.reset(seed=seed)[0], 0.0, 0)]
    for _ in range(steps):
        action = np.clip(generator.normal(0.3, 0.6, env.action_space.shape), -1, 1).astype(np.float32)
        observation, reward, _, _, info = env.step(action)
        record.append((observation, reward, info["solver_status"]))
    return tuple(map(np.array, zip(*record, strict=True)))


def compare(env_id, robot, s, sensing, steps, seeds=2):
    """Assert that an environment plays alike with a robot and a scaled one; powers of two keep the bits."""
    envs = [gymnasium.make(env_id, robot=each, sensing=sensing).unwrapped for each in (robot, scaled(robot, s))]
    for seed in range(seeds):
        (seen, rewards, statuses), (seen_s, rewards_s, statuses_s) = (play(env, seed, steps) for env in envs)
        assert np.array_equal(statuses, statuses_s)
        if np.log2(s) % 1 == 0:
            assert np.array_equal(seen, seen_s)
            assert np.array_equal(rewards, rewards_s)
        assert np.abs(seen - seen_s).max() <= CLOSE
        assert np.abs(rewards - rewards_s).max() <= CLOSE


@EVERY_ID
@EVERY_SENSING
@pytest.mark.parametrize("s", [0.1, 10, 0.25])
def test_episodes_do_not_depend_on_the_size_of_the_robot(many, env_id, sensing, s):
    compare(env_id, gymnasium.make(env_id).unwrapped.settings.robot, s, sensing, 64, many(1, 2))


@pytest.mark.parametrize("preset", sorted(PRESETS))
@pytest.mark.parametrize("task", ["PushObstacle", "SpatialPush"])
def test_nor_do_those_of_several_sections(preset, task):
    env_id = f"CCR/{task}-v1"
    compare(env_id, gymnasium.make(env_id, robot=preset).unwrapped.settings.robot, 0.1, "ideal", 24)


@pytest.mark.parametrize("preset", ["rao_2021", "snake-arm"])
@pytest.mark.parametrize("s", [0.1, 10])
def test_nor_does_which_of_two_pulled_cables_yields_to_an_obstacle_that_moves(preset, s):
    def tensions(robot):
        env = gymnasium.make("CCR/MovingObstacle-v1", robot=robot, sensing="realistic")
        generator = np.random.default_rng(4)
        mean = generator.uniform(0, 0.8, env.action_space.shape)
        env.reset(seed=4)
        actions = (np.clip(mean + generator.normal(0, 0.5, mean.shape), -1, 1) for _ in range(60))
        return np.array([env.step(action.astype(np.float32))[-1]["tension"] for action in actions])

    robot = gymnasium.make("CCR/MovingObstacle-v1", robot=preset).unwrapped.settings.robot
    here, there = tensions(robot), tensions(scaled(robot, s))
    assert here.max() == pytest.approx(robot.max_tension)  # a motor is at its limit
    assert np.abs(here - there).max() <= CLOSE * robot.max_tension
