import numpy as np
import pytest

from agents.environment import make_env
from agents.estimation.robot import RobotEstimator
from agents.learning.memory import DECAYS, FINE, KNOWN, MOVES, Memory, MemoryVecEnv
from agents.learning.sb3_adapter import SB3VecEnv
from ccr_gym import ENV_IDS


@pytest.mark.parametrize("sensing", ["ideal", "realistic", "sensorless"])
def test_it_holds_what_is_known_past_errors_and_moves(sensing):
    env = make_env("CCR/PushObstacle-v1", sensing=sensing)
    settings = env.get_wrapper_attr("settings")
    memory, estimator = Memory(env.observation_space, 1, settings), RobotEstimator(settings, 1)
    observation, _ = env.reset(seed=0)
    start = sum(value.size for value in observation.values())
    errors, moves, before = np.zeros(len(DECAYS)), np.zeros(MOVES), None
    for _ in range(30):
        row = memory.update({key: value[None] for key, value in observation.items()})[0]
        known = estimator.update_one(observation)
        assert row.size == memory.size
        told = row[start : start + len(KNOWN)]
        assert told == pytest.approx([float(getattr(known, name)) for name in KNOWN], rel=1e-6)
        motor = float(observation["cable"][0]) * settings.cable_limit_mm / settings.scales.travel_mm
        assert row[start + len(KNOWN)] == pytest.approx(known.cables[0] - motor, abs=1e-6)
        missing = settings.force_span * float(observation["desired_force"][0]) - float(known.force)
        errors += (1 - np.array(DECAYS)) * (np.copysign(np.log1p(abs(missing) / FINE), missing) - errors)
        assert row[start + len(KNOWN) + 1 :][: len(DECAYS)] == pytest.approx(errors, rel=1e-5)
        moves = np.roll(moves, 1)
        moves[0] = 0 if before is None else 28 * (float(observation["cable"][0]) - before)
        assert row[-MOVES:] == pytest.approx(moves, abs=1e-5)
        before = float(observation["cable"][0])
        observation, *_ = env.step(np.full(1, 0.7, np.float32))


def test_the_share_of_an_obstacle_is_in_the_force_and_not_beside_it():
    env = make_env("CCR/BracedPush-v1", sensing="realistic")
    memory = Memory(env.observation_space, 1, env.get_wrapper_attr("settings"))
    observation, _ = env.reset(seed=0)
    row = memory.update({key: value[None] for key, value in observation.items()})[0]
    seen = np.concatenate([value for key, value in observation.items() if key != "share"])
    assert "share" in observation
    assert row.size == memory.size
    assert np.array_equal(row[: seen.size], seen)


@pytest.mark.parametrize("env_id", sorted(ENV_IDS))
def test_vectors_remember_as_single_environments_do(env_id):
    kwargs = {"sensing": "realistic", "split": "train"}
    envs = MemoryVecEnv(SB3VecEnv(env_id, 2, 5, obs_mode="dict", **kwargs))
    env = make_env(env_id, **kwargs)
    settings, generator = env.unwrapped.settings, np.random.default_rng(0)
    alone = Memory(env.observation_space, 1, settings)
    rows, (observation, _) = envs.reset(), env.reset(seed=6)
    assert envs.observation_space.contains(rows[0])
    ends = 0
    for _ in range(140):
        assert np.array_equal(rows[1], alone.update({key: value[None] for key, value in observation.items()})[0])
        actions = generator.uniform(-0.3, 1, (2, *env.action_space.shape)).astype(np.float32)
        rows, _, dones, infos = envs.step(actions)
        observation, _, _, truncated, _ = env.step(actions[1])
        assert dones[1] == truncated
        if truncated:
            ends += 1
            last = alone.update({key: value[None] for key, value in observation.items()})[0]
            assert np.array_equal(infos[1]["terminal_observation"], last)
            alone.reset()
            observation, _ = env.reset()
    assert ends
