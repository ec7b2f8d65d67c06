"""Noise and constant errors against the distributions that they are said to have."""

from dataclasses import asdict

import gymnasium
import numpy as np
import pytest

from ccr_gym import FORCE_SPAN, Scales, Sensing
from ccr_gym.noise import TABLE_SIZE, correlated, draw_start, noise_table
from ccr_gym.scales import TENSION_SPAN
from ccr_gym.sensing import EXACT, NUMBERS, Body, ImperfectionSampler
from solver import Robot

RHO = 0.8
SIZES = {"tension_noise": 0.01, "force_noise": 0.05, "angle_noise": 0.0105, "place_noise": 0.002}
BOTH = pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/SpatialPush-v1"])


def make_vec(env_id, count, **sensing):
    kwargs = {"sensing": asdict(EXACT) | {name: [size, size] for name, size in sensing.items()}, "obs_mode": "dict"}
    return gymnasium.make_vec(env_id, count, vectorization_mode="vector_entry_point", max_episode_steps=10**6, **kwargs)


def unlike_exact(env_id, count, steps, **sensing):
    """Return how observations differ from exact ones, ``(steps, count, k)`` each.

    All are bent a little, so that no place is cut off at the bounds, as that of a straight tip is; those that touch
    something then are left out.
    """
    noisy, exact = bent(make_vec(env_id, count, **sensing), steps), bent(make_vec(env_id, count), 1)[0]
    free = ~exact["contact"].any(axis=1)
    assert free.sum() > 0.6 * count
    keys = [key for key in ("tension", "force_measured", "nodes", "frames") if key in exact]
    return {key: np.array([(o[key].astype(float) - exact[key])[free] for o in noisy]) for key in keys}


def bent(env, steps):
    """Return observations of environments that hold still after four pulls."""
    env.reset(seed=1)
    action = np.zeros(env.action_space.shape, np.float32)
    action[:, 0] = 1.0
    for _ in range(4):
        last = env.step(action)[0]
    return [last, *(env.step(0 * action)[0] for _ in range(steps - 1))]


def in_units(env_id, errors):
    """Return the errors of each entry over their stated sizes, ``(steps, count, k)``, without the base."""
    nodes = errors["nodes"].reshape(*errors["nodes"].shape[:2], -1, 3)[:, :, 1:]
    entries = [
        errors["tension"] * TENSION_SPAN / SIZES["tension_noise"],
        errors["force_measured"] * FORCE_SPAN / SIZES["force_noise"],
    ]
    if "Spatial" in env_id:
        return [*entries, (nodes / SIZES["place_noise"]).reshape(*nodes.shape[:2], -1)]
    places, angles = nodes[..., :2] / SIZES["place_noise"], nodes[..., 2] * np.pi / SIZES["angle_noise"]
    return [*entries, places.reshape(*nodes.shape[:2], -1), angles]


@BOTH
def test_the_noise_of_a_step_is_white_and_of_the_stated_size(env_id):
    steps = 2000
    errors = np.concatenate(in_units(env_id, unlike_exact(env_id, 1, steps, **SIZES)), axis=-1)[:, 0]
    channels = errors.shape[1]
    assert errors.mean(axis=0) == pytest.approx(np.zeros(channels), abs=5 / np.sqrt(steps))
    assert errors.std(axis=0) == pytest.approx(np.ones(channels), abs=5 / np.sqrt(2 * steps))
    assert errors.std() == pytest.approx(1, abs=5 / np.sqrt(2 * errors.size))
    for lag in range(1, 17):  # the autocorrelation of all channels together, and of each
        each = (errors[lag:] * errors[:-lag]).mean(axis=0)
        assert each == pytest.approx(np.zeros(channels), abs=5.5 / np.sqrt(steps - lag))
        assert each.mean() == pytest.approx(0, abs=5 / np.sqrt(errors.size))
    power = (np.abs(np.fft.rfft(errors, axis=0)[1:-1]) ** 2 / steps).mean(axis=1)
    for band in np.array_split(power, 8):
        assert band.mean() == pytest.approx(1, abs=5 / np.sqrt(len(band) * channels))
    between = errors.T @ errors / steps - np.diag((errors**2).mean(axis=0))
    assert np.abs(between).max() < 6 / np.sqrt(steps)  # from sensor to sensor


