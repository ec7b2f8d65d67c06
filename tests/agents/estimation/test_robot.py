"""What the estimator says it knows, against the truth of the episodes."""

import gymnasium
import numpy as np
import pytest

from agents.estimation.robot import RobotEstimator
from agents.policy import search
from benchmarks.tables import reversed_once
from ccr_gym import EXACT, FORCE_SPAN

STEPS, COUNT = 64, 250
NUMBERS = ("latency", "half_backlash", "loss", "rigidity", "force")


def probed(env_id, sensing, count=COUNT, seed=5, randomize=None, length=STEPS):
    """Play episodes that pull, reverse once before contact, and then bring the force to its set-point.

    Returns what is known at the end, the truth, whether a robot touches, and for each step by how many of its standard
    deviations the force is wrong where it touches.
    """
    kwargs = {"sensing": sensing, "randomize": randomize, "obs_mode": "dict", "autoreset_mode": "Disabled"}
    envs = gymnasium.make_vec(env_id, count, **kwargs)
    settings = envs.unwrapped.settings
    observation, _ = envs.reset(seed=seed)
    estimator = RobotEstimator(settings, count)
    known = estimator.update(observation)
    phase, steps = np.zeros(count, int), np.zeros(count, int)
    wrong = []
    for _ in range(length):
        speed, phase, steps = reversed_once(observation, known, settings, phase, steps + 1)
        observation, _, _, _, info = envs.step((speed[:, None] * search(observation)).astype(np.float32))
        known = estimator.update(observation)
        force = np.linalg.norm(info["force_true"], axis=1) / settings.scales.force_n
        pressing = observation["contact"].any(axis=1) & (force > 0.1)
        wrong.append(np.where(pressing, np.abs(known.force - force) / np.maximum(known.force_std, 1e-9), 0.0))
    state = envs.unwrapped.privileged_state
    half = state.half_backlash_mm[:, 0] / settings.scales.travel_mm
    truth = dict(zip(NUMBERS, (state.latency, half, state.tendon_loss, state.rigidity_ratio, force), strict=True))
    return known, truth, pressing, np.array(wrong)


def covered(known, truth, touching, name):
    """Return the share of robots whose truth is within two standard deviations of what is known."""
    error = np.abs(getattr(known, name) - truth[name])
    within = error <= 2 * getattr(known, f"{name}_std") + 1e-9
    return within[touching].mean() if name == "force" else within.mean()


@pytest.mark.parametrize("sensing", ["realistic", "sensorless"])
@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/LoadCell-v1"])
def test_the_truth_is_within_two_standard_deviations(env_id, sensing):
    known, truth, touching, _ = probed(env_id, sensing)
    assert touching.mean() > 0.9
    for name in NUMBERS:
        assert covered(known, truth, touching, name) >= 0.93, name
    error = np.abs(known.force - truth["force"])[touching] / truth["force"][touching]
    assert np.median(error) < 0.08
    assert np.median(np.abs(known.loss - truth["loss"])) < 0.012
    assert np.median(np.abs(known.rigidity / truth["rigidity"] - 1)) < 0.02
    assert np.array_equal(np.rint(known.latency), truth["latency"])


@pytest.mark.parametrize("sensing", ["realistic", "sensorless"])
def test_the_force_on_one_of_two_obstacles_is_told_from_that_on_the_other(sensing):
    known, truth, touching, _ = probed("CCR/BracedPush-v1", sensing)
    assert touching.mean() > 0.85  # where both forces count as one, the robot stops at the brace
    for name in NUMBERS:
        assert covered(known, truth, touching, name) >= 0.93, name
    assert np.sqrt(np.mean((known.force - truth["force"])[touching] ** 2)) < 0.35


