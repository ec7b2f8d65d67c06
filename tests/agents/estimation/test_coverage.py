"""How often the truth is within two standard deviations of what the estimator says, whatever moves the robot."""

from dataclasses import asdict

import gymnasium
import numpy as np
import pytest

from agents import RobotEstimator, search
from ccr_gym import ENV_IDS, Sensing
from solver import Cable, Robot

IDS = sorted(env_id for env_id in ENV_IDS if "-Paper-" not in env_id)
NUMBERS = ("latency", "half_backlash", "loss", "rigidity")
STEPS = 63
LEAST_FORCE = 0.1  # that counts as pressing [EI/L²]


def followed(env_id, sensing, act, count, steps=STEPS, **kwargs):
    """Play episodes, and return what is known and true in every step.

    Args:
        act: Function of step, observation, what is known and set-point that returns actions.
    """
    kwargs = {"sensing": sensing, "obs_mode": "dict", "autoreset_mode": "Disabled"} | kwargs
    envs = gymnasium.make_vec(env_id, count, **kwargs)
    settings = envs.unwrapped.settings
    observation, _ = envs.reset(seed=7)
    estimator = RobotEstimator(settings, count)
    known, rows = estimator.update(observation), []
    for step in range(steps):
        goal = settings.force_span * np.linalg.norm(observation["desired_force"], axis=1)
        actions = np.clip(act(step, observation, known, goal), -1, 1).astype(np.float32)
        observation, _, _, _, info = envs.step(actions)
        known = estimator.update(observation)
        force = np.linalg.norm(info["force_true"], axis=1) / settings.scales.force_n
        rows.append((known, force, observation))
    state = envs.unwrapped.privileged_state
    half = state.half_backlash_mm[:, 0] / settings.scales.travel_mm
    truth = dict(zip(NUMBERS, (state.latency, half, state.tendon_loss, state.rigidity_ratio), strict=True))
    return rows, truth


def within(rows, truth, name, first=0):
    """Return the share of steps and robots in which a number is within two standard deviations."""
    return np.mean([abs(getattr(k, name) - truth[name]) <= 2 * getattr(k, f"{name}_std") for k, *_ in rows[first:]])


def force_within(rows):
    """Return the share of the steps in contact in which the force is within two standard deviations."""
    found = []
    for known, force, observation in rows:
        pressing = observation["contact"].any(axis=1) & (force > LEAST_FORCE)
        found.append((np.abs(known.force - force) <= 2 * known.force_std)[pressing])
    return np.concatenate(found).mean()


def regulating(step, observation, known, goal):
    """Return the actions of a proportional drive."""
    touching = observation["contact"].any(axis=1)[:, None]
    return search(observation) * np.where(touching, 0.8 * (goal - known.force)[:, None], 0.6)


def walking(seed=0):
    """Return actions that walk at random, and mostly pull."""
    generator, walk = np.random.default_rng(seed), 0.0

    def act(step, observation, known, goal):
        nonlocal walk
        pull = search(observation)
        walk = 0.9 * walk + 0.26 * generator.standard_normal(pull.shape)
        return 0.2 * pull + walk

    return act


def pulling_home(step, observation, known, goal):
    """Return actions that pull for six steps, and let the motors out to 0."""
    if step < 6:
        return 0.6 * search(observation)
    away = observation["cable"]
    return -np.sign(away) * np.minimum(1, 28 * np.abs(away))


@pytest.mark.parametrize("sensing", ["realistic", "sensorless"])
@pytest.mark.parametrize("env_id", IDS)
def test_forces_that_a_proportional_drive_brings_to_their_set_points(env_id, sensing):
    rows, truth = followed(env_id, sensing, regulating, 40)
    assert force_within(rows) >= 0.95
    for name in NUMBERS:
        assert within(rows, truth, name, 32) >= 0.88, name


@pytest.mark.parametrize("sensing", ["realistic", "sensorless"])
@pytest.mark.parametrize("env_id", IDS)
def test_forces_under_random_actions(env_id, sensing):
    """Random actions press with many times the set-points, beyond the limits of the sensors, and let robots snap."""
    rows, truth = followed(env_id, sensing, walking(), 80)
    assert force_within(rows) >= 0.9
    for name in NUMBERS:
        assert within(rows, truth, name, 32) >= 0.93, name


