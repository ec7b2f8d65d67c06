"""Slopes of the steps of vector environments: against differences, through backlash, and at events."""

import copy
import pickle
from dataclasses import replace

import gymnasium
import numpy as np
import pytest

import ccr_gym
from ccr_gym import Sensing
from solver import Circle, Robot
from solver.spatial import SpatialRobot

COUNT, CHANGE = 4, 2e-4
IDS = sorted(ccr_gym.ENV_IDS)
SMOOTH = Sensing(force_resolution=(0.0, 0.0))  # realistic but for the steps of the force sensor


def make(env_id="CCR/PushObstacle-v1", count=COUNT, **kwargs):
    kwargs = {"max_episode_steps": 10**6, "derivatives": True, **kwargs}
    return gymnasium.make_vec(env_id, count, vectorization_mode="vector_entry_point", **kwargs).unwrapped


def pushed(env, steps=16):
    """Bring robots to a good part of their set-points; return the last observation and action."""
    observation, info = env.reset(seed=3)
    generator, size = np.random.default_rng(0), env.action_space.shape[1]
    way = np.ones((env.num_envs, size))
    if "obstacle" in env.observation_slices:
        way = observation[:, env.observation_slices["obstacle"]][:, :2]
        way = np.tile(way / np.abs(way).max(axis=1, keepdims=True), max(1, size // 2))
    for _ in range(steps):
        wanted = np.linalg.norm(np.reshape(info["desired_force"], (env.num_envs, -1)), axis=1)
        missing = (wanted - np.linalg.norm(info["force_true"], axis=1)) / wanted
        actions = np.clip(2 * missing[:, None] * way + generator.normal(0, 0.2, (env.num_envs, size)), -0.9, 0.9)
        info = env.step(actions)[-1]
    return actions


def outputs(env, state, actions):
    """Return what a step from a state leads to, and what must be the same for it to be smooth."""
    env.set_state(state)
    observation, reward, *_, info = env.step(actions)
    found = {"observation": observation.astype(float), "reward": reward[:, None]}
    found |= {name: info[name] for name in ("force_true", "force_est")}
    contact = env.observation_slices["contact"]
    return found, np.column_stack([observation[:, contact], env.slopes.follows, env.slopes.found, info["tension"] > 0])


@pytest.mark.parametrize("sensing", ["ideal", SMOOTH], ids=["ideal", "realistic"])
@pytest.mark.parametrize("env_id", IDS)
def test_products_agree_with_differences(env_id, sensing):
    env = make(env_id, sensing=sensing)
    actions, compared = pushed(env), 0
    state = env.get_state()
    generator = np.random.default_rng(2)
    for k in range(actions.shape[1]):
        change = np.zeros_like(actions)
        change[:, k] = CHANGE
        (up, kind), (down, other), (_, middle) = (outputs(env, state, actions + s * change) for s in (1, -1, 0))
        smooth = (kind == other).all(axis=1) & (kind == middle).all(axis=1) & env.slopes.found
        compared += smooth.sum()
        for name, above in up.items():
            weights = generator.normal(size=above.shape)
            expected = ((above - down[name]) * weights).sum(axis=1) / (2 * CHANGE)
            given = weights[:, 0] if name == "reward" else weights
            found = env.vjp(**{name: given})[:, k]
            limit = 0.02 if name == "observation" else 2e-3 * np.abs(expected).max() + 1e-6  # float32 numbers
            assert found[smooth] == pytest.approx(expected[smooth], rel=5e-3, abs=limit), name
    assert compared >= COUNT * actions.shape[1] / 2


@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/SpatialPush-v1", "CCR/TrackForce-v1"])
def test_the_reward_of_goals_has_slopes_of_its_own(env_id):
    env = make(env_id, obs_mode="goal")
    env.reset(seed=3)
    for _ in range(14):
        env.step(np.full(env.action_space.shape, 0.8))
    state, actions = env.get_state(), np.full(env.action_space.shape, 0.4)
    change = np.full_like(actions, 3e-3)  # goals are float32 numbers
    ends = []
    for side in (1, -1, 0):
        env.set_state(state)
        ends.append(env.step(actions + side * change)[1])
    expected = (ends[0] - ends[1]) / 2
    assert expected.any()
    assert (env.vjp(reward=np.ones(COUNT)) * change).sum(axis=1) == pytest.approx(expected, rel=5e-3, abs=1e-6)


def test_a_cable_amid_its_backlash_does_not_move_and_its_motor_does():
    env = make(sensing=Sensing(backlash=(0.2, 0.2), latency=(0, 0), force_resolution=(0.0, 0.0)))
    pushed(env)
    env.step(np.full((COUNT, 1), -0.3))  # a reversal
    slopes = env.slopes
    assert not slopes.follows.any()
    assert np.array_equal(slopes.motor_per_action, np.full((COUNT, 1), env.action_spec.increment_mm[0]))
    assert not env.vjp(force_true=np.ones((COUNT, 2))).any()
    cable = np.zeros((COUNT, env.single_observation_space.shape[0]))
    cable[:, env.observation_slices["cable"]] = 1.0
    assert env.vjp(observation=cable).all()


def test_a_stall_has_no_slopes_but_those_of_its_effort():
    robot = replace(Robot.prototype(), max_tension=2.0)
    env = make(robot=robot, task={"force": (0.05, 0.1)})
    env.reset(seed=3)
    for _ in range(16):
        info = env.step(np.full((COUNT, 1), 0.9))[-1]
    assert (info["solver_status"] == 2).all()
    assert not env.slopes.found.any()
    assert not env.vjp(force_true=np.ones((COUNT, 2)), observation=np.ones(env.observation_space.shape)).any()
    weight = env.settings.weights.effort
    assert env.vjp(reward=np.ones(COUNT)) == pytest.approx(np.full((COUNT, 1), -2 * 0.9 * weight))


def test_an_action_beyond_its_range_has_no_slope():
    env = make()
    env.reset(seed=3)
    env.step(np.array([[1.5], [0.9], [-0.9], [0.5]]))  # the third is at the end of its range, too
    moved = env.vjp(observation=np.ones(env.observation_space.shape))[:, 0]
    assert moved[[1, 3]].all()
    assert not moved[[0, 2]].any()


@pytest.mark.parametrize(
    ("env_id", "sensing", "k"),
    [
        ("CCR/InsertAndPush-v1", SMOOTH, 1),  # the insertion has no backlash
        ("CCR/PushObstacle-v1", replace(SMOOTH, backlash=(0.0, 0.0)), 0),
    ],
    ids=["insertion", "no_backlash"],
)
def test_what_has_no_backlash_has_slopes_where_it_is_not_moved(env_id, sensing, k):
    env = make(env_id, sensing=sensing)
    actions = pushed(env)
    actions[:, k] = 0.0
    state, change = env.get_state(), np.zeros_like(actions)
    change[:, k] = CHANGE
    (up, kind), (down, other), (_, middle) = (outputs(env, state, actions + s * change) for s in (1, -1, 0))
    smooth = (kind == other).all(axis=1) & (kind == middle).all(axis=1) & env.slopes.found
    assert smooth.sum() >= COUNT / 2
    assert env.slopes.follows[:, k].all()
    expected = (up["force_true"] - down["force_true"]).sum(axis=1) / (2 * CHANGE)
    assert expected[smooth].any()
    found = env.vjp(force_true=np.ones(up["force_true"].shape))[:, k]
    assert found[smooth] == pytest.approx(expected[smooth], rel=1e-4, abs=1e-6)


def test_states_that_were_set_have_no_slopes():
    env = make()
    pushed(env)
    state = env.get_state()
    assert env.vjp(reward=np.ones(COUNT)).any()
    env.set_state(state)
    assert not env.slopes.found.any()
    assert not env.vjp(reward=np.ones(COUNT)).any()
    env.step(np.full((COUNT, 1), 0.5))
    env.fork([1] * COUNT)
    assert not env.slopes.found.any()


@pytest.mark.parametrize(("preset", "env_id"), [(Robot, "CCR/PushObstacle-v1"), (SpatialRobot, "CCR/SpatialPush-v1")])
def test_robots_of_three_sections_have_slopes_whatever_their_sensing(preset, env_id):
    snake = preset.preset("snake_arm")
    section, end = snake.cables[: len(snake.cables) // 2], snake.segments // 3
    cables = [replace(cable, end=last) for last in (end, 2 * end, None) for cable in section]
    env = make(env_id, 2, robot=replace(snake, cables=tuple(cables)), sensing=SMOOTH)
    actions = pushed(env)
    state, generator = env.get_state(), np.random.default_rng(2)
    compared = 0
    for _ in range(4):
        change = CHANGE * generator.normal(size=actions.shape)
        (up, kind), (down, other), (_, middle) = (outputs(env, state, actions + s * change) for s in (1, -1, 0))
        smooth = (kind == other).all(axis=1) & (kind == middle).all(axis=1) & env.slopes.found
        compared += smooth.sum()
        for name, above in up.items():
            weights = generator.normal(size=above.shape)
            expected = ((above - down[name]) * weights).sum(axis=1) / 2
            found = (env.vjp(**{name: weights[:, 0] if name == "reward" else weights}) * change).sum(axis=1)
            limit = 5e-6 if name == "observation" else 2e-3 * np.abs(expected).max() + 1e-9
            assert found[smooth] == pytest.approx(expected[smooth], rel=5e-3, abs=limit), name
    assert compared >= 4
    assert env.force_slopes().shape == (2, actions.shape[1], 2 if preset is Robot else 3)


def test_environments_that_restart_have_no_slopes():
    env = make(max_episode_steps=2)
    env.reset(seed=3)
    for step in range(4):
        env.step(np.full((COUNT, 1), 0.9))
        assert env.slopes.found.all() == (step % 3 != 2)
    env.reset(seed=4)
    assert not any(slopes.any() for name, slopes in env.slopes._asdict().items() if name != "present")


@pytest.mark.parametrize("clone", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["copy", "pickle"])
def test_copies_differentiate_as_well(clone):
    env = make(sensing="realistic")
    actions = pushed(env)
    other = clone(env)
    for each in (env, other):
        each.step(actions)
    assert all(np.array_equal(a, b) for a, b in zip(env.slopes, other.slopes, strict=True))


def test_steps_are_the_same_with_and_without():
    one, other = make(sensing="realistic"), make(sensing="realistic", derivatives=False)
    pushed(one), pushed(other)
    first, second = (env.step(np.full((COUNT, 1), 0.4)) for env in (one, other))
    assert np.array_equal(first[0], second[0])
    assert np.array_equal(first[1], second[1])


def test_what_cannot_be_is_refused():
    plain = make(derivatives=False)
    plain.reset(seed=0)
    with pytest.raises(ValueError, match="derivatives=True"):
        plain.vjp(reward=np.ones(COUNT))
    env = make()
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"reward .* shape \(4,\)"):
        env.vjp(reward=np.ones((COUNT, 1)))
    with pytest.raises(ValueError, match="observation"):
        env.vjp(observation=np.full(env.observation_space.shape, np.nan))
    with pytest.raises(ValueError, match="derivatives"):
        make(derivatives="yes")
    with pytest.raises(TypeError, match="derivatives"):
        gymnasium.make("CCR/PushObstacle-v1", derivatives=True)


@pytest.mark.parametrize("sensing", ["ideal", "realistic"])
@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/SpatialPush-v1", "CCR/LoadCell-Paper-v1"])
def test_slopes_of_a_single_environment_are_those_of_its_probe(env_id, sensing):
    env = gymnasium.make(env_id, sensing=sensing).unwrapped
    step_mm, compared = 1e-5 * env.settings.scales.travel_mm, 0
    for seed in range(3):
        env.reset(seed=seed)
        generator = np.random.default_rng(seed)
        for _ in range(20):
            env.step(generator.uniform(0.2, 1, env.action_space.shape))
            state = env.privileged_state
            if not state.force.any() or (state.actuated_mm + step_mm > env.action_spec.high_mm).any():
                continue
            ends = np.eye(len(state.actuated_mm)) * step_mm
            expected = [
                (env.probe(state.actuated_mm + e) - env.probe(state.actuated_mm - e)) / 2 / step_mm for e in ends
            ]
            compared += 1
            assert env.force_slopes() == pytest.approx(np.array(expected), rel=1e-5, abs=1e-6)
    assert compared >= 5


def test_slopes_exist_where_the_motor_has_stalled():
    env = gymnasium.make("CCR/PushObstacle-v1", robot=replace(Robot.prototype(), max_tension=2.0)).unwrapped
    env.reset(seed=0, options={"scene": [Circle(center=(30.0, 130.0), radius=12.0)], "desired_force": 0.1})
    for _ in range(24):
        info = env.step([0.9])[-1]
    assert info["solver_status"] == 2
    assert np.linalg.norm(info["force_true"]) > 0
    assert env.force_slopes().any()
