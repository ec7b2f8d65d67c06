import numpy as np
import pytest
from gymnasium import spaces

from agents.environment import make_env
from agents.learning.memory import DECAYS, MOVES, Memory, MemoryVecEnv
from agents.learning.sb3_adapter import SB3VecEnv
from ccr_gym import ENV_IDS, Settings


def memory():
    sizes = {"cable": 1, "contact": 2, "desired_force": 1, "force_est": 2, "force_measured": 2, "nodes": 3 * 19}
    space = spaces.Dict({key: spaces.Box(-1.0, 1.0, (size,)) for key, size in sizes.items()})
    settings = Settings()
    return Memory(space, 1, settings), sum(sizes.values())


def seen(cable=0.0, touching=False, measured=(0.0, 0.0), estimate=(0.0, 0.0), desired=0.2):
    rows = {"cable": [cable], "contact": [touching, False], "desired_force": [desired]}
    straight = np.column_stack([np.zeros(19), np.linspace(0, 1, 19), np.zeros(19)]).ravel()
    rows |= {"force_est": estimate, "force_measured": measured, "nodes": straight}
    return {key: np.array([row], np.float32) for key, row in rows.items()}


def test_what_the_sensor_reads_without_contact_is_its_zero():
    remembers, start = memory()
    for reading in ((0.02, 0.04), (0.04, 0.02)):
        row = remembers.update(seen(measured=reading))[0]
        assert row[start + 2 : start + 4] == pytest.approx([0, 0])  # neither ratio nor force
    row = remembers.update(seen(touching=True, measured=(0.03, 0.13), estimate=(0.0, 0.4)))[0]
    assert row[start : start + 4] == pytest.approx([0.03, 0.03, 0.25, 0.1], abs=1e-6)


def test_the_ratio_of_sensor_and_estimate_is_fitted_to_all_readings():
    remembers, start = memory()
    generator = np.random.default_rng(0)
    for _ in range(60):
        size = generator.uniform(0.2, 0.6)
        noisy = (0.0, 0.3 * size + generator.normal(0, 0.01))
        row = remembers.update(seen(touching=True, measured=noisy, estimate=(0.0, size)))[0]
    assert row[start + 2] == pytest.approx(0.3, abs=0.01)
    assert row[start + 3] == pytest.approx(0.3 * size, abs=0.005)


def test_errors_fade_at_their_rates_and_moves_pass_by():
    remembers, start = memory()
    shown = [seen(cable, True, (0.0, force), (0.0, force)) for cable, force in ((0, 0.1), (0.1, 0.2))]
    first, last = (remembers.update(each)[0] for each in shown)
    errors = [row[start + 4 : start + 4 + 2 * len(DECAYS)].reshape(-1, 2) for row in (first, last)]
    fading = np.array(DECAYS)[:, None]
    assert errors[0] == pytest.approx((1 - fading) * errors[0][0])
    assert errors[1] == pytest.approx(fading * errors[0], abs=1e-5)  # there is no error now
    moves, (latency, slack, unseen, behind) = np.split(last[start + 4 + 2 * len(DECAYS) :], [MOVES])
    assert moves == pytest.approx([2.8] + [0] * (MOVES - 1), abs=1e-6)
    assert (latency, unseen, behind) == (pytest.approx(1), pytest.approx(0.175 - slack), pytest.approx(-slack))
    remembers.reset()
    assert np.array_equal(remembers.update(shown[0])[0], first)


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
