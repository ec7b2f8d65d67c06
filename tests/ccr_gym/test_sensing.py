"""Imperfections: latency, noise, backlash, unknown friction and rigidity; and the split of scenes."""

import gymnasium
import numpy as np
import pytest

import ccr_gym
from ccr_gym import FORCE_SPAN, Sensing
from ccr_gym.sampling import is_test_draw

EVERY_ID = pytest.mark.parametrize("env_id", sorted(ccr_gym.ENV_IDS))
EXACT = {name: (0.0, 0.0) for name in ("noise", "bias", "backlash", "tendon_loss")} | {"rigidity_ratio": (1.0, 1.0)}


def make(env_id, **kwargs):
    return gymnasium.make(env_id, disable_env_checker=True, **{"obs_mode": "dict", **kwargs})


def play(env, seed=3, steps=40):
    """Return observations and infos of random steps that mostly pull."""
    generator = np.random.default_rng(0)
    record = [env.reset(seed=seed)]
    for _ in range(steps):
        observation, _, _, _, info = env.step(generator.uniform(-0.3, 1, env.action_space.shape).astype(np.float32))
        record.append((observation, info))
    return record


@EVERY_ID
def test_zero_imperfections_are_ideal(env_id):
    ideal = play(make(env_id))
    exact = play(make(env_id, sensing={**EXACT, "latency": [0, 0]}))
    for (observed, info), (other, other_info) in zip(ideal, exact, strict=True):
        assert observed.keys() == other.keys()
        for key, value in observed.items():
            assert other[key] == pytest.approx(value, abs=2e-6), key
        assert other_info["force_true"] == pytest.approx(info["force_true"], abs=1e-9)


@EVERY_ID
def test_delayed_entries_are_those_of_earlier_steps(env_id):
    ideal = play(make(env_id))
    late = play(make(env_id, sensing={**EXACT, "latency": [2, 2]}))
    for k, (seen, _) in enumerate(late):
        for key in ("nodes", "contact", "force_measured", "force_est"):
            assert seen[key] == pytest.approx(ideal[max(k - 2, 0)][0][key], abs=2e-6)
        assert seen["desired_force"] == pytest.approx(ideal[k][0]["desired_force"])
        assert seen["cable"] == pytest.approx(ideal[k][0]["cable"], abs=1e-6)


@EVERY_ID
def test_vector_and_single_environments_agree(env_id):
    kwargs = {"sensing": "realistic", "obs_mode": "flat"}
    ours = gymnasium.make_vec(env_id, 3, vectorization_mode="vector_entry_point", max_episode_steps=9, **kwargs)
    theirs = gymnasium.make_vec(env_id, 3, vectorization_mode="sync", max_episode_steps=9, **kwargs)
    assert np.array_equal(ours.reset(seed=5)[0], theirs.reset(seed=5)[0])
    generator = np.random.default_rng(1)
    for _ in range(40):
        actions = generator.uniform(-0.4, 1, ours.action_space.shape).astype(np.float32)
        our, their = ours.step(actions), theirs.step(actions)
        assert np.array_equal(our[0], their[0])
        assert np.array_equal(our[1], their[1])
        assert np.array_equal(our[4]["force_true"], their[4]["force_true"])


@EVERY_ID
@pytest.mark.parametrize("sensing", ["ideal", "realistic"])
def test_privileged_states_and_probes_agree_with_single_environments(env_id, sensing):
    envs = gymnasium.make_vec(env_id, 3, vectorization_mode="vector_entry_point", sensing=sensing)
    singles, generator = [make(env_id, sensing=sensing).unwrapped for _ in range(3)], np.random.default_rng(1)
    envs.reset(seed=4)
    for i, env in enumerate(singles):
        env.reset(seed=4 + i)
    for _ in range(25):
        state = envs.privileged_state
        for i, env in enumerate(singles):
            for many, one in zip(state, env.privileged_state, strict=True):
                assert np.array_equal(many[i], one)
        actions = generator.uniform(-0.3, 1, envs.action_space.shape).astype(np.float32)
        envs.step(actions)
        for env, action in zip(singles, actions, strict=True):
            env.step(action)
        assert envs.probe(envs.privileged_state.actuated_mm) == pytest.approx(envs.privileged_state.force, abs=1e-6)
        assert singles[0].probe(singles[0].privileged_state.actuated_mm) == pytest.approx(
            singles[0].privileged_state.force, abs=1e-6
        )