@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/LoadCell-v1", "CCR/SpatialPush-v1"])
def test_a_motor_at_rest_leaves_its_cable_where_the_play_ends(env_id):
    """The tension of that cable is none of a motor at 0."""
    rows, truth = followed(env_id, "sensorless", pulling_home, 100, 40)
    free = ~np.any([observation["contact"].any(axis=1) for *_, observation in rows], axis=0)
    known = rows[-1][0]
    error = np.abs(known.rigidity - truth["rigidity"])
    assert free.sum() > 50
    assert np.mean((error <= 2 * known.rigidity_std)[free]) >= 0.95
    assert np.median(error / truth["rigidity"]) < 0.04


@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/SpatialPush-v1"])
def test_the_rigidity_is_in_its_range_from_the_first_step_on(env_id):
    rows, _ = followed(env_id, "realistic", lambda step, seen, *_: 0.15 * search(seen), 150, 8)
    for known, *_ in rows:
        assert known.rigidity.min() >= 0.3 - 1e-9
        assert known.rigidity.max() <= 3.0 + 1e-9


@pytest.mark.parametrize("ranges", [{"offset": (0.8, 1.25)}, {"length": (0.9, 1.1), "rigidity": (0.5, 2.0)}])
def test_what_is_hidden_of_random_robots_is_doubt_or_found(ranges):
    hidden = {"observed": False, **ranges}
    rows, truth = followed("CCR/PushObstacle-v1", "realistic", regulating, 80, randomize=hidden)
    assert force_within(rows) >= 0.95
    for name in NUMBERS:
        assert within(rows, truth, name, 32) >= 0.9, name
    assert np.median(np.abs(rows[-1][0].half_backlash - truth["half_backlash"])) < 0.004