@pytest.mark.parametrize("sensing", ["realistic", "sensorless"])
@pytest.mark.parametrize("env_id", [pytest.param("CCR/TrackForce-v1", marks=pytest.mark.long), "CCR/MovingObstacle-v1"])
def test_what_is_known_stays_true_in_long_episodes(env_id, sensing):
    """Where a motor creeps through its play, or a robot stalls, which way the cable last moved is not known."""
    known, truth, touching, wrong = probed(env_id, sensing, 120, length=128)
    for name in NUMBERS:
        assert covered(known, truth, touching, name) >= 0.93, name
    assert wrong.max() < 12


def test_random_robots_are_estimated_from_the_sizes_that_are_observed():
    known, truth, touching, _ = probed("CCR/PushObstacle-v1", "realistic", 100, randomize={"offset": (0.8, 1.25)})
    for name in NUMBERS:
        assert covered(known, truth, touching, name) >= 0.9, name
    assert np.array_equal(np.rint(known.latency), truth["latency"])


def test_a_reversal_tells_friction_from_rigidity():
    settings = {"sensing": "sensorless", "obs_mode": "dict"}
    envs = gymnasium.make_vec("CCR/PushObstacle-v1", 100, **settings)
    observation, _ = envs.reset(seed=0)
    estimator = RobotEstimator(envs.unwrapped.settings, 100)
    estimator.update(observation)
    deviations = []
    for speed in (0.6,) * 7 + (-0.6,) * 5:
        action = np.full((100, 1), speed, np.float32)
        deviations.append(np.median(estimator.update(envs.step(action)[0]).loss_std))
    assert deviations[6] > 0.06  # pulling alone tells rigidity over what is left of the tension
    assert deviations[-1] < 0.045


def test_without_imperfections_nothing_is_uncertain():
    envs = gymnasium.make_vec("CCR/PushObstacle-v1", 8, sensing=EXACT, obs_mode="dict")
    observation, _ = envs.reset(seed=0)
    estimator = RobotEstimator(envs.unwrapped.settings, 8)
    for _ in range(24):
        known = estimator.update(observation)
        observation, _, _, _, info = envs.step(np.full((8, 1), 0.8, np.float32))
    known = estimator.update(observation)
    truth = np.linalg.norm(info["force_true"], axis=1) / envs.unwrapped.settings.scales.force_n
    touching = observation["contact"].any(axis=1)
    assert touching.any()
    assert known.force[touching] == pytest.approx(truth[touching], rel=0.02)
    assert known.rigidity == pytest.approx(np.ones(8), abs=0.01)
    assert (known.latency == 0).all()


def test_with_ideal_sensing_the_force_is_what_the_sensor_reads():
    envs = gymnasium.make_vec("CCR/PushObstacle-v1", 4, obs_mode="dict")
    observation, _ = envs.reset(seed=0)
    estimator = RobotEstimator(envs.unwrapped.settings, 4)
    for _ in range(25):
        observation = envs.step(np.ones((4, 1), np.float32))[0]
        known = estimator.update(observation)
    read = FORCE_SPAN * np.linalg.norm(observation["force_measured"], axis=1)
    assert known.force == pytest.approx(read, abs=1e-6)


@pytest.mark.parametrize(
    "env_id", [f"CCR/{task}-v1" for task in ("PushObstacle", "SpatialPush", "InsertAndPush", "BracedPush")]
)
def test_robots_are_estimated_alike_together_and_alone_and_forgotten(env_id):
    envs = gymnasium.make_vec(env_id, 5, sensing="realistic", obs_mode="dict")
    settings, generator = envs.unwrapped.settings, np.random.default_rng(0)
    together, alone = RobotEstimator(settings, 5), RobotEstimator(settings, 1)
    for _ in range(2):
        observation, _ = envs.reset(seed=1)
        together.reset()
        alone.reset()
        for _ in range(40):
            known = together.update(observation)
            one = alone.update_one({key: value[3] for key, value in observation.items()})
            for many, single in zip(known, one, strict=True):
                assert np.array_equal(many[3], single)
            pull = generator.uniform(-0.3, 1, envs.action_space.shape)
            observation = envs.step(pull.astype(np.float32))[0]