def test_backlash_is_taken_up_before_the_cable_moves():
    env = make("CCR/PushObstacle-v1", sensing={**EXACT, "latency": [0, 0], "backlash": [0.05, 0.05]})
    env.reset(seed=0)
    moved = [env.step(np.full(1, action, np.float32))[4]["cable_mm"] for action in (1, 1, -0.4, -0.4, -0.4)]
    assert moved == pytest.approx([0.3, 0.8, 0.8, 0.8, 0.6])
    observation, *_ = env.step(np.zeros(1, np.float32))
    assert 14 * observation["cable"][0] == pytest.approx(0.4)  # the encoder reads the motor


def test_rigidity_scales_forces_and_keeps_shapes():
    soft, stiff = (
        play(make("CCR/PushObstacle-v1", sensing={**EXACT, "latency": [0, 0], "rigidity_ratio": [s, s]}))
        for s in (0.5, 2.0)
    )
    touched = False
    for (observed, info), (other, other_info) in zip(soft, stiff, strict=True):
        assert np.array_equal(observed["nodes"], other["nodes"])
        assert other_info["force_true"] == pytest.approx(4 * info["force_true"])
        assert other_info["force_est"] == pytest.approx(
            4 * info["force_est"], rel=0.01
        )  # the rigidity is learnt, with a prior of 1
        touched |= bool(info["force_true"].any())
    assert touched


def test_noise_and_bias_have_the_requested_magnitudes():
    sensing = {**EXACT, "latency": [0, 0], "noise": [0.02, 0.02], "bias": [0.04, 0.04]}
    env, errors = make("CCR/PushObstacle-v1", sensing=sensing), []
    unit = env.unwrapped.settings.scales.force_n
    for seed in range(20):
        record = play(env, seed, 25)
        seen = np.array([o["force_measured"] * FORCE_SPAN for o, _ in record])
        errors.append(seen - [info["force_true"] / unit for _, info in record])
    errors = np.array(errors)
    assert np.abs(errors.mean(axis=1)) == pytest.approx(np.full((20, 2), 0.04), abs=0.01)
    assert errors.std(axis=1).mean() == pytest.approx(0.02, rel=0.1)


@EVERY_ID
def test_training_and_test_scenes_are_disjoint(env_id):
    scenes = {split: scenes_of(make(env_id, split=split)) for split in ("train", "test", "all")}
    assert not set(scenes["train"]) & set(scenes["test"])
    assert set(scenes["all"]) & set(scenes["train"])


def scenes_of(env):
    """Return the parameters of the scenes of some seeds."""
    found = []
    for seed in range(12):
        env.reset(seed=seed)
        found.append(env.unwrapped.equilibrium.scene.parameters)
    return found


@pytest.mark.parametrize("robot", ["guidewire", "snake-arm"])
def test_the_split_of_a_scene_does_not_depend_on_the_robots_size(robot):
    for split in ("train", "test"):
        scenes = []
        for robot_or_default in (robot, None):
            env = make("CCR/PushObstacle-v1", split=split, robot=robot_or_default, task={"force": (0.1, 0.1)})
            length = env.unwrapped.settings.scales.length_mm
            scenes.append([np.array(parameters) / length for parameters in scenes_of(env)])
        assert sum(np.allclose(one, other) for one, other in zip(*scenes, strict=True)) >= 8


def test_a_fifth_of_the_draws_is_for_tests():
    generator, found = np.random.default_rng(0), 0
    for _ in range(2000):
        before = generator.bit_generator.state
        found += is_test_draw(generator)
        assert generator.bit_generator.state == before
        generator.random()
    assert found == pytest.approx(400, abs=60)


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"sensing": "perfect"}, "sensing is 'perfect'"),
        ({"sensing": {"latency": [1, 9]}}, "latency is"),
        ({"sensing": {"latency": [0.5, 1.5]}}, "whole numbers"),
        ({"sensing": {"noise": [0.2, 0.1]}}, "noise is"),
        ({"sensing": {"rigidity_ratio": [0.0, 1.0]}}, "rigidity_ratio is"),
        ({"split": "validation"}, "split is"),
    ],
)
def test_invalid_ranges_are_refused(kwargs, message):
    with pytest.raises(ValueError, match=message):
        make("CCR/PushObstacle-v1", **kwargs)


def test_realistic_sensing_is_the_default_ranges():
    assert make("CCR/PushObstacle-v1", sensing="realistic").unwrapped.settings.sensors == Sensing()
    assert make("CCR/PushObstacle-v1").unwrapped.settings.sensors is None
