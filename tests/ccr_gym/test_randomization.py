"""Randomised robots: what is drawn is what moves, what observation and info tell, and what is refused."""

import gymnasium
import numpy as np
import pytest

import ccr_gym
from ccr_gym import Randomization
from ccr_gym.sensing import EXACT
from solver import Cable, Circle, Robot, Scene, Solver, Status

RANGES = {"rigidity": (0.5, 2.0), "length": (0.8, 1.1), "offset": (0.8, 1.25), "tendon_loss": (0.0, 0.2)}
FIXED_LENGTH = {**RANGES, "length": (1.0, 1.0)}  # whose spacing suits the obstacles of insertion
EVERY_ID = pytest.mark.parametrize("env_id", sorted(ccr_gym.ENV_IDS))


def ranges_of(env_id):
    return FIXED_LENGTH if "Insert" in env_id else RANGES


def make(env_id="CCR/PushObstacle-v1", **kwargs):
    return gymnasium.make(env_id, **{"randomize": ranges_of(env_id), **kwargs})


def play(env, seeds, steps=20):
    """Return the episodes of some seeds: observations, rewards and infos."""
    record, generator = [], np.random.default_rng(0)
    for seed in seeds:
        record.append((env.reset(seed=seed)[0], 0.0, None))
        for _ in range(steps):
            action = generator.uniform(-0.2, 1, env.action_space.shape).astype(np.float32)
            observation, reward, _, _, info = env.step(action)
            record.append((observation, reward, info))
    return record


@EVERY_ID
def test_the_robot_that_is_told_is_the_one_that_moves(env_id):
    env = make(env_id, obs_mode="dict")
    nominal, drawn = env.unwrapped.settings.robot, set()
    for seed in range(8):
        observation, info = env.reset(seed=seed)
        robot = env.unwrapped.equilibrium.robot
        ratios = robot.rigidity / nominal.rigidity, robot.length_mm / nominal.length_mm
        assert info["robot"][:3] == pytest.approx([*ratios, robot.offset_mm / nominal.offset_mm], rel=1e-12)
        ends = [np.log(ranges_of(env_id)[name]) for name in ("rigidity", "length", "offset")]
        shown = np.append([low + (high - low) * 0.5 for low, high in ends], 0.1)
        spans = np.append([high - low for low, high in ends], 0.2)
        told = shown + observation["robot"] / 2 * spans
        assert told == pytest.approx(np.append(np.log(info["robot"][:3]), info["robot"][3]), abs=1e-6)
        drawn.add(robot)
    assert len(drawn) == 8


def test_all_cables_and_segments_follow():
    fields = {"length_mm": 180, "segments": 3, "offset_mm": 8, "segment_rigidity": (4000, 5000, 6000)}
    nominal = Robot(**fields, cables=[Cable(offset_mm=4), Cable(angle=np.pi, offset_mm=6)])
    env = make(robot=nominal, randomize={"rigidity": (2, 2), "offset": (1.25, 1.25)}, task={"radius": (0.3, 0.3)})
    env.reset(seed=0)
    robot = env.unwrapped.equilibrium.robot
    assert [cable.offset_mm for cable in robot.cables] == pytest.approx([5.0, 7.5])
    assert robot.segment_rigidity == pytest.approx((8000, 10000, 12000))


def test_steps_are_those_of_the_drawn_robots_own_solver():
    env = make()
    for seed in range(5):
        env.reset(seed=seed)
        start = env.unwrapped.equilibrium
        solver = Solver(start.robot, start.scene)
        state = solver.rest()
        for _ in range(30):
            env.step(np.ones(1, np.float32))
            if env.unwrapped.equilibrium.status is Status.STALLED:  # where it pulls beyond what it has reached
                break
            state = solver.step(state, env.unwrapped.privileged_state.actuated_mm[0])
            assert np.array_equal(env.unwrapped.equilibrium.nodes, state.nodes)


@EVERY_ID
def test_vector_and_single_environments_agree(env_id):
    kwargs = {"randomize": ranges_of(env_id), "sensing": "realistic", "max_episode_steps": 9}
    ours = gymnasium.make_vec(env_id, 3, vectorization_mode="vector_entry_point", **kwargs)
    theirs = gymnasium.make_vec(env_id, 3, vectorization_mode="sync", **kwargs)
    assert np.array_equal(ours.reset(seed=5)[0], theirs.reset(seed=5)[0])
    generator = np.random.default_rng(1)
    for _ in range(30):
        actions = generator.uniform(-0.4, 1, ours.action_space.shape).astype(np.float32)
        our, their = ours.step(actions), theirs.step(actions)
        assert np.array_equal(our[0], their[0])
        assert ours.observation_space.contains(our[0])
        assert np.array_equal(our[1], their[1])
        assert np.array_equal(our[4]["robot"], their[4]["robot"])


@pytest.mark.parametrize("size", [0.1, 10])
def test_randomised_robots_of_any_size_play_alike(size):
    large = {"length_mm": 180 * size, "segments": 18, "offset_mm": 8 * size, "rigidity": 5000 * size**2}
    for (one, reward, _), (other, other_reward, _) in zip(
        play(make(), range(3)), play(make(robot=large), range(3)), strict=True
    ):
        assert other == pytest.approx(one, abs=1e-5)
        assert other_reward == pytest.approx(reward, abs=1e-5)


@EVERY_ID
def test_a_ranges_of_one_is_the_nominal_robot(env_id):
    one = play(make(env_id, randomize={"observed": False}), [1, 2])
    plain = play(make(env_id, randomize=None), [1, 2])
    for (observation, reward, info), (other, other_reward, _) in zip(one, plain, strict=True):
        assert observation == pytest.approx(other, abs=2e-6)
        assert reward == pytest.approx(other_reward, abs=1e-6)
        assert info is None or info["robot"].tolist() == [1, 1, 1, 0]