def pumping(step, observation, known, goal):
    """Return actions that pull and let go at full speed."""
    return (1.0 if step < 20 or step // 14 % 2 == 0 else -0.8) * search(observation)


def test_a_tension_at_its_limit_tells_nothing_of_latency_loss_and_rigidity():
    """The tensions of rigid robots pass the limit of the load cell long before they stall, and seem to stay there."""
    stiff = asdict(Sensing()) | {"rigidity_ratio": (2.0, 3.0)}
    rows, truth = followed("CCR/PushObstacle-v1", stiff, pumping, 100)
    limited = np.mean([np.abs(observation["tension"]) >= 1 for *_, observation in rows])
    assert limited > 0.03
    for name in ("latency", "loss", "rigidity"):
        assert within(rows, truth, name, 32) >= 0.97, name


def test_a_load_cell_that_is_at_its_limit_for_some_steps_is_not_read_in_these():
    envs = gymnasium.make_vec("CCR/PushObstacle-v1", 20, sensing="sensorless", obs_mode="dict")
    observation, _ = envs.reset(seed=0)
    estimator = RobotEstimator(envs.unwrapped.settings, 20)
    for step in range(14):
        limited = {"tension": np.ones_like(observation["tension"])} if step in (5, 6) else {}
        known = estimator.update(observation | limited)
        observation = envs.step(np.full((20, 1), 0.5 if step < 8 else -0.5, np.float32))[0]
        assert not observation["contact"].any()
    truth = envs.unwrapped.privileged_state.rigidity_ratio
    assert np.median(np.abs(known.rigidity / truth - 1)) < 0.1
    assert (np.abs(known.rigidity - truth) <= 2 * known.rigidity_std).mean() >= 0.9


def test_the_zero_of_a_pair_of_cables_counts_against_the_one_that_is_pulled():
    """A pair has one load cell, whose reading is the tension of either cable."""
    off = asdict(Sensing()) | {"tension_zero": (0.3, 0.3)}
    rows, truth = followed("CCR/SpatialPush-Paper-v1", off, walking(), 40)
    for name in NUMBERS:
        assert within(rows, truth, name, 32) >= 0.93, name


@pytest.mark.parametrize("sensing", ["ideal", "realistic", "sensorless"])
@pytest.mark.parametrize("env_id", ["CCR/LoadCell-Paper-v1", "CCR/SpatialPush-Paper-v1", "CCR/PushObstacle-v1"])
def test_an_estimate_that_is_regulated_is_the_force(env_id, sensing):
    """It is observed without an error, whatever a sensor reads of it."""
    envs = gymnasium.make_vec(env_id, 8, sensing=sensing, regulate="estimate", obs_mode="dict")
    unit, estimator = envs.unwrapped.settings.scales.force_n, RobotEstimator(envs.unwrapped.settings, 8)
    observation, _ = envs.reset(seed=0)
    pressed = 0
    for _ in range(40):
        known = estimator.update(observation)
        regulated = np.linalg.norm(envs.unwrapped.privileged_state.force, axis=1) / unit
        inside = (np.abs(observation["force_est"]) < 1).all(axis=1)
        assert known.force[inside] == pytest.approx(regulated[inside], abs=1e-5)
        assert not known.force_std[inside].any()
        pressed += (regulated > LEAST_FORCE).sum()
        observation = envs.step(0.7 * search(observation))[0]
    assert pressed > 40


@pytest.mark.parametrize("walks", [False, True])
@pytest.mark.parametrize("env_id", [f"CCR/{task}-v1" for task in ("LoadCell", "BracedPush", "SpatialPush")])
def test_without_imperfections_and_without_a_force_sensor_the_estimate_is_the_force(env_id, walks):
    rows, _ = followed(env_id, "ideal", walking() if walks else regulating, 30, force_sensor=False)
    assert force_within(rows) >= 0.98
    for known, _, observation in rows:
        assert not known.force[~observation["contact"].any(axis=1)].any()


def test_a_tension_at_its_limit_tells_no_force():
    envs = gymnasium.make_vec("CCR/PushObstacle-v1", 1, sensing="sensorless", obs_mode="dict")
    known = []
    for limit in (False, True):
        estimator = RobotEstimator(envs.unwrapped.settings, 1)
        observation, _ = envs.reset(seed=0)
        pressed = 0
        while pressed < 4:
            estimator.update(observation)
            observation = envs.step(np.ones((1, 1), np.float32))[0]
            pressed += observation["contact"].any()
        seen = observation | ({"tension": np.ones_like(observation["tension"])} if limit else {})
        known.append(estimator.update(seen))
    assert known[0].force > LEAST_FORCE
    assert known[0].force_std < 0.5 * known[0].force
    assert known[1].force_std > known[1].force


def test_a_new_estimator_is_one_that_was_reset():
    envs = gymnasium.make_vec("CCR/PushObstacle-v1", 3, sensing="realistic", obs_mode="dict")
    observation, _ = envs.reset(seed=0)
    new, reset = (RobotEstimator(envs.unwrapped.settings, 3) for _ in range(2))
    reset.reset()
    for _ in range(6):
        for one, other in zip(new.update(observation), reset.update(observation), strict=True):
            assert np.array_equal(one, other)
        observation = envs.step(np.ones((3, 1), np.float32))[0]


@pytest.mark.parametrize(
    "bent", [{"precurvature": 0.005}, {"precurvature": -0.002}, {"weight_per_length": (2e-4, 0.0)}], ids=str
)
def test_a_robot_that_is_bent_at_rest_is_none_with_more_play(bent):
    """Its shape shows a command before its motor moves, and its cable is slack up to there, or taut at once."""
    robot = Robot.prototype(**bent)
    rows, truth = followed("CCR/PushObstacle-v1", "sensorless", walking(), 60, robot=robot)
    assert force_within(rows) >= 0.95
    for name in NUMBERS:
        assert within(rows, truth, name, 32) >= 0.93, name


def test_a_cable_near_the_backbone_stalls_under_less_force():
    """Its tension bends the robot by less, so that it is at its limit before the command of a usual cable is."""
    robot = Robot.prototype(cables=(Cable(offset_mm=5.0),))
    rows, truth = followed("CCR/PushObstacle-v1", "sensorless", walking(), 60, robot=robot)
    assert force_within(rows) >= 0.95
    assert within(rows, truth, "latency", 32) >= 0.98