@BOTH
def test_constant_errors_are_correlated_along_the_robot(env_id):
    size = {"angle_error": 0.0087, "place_error": 0.002}
    errors = unlike_exact(env_id, 400, 2, **size)
    count = errors["nodes"].shape[1]
    assert np.abs(errors["nodes"][1] - errors["nodes"][0]).max() < 1e-6  # constant
    nodes = errors["nodes"][0].reshape(count, -1, 3)
    assert not nodes[:, 0].any()  # the base is known
    kinds = [nodes[:, 1:, k] / size["place_error"] for k in range(2)]
    if "Spatial" in env_id:
        kinds.append(nodes[:, 1:, 2] / size["place_error"])
    else:
        kinds.append(nodes[:, 1:, 2] * np.pi / size["angle_error"])
    disks = np.arange(nodes.shape[1] - 1)
    expected = RHO ** np.abs(disks[:, None] - disks)
    for kind in kinds:
        assert kind.T @ kind / count == pytest.approx(expected, abs=5.5 * np.sqrt(2 / count))
    pooled = np.mean([kind.T @ kind / count for kind in kinds], axis=0)
    assert pooled == pytest.approx(expected, abs=5.5 * np.sqrt(2 / count / len(kinds)))
    for one, other in ((0, 1), (1, 2), (0, 2)):
        between = (kinds[one] * kinds[other]).mean()
        assert between == pytest.approx(0, abs=5 * np.sqrt((1 + RHO**2) / (1 - RHO**2) / kinds[0].size))


def test_axes_in_space_turn_by_the_error_and_stay_of_unit_length():
    count, size = 100, 0.0105
    env, exact = (make_vec("CCR/SpatialPush-v1", count, angle_noise=s, place_noise=0.0) for s in (size, 0.0))
    turned = []
    for seed in range(4):
        seen, true = (e.reset(seed=seed)[0]["frames"].reshape(count, -1, 2, 3).astype(float) for e in (env, exact))
        assert np.linalg.norm(seen, axis=-1) == pytest.approx(np.ones(seen.shape[:-1]), abs=2e-7)
        assert np.array_equal(seen[:, 0], true[:, 0])  # the base
        off = (seen - true)[:, 1:]
        turned.append(off - (off * true[:, 1:]).sum(axis=-1, keepdims=True) * true[:, 1:])
        right = (seen[..., 0, :] * seen[..., 1, :]).sum(axis=-1)
        assert np.abs(right).max() < 25 * size**2  # the two are turned alike, to first order
    turned = np.array(turned)
    per_axis = (turned**2).sum(axis=-1) / 2  # two of three components turn an axis
    assert np.sqrt(per_axis.mean()) == pytest.approx(size, rel=0.03)


@BOTH
def test_the_noise_of_environments_and_of_episodes_is_uncorrelated(env_id):
    errors = np.concatenate(in_units(env_id, unlike_exact(env_id, 40, 60, **SIZES)), axis=-1)
    rows = np.moveaxis(errors, 1, 0).reshape(errors.shape[1], -1)
    count = len(rows)
    correlations = rows @ rows.T / rows.shape[1]
    assert np.diag(correlations) == pytest.approx(np.ones(count), abs=6 * np.sqrt(2 / rows.shape[1]))
    between = correlations[np.triu_indices(count, 1)]
    assert np.abs(between).max() < 5 / np.sqrt(rows.shape[1])
    assert between.std() == pytest.approx(1 / np.sqrt(rows.shape[1]), rel=0.25)
    assert between.mean() == pytest.approx(0, abs=5 / np.sqrt(between.size * rows.shape[1]))


def test_successive_episodes_have_noise_of_their_own():
    env, read = make_vec("CCR/PushObstacle-v1", 40, force_noise=0.05), []
    for _ in range(30):
        read.append(env.reset(seed=0 if not read else None)[0]["force_measured"] * FORCE_SPAN / 0.05)
    read = np.array(read, float)
    assert read.std() == pytest.approx(1, abs=5 / np.sqrt(2 * read.size))
    assert (read[1:] * read[:-1]).mean() == pytest.approx(0, abs=5 / np.sqrt(read.size))
    assert (read[:, 1:] * read[:, :-1]).mean() == pytest.approx(0, abs=5 / np.sqrt(read.size))