@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/SpatialPush-v1"])
def test_the_estimator_knows_the_drawn_robot(env_id):
    envs = gymnasium.make_vec(env_id, 32, randomize=RANGES | {"tendon_loss": None})
    envs.reset(seed=0)
    ratios, least = [], 0.05 * envs.unwrapped.settings.scales.force_n
    for _ in range(60):
        info = envs.step(np.full(envs.action_space.shape, 0.5, np.float32))[4]
        true, estimate = (np.linalg.norm(info[key], axis=1) for key in ("force_true", "force_est"))
        ratios.extend((estimate / np.maximum(true, least))[true > least])
    assert 0.9 < np.median(ratios) < 1.05  # 0.82 and 0.88 with the nominal robot's motion


def test_states_keep_the_robot():
    env = make(sensing="realistic")
    env.reset(seed=3)
    env.step(np.ones(1, np.float32))
    state, robot = env.unwrapped.get_state(), env.unwrapped.equilibrium.robot
    ends = []
    for _ in range(2):
        env.reset(seed=8)
        env.unwrapped.set_state(state)
        assert env.unwrapped.equilibrium.robot == robot
        ends.append([env.step(np.full(1, 0.5, np.float32))[0] for _ in range(20)][-1])
    assert np.array_equal(*ends)


@pytest.mark.parametrize("sensing", ["ideal", "realistic"])
@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/BracedPush-v1"])
def test_states_and_forks_keep_the_lines_of_the_drawn_robot(env_id, sensing):
    kwargs = {"randomize": {"offset": (0.8, 1.25)}, "sensing": sensing}
    env, other = make(env_id, **kwargs).unwrapped, make(env_id, **kwargs).unwrapped
    envs = gymnasium.make_vec(env_id, 2, vectorization_mode="vector_entry_point", **kwargs)
    action = np.full(env.action_space.shape, 0.6, np.float32)
    touched = False
    for seed in range(4):
        env.reset(seed=seed)
        other.reset(seed=100 + seed)
        envs.reset(seed=seed)
        for _ in range(25):
            env.step(action)
            envs.step(np.stack([action, action]))
        other.set_state(env.get_state())
        envs.fork([0, 0])
        for _ in range(8):
            one, two = env.step(action), other.step(action)
            assert np.array_equal(one[0], two[0])
            assert np.array_equal(one[4]["force_est"], two[4]["force_est"])
            touched |= bool(np.any(one[4]["force_est"]))
            forked = envs.step(np.stack([action, action]))[4]["force_est"]
            assert np.array_equal(forked[0], forked[1])
    assert touched


def test_unobserved_robots_keep_the_observation_of_the_nominal_robot():
    hidden, plain = make(randomize={**RANGES, "observed": False}), make(randomize=None, sensing=EXACT)
    assert hidden.observation_space == plain.observation_space
    assert hidden.reset(seed=0)[1]["robot"].shape == (4,)
    assert "robot" not in plain.reset(seed=0)[1]


def test_a_given_scene_that_overlaps_the_drawn_robot_changes_nothing():
    env = make(randomize={"length": (1.1, 1.1)})
    env.reset(seed=0)
    before = env.unwrapped.get_state()
    beyond = Scene([Circle(center=(0.0, 210.0), radius=20.0)])  # clear of the nominal robot, not of the drawn one
    Solver(Robot.prototype(), beyond)
    with pytest.raises(ValueError, match="overlaps"):
        env.reset(options={"scene": beyond, "desired_force": 0.1})
    assert env.unwrapped.get_state().generators == before.generators
    env.step(np.ones(1, np.float32))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"rigidity": (2.0, 1.0)}, "rigidity"),
        ({"rigidity": (0.0, 1.0)}, "rigidity"),
        ({"length": (0.1, 1.0)}, "length"),
        ({"offset": (1.0, float("nan"))}, "offset"),
        ({"tendon_loss": (0.0, 1.0)}, "tendon_loss"),
    ],
)
def test_impossible_ranges_are_refused(given, message):
    with pytest.raises(ValueError, match=message):
        make(randomize=given)


def test_robots_that_obstacles_could_slip_through_are_refused():
    with pytest.raises(ValueError, match="slip between points"):
        make("CCR/InsertAndPush-v1", randomize={"length": (0.9, 1.0), "offset": (1.0, 1.25)})


def test_lengths_beyond_the_insertion_are_named_as_they_were_given():
    with pytest.raises(ValueError, match=r"length of randomize is \(0.8, 1.1\); it must lie in \(0.875, 1.125\)"):
        make("CCR/InsertAndPush-v1", randomize=RANGES)


def test_robots_that_cannot_be_made_are_named():
    with pytest.raises(ValueError, match=r"randomize has robots that are refused: .*max_cable_mm"):
        make(
            robot={"length_mm": 180, "segments": 18, "offset_mm": 8, "max_cable_mm": 100},
            randomize={"length": (0.5, 1)},
        )


def test_a_drawn_robot_that_is_too_stiff_for_the_task_names_the_remedy():
    env = make(randomize={"rigidity": (50, 50)})
    with pytest.raises(RuntimeError, match="or narrow the ranges of randomize"):
        env.reset(seed=0)


def test_only_the_native_solver_moves_randomised_robots():
    with pytest.raises(ValueError, match="native"):
        make(backend="casadi")


def test_fields_are_checked_by_name():
    with pytest.raises(TypeError, match="stiffness"):
        make(randomize={"stiffness": (1, 2)})
    assert make(randomize=Randomization(rigidity=(1, 2))).unwrapped.settings.randomize.rigidity == (1, 2)