def test_the_table_is_of_normal_numbers_that_episodes_begin_anywhere_in():
    table = noise_table()
    assert table.shape == (TABLE_SIZE,)
    for power, moment in ((1, 0), (2, 1), (3, 0), (4, 3)):
        assert (table**power).mean() == pytest.approx(moment, abs=5 * np.sqrt((96 if power == 4 else 15) / TABLE_SIZE))
    starts = [draw_start(np.random.default_rng(seed)) for seed in range(400)]
    assert uniform(np.array(starts) / TABLE_SIZE)


def test_noise_along_a_robot_is_autoregressive_and_stationary():
    generator = np.random.default_rng(0)
    noise = correlated([generator] * 20000, 8, 2)
    expected = RHO ** np.abs(np.arange(8)[:, None] - np.arange(8))
    for k in range(2):
        assert noise[..., k].T @ noise[..., k] / len(noise) == pytest.approx(expected, abs=0.06)
    assert noise[..., 0].T @ noise[..., 1] / len(noise) == pytest.approx(np.zeros((8, 8)), abs=0.05)
    fresh = (noise[:, 1:] - RHO * noise[:, :-1]) / np.sqrt(1 - RHO**2)
    assert (fresh[:, 1:] * fresh[:, :-1]).mean() == pytest.approx(0, abs=0.015)


def uniform(numbers):
    """Return whether numbers are distributed as those from 0 to 1 are, by Kolmogorov and Smirnov at 1e-5."""
    ranked, count = np.sort(numbers), len(numbers)
    steps = np.arange(count + 1) / count
    distance = max((steps[1:] - ranked).max(), (ranked - steps[:-1]).max())
    return bool(ranked[0] >= 0 and ranked[-1] <= 1 and distance < 2.5 / np.sqrt(count))


def test_imperfections_are_uniform_in_their_ranges_and_independent():
    scales, body, generator = Scales.of(Robot.prototype()), Body(2, 1, 19, 1), np.random.default_rng(3)
    ranges = {**asdict(Sensing()), "angle_noise": (0.005, 0.01), "place_noise": (0.001, 0.003)}
    sampled = ImperfectionSampler(Sensing(**ranges), scales, body).sample([generator] * 4000)
    columns = {**sampled._asdict(), **{name: sampled.number(name) for name in NUMBERS}}
    numbers = {
        "backlash": columns["backlash_mm"] / scales.travel_mm,
        "tendon_loss": columns["tendon_loss"],
        "tension_noise": columns["tension_noise"] / scales.tension_n,
        "tension_zero": np.abs(columns["tension_zero"][:, 0]) / scales.tension_n,
        "force_noise": columns["force_noise"] / scales.force_n,
        "force_bias": np.abs(columns["force_bias"][:, 1]) / scales.force_n,
        "force_resolution": columns["force_resolution"] / scales.force_n,
        "place_noise": columns["pose_noise"][:, 0] / scales.length_mm,
        "angle_noise": columns["pose_noise"][:, 2],
    }
    parts = {name: (n - ranges[name][0]) / (ranges[name][1] - ranges[name][0]) for name, n in numbers.items()}
    low, high = np.log(ranges["rigidity_ratio"])
    parts["rigidity_ratio"] = (np.log(columns["rigidity_ratio"]) - low) / (high - low)  # as often 1/r as r
    for name, part in parts.items():
        assert uniform(part), name
    assert np.bincount(columns["latency"].astype(int)) / 4000 == pytest.approx([0, *4 * [0.25]], abs=0.035)
    rows = np.array([*parts.values(), columns["latency"], np.sign(columns["tension_zero"][:, 0])])
    between = np.corrcoef(rows) - np.eye(len(rows))
    assert np.abs(between).max() < 5 / np.sqrt(4000)


def test_signs_of_constant_errors_are_even_and_independent():
    scales, body, generator = Scales.of(Robot.prototype()), Body(3, 4, 19, 3), np.random.default_rng(4)
    sampled = ImperfectionSampler(Sensing(), scales, body).sample([generator] * 3000)
    signs = np.sign(np.column_stack([sampled.tension_zero, sampled.force_bias]))
    assert signs.mean(axis=0) == pytest.approx(np.zeros(7), abs=5 / np.sqrt(3000))
    assert signs.T @ signs / 3000 == pytest.approx(np.eye(7), abs=5 / np.sqrt(3000))
