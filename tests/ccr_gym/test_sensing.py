"""Each imperfection against its definition, computed here from the hidden state or from a twin without it."""

from dataclasses import asdict

import gymnasium
import numpy as np
import pytest
from comparison import same

import ccr_gym
from ccr_gym import FORCE_SPAN, Sensing
from ccr_gym.sampling import is_test_draw
from ccr_gym.scales import TENSION_SPAN
from ccr_gym.sensing import EXACT
from solver import Circle, Robot, Scene, Solver
from solver.spatial import SpatialSolver

IDS = sorted(ccr_gym.ENV_IDS)
EVERY_ID = pytest.mark.parametrize("env_id", IDS)
BY_ESTIMATE = [env_id for env_id in IDS if "Paper" in env_id]  # whose regulated force is the estimate
FAR = [Circle(center=(-100.0, y), radius=12.0) for y in (100.0, 150.0)]  # out of the robot's reach
SENSED = ("free_tension", "lever", "tension")  # entries that only sensing which is not ideal has
DELAYED = ("nodes", "frames", "force_measured", "force_error")


def only(**imperfections):
    """Return a sensing that has some imperfections of given sizes and no others."""
    return asdict(EXACT) | {name: np.broadcast_to(size, 2).tolist() for name, size in imperfections.items()}


def make(env_id="CCR/PushObstacle-v1", **kwargs):
    return gymnasium.make(env_id, disable_env_checker=True, **{"obs_mode": "dict", **kwargs}).unwrapped


def make_vec(env_id, count, **kwargs):
    kwargs = {"max_episode_steps": 10**6, "obs_mode": "dict", **kwargs}
    return gymnasium.make_vec(env_id, count, vectorization_mode="vector_entry_point", **kwargs)


def play(env, seed=3, steps=40):
    """Return observations and infos of random steps that mostly pull."""
    generator = np.random.default_rng(0)
    record = [env.reset(seed=seed)]
    for _ in range(steps):
        observation, _, _, _, info = env.step(generator.uniform(-0.3, 1, env.action_space.shape).astype(np.float32))
        record.append((observation, info))
    return record


def given(env, actions):
    """Return observations and infos of actions that all commands share; in the plane nothing is in reach."""
    planar = isinstance(env.settings.robot, Robot)
    record = [env.reset(seed=0, options={"scene": FAR, "desired_force": 0.1} if planar else None)]
    for action in actions:
        observation, _, _, _, info = env.step(np.full(env.action_space.shape, action, np.float32))
        record.append((observation, info))
    return record


@EVERY_ID
def test_exact_imperfections_are_ideal(env_id):
    ideal, exact = (play(make(env_id, sensing=sensing)) for sensing in ("ideal", EXACT))
    unlike = {"contact", "force_est"} if "Moving" in env_id else set()  # the model's obstacle stays where it began
    if env_id in BY_ESTIMATE:  # their estimate knows the onset of contact to a step
        unlike = {"force_est", "force_measured", "force_error"}
    for (observed, info), (other, other_info) in zip(ideal, exact, strict=True):
        shared = {"share"} if "Braced" in env_id else set()  # among two obstacles
        assert other.keys() - observed.keys() == set(SENSED) | shared
        for key in observed.keys() - unlike:
            assert other[key] == pytest.approx(observed[key], abs=2e-6), key
        for key in unlike - {"contact"}:
            assert other[key] == pytest.approx(observed[key], abs=0.2), key
        assert np.array_equal(other_info["force_true"], info["force_true"])


@EVERY_ID
def test_cables_follow_motors_over_their_play(env_id):
    """A cable is dragged along by the nearer end of its play, and rests between them."""
    env = make(env_id, sensing=only(backlash=0.2))
    actions, half = env.action_spec, 0.1 * env.settings.scales.travel_mm
    low, high, cables = actions.low_mm, actions.high_mm, np.arange(actions.size) < actions.commands
    rested = moved = 0
    for seed in range(4):
        env.reset(seed=seed)
        generator, before = np.random.default_rng(seed), env.privileged_state
        for _ in range(60):
            action = np.clip(generator.normal(0.2, 0.8, actions.size), -1, 1).astype(np.float32)
            observation, *_, info = env.step(action)
            state = env.privileged_state
            motor = np.clip(before.motor_mm + action * actions.increment_mm, low, high)
            assert state.motor_mm == pytest.approx(motor, abs=1e-9)
            assert state.half_backlash_mm == pytest.approx(half * cables)
            expected = before.actuated_mm.copy()
            for k, (cable, slack) in enumerate(zip(before.actuated_mm, half * cables, strict=True)):
                if motor[k] - cable > slack:
                    expected[k] = motor[k] - slack
                elif cable - motor[k] > slack:
                    expected[k] = motor[k] + slack
            if info["solver_status"] == 0:
                assert state.actuated_mm == pytest.approx(np.clip(expected, low, high), abs=1e-9)
            read = np.concatenate([observation[key] for key in ("cable", "length") if key in observation])
            assert read * np.maximum(-low, high) == pytest.approx(motor, abs=1e-5)  # encoders read the motors
            rested += int((state.actuated_mm[cables] == before.actuated_mm[cables]).sum())
            moved += int((state.actuated_mm[cables] != before.actuated_mm[cables]).sum())
            before = state
    assert min(rested, moved) >= 20


def test_a_reversal_takes_up_the_play_first():
    env = make(sensing=only(backlash=0.05))  # 0.4 mm
    env.reset(seed=0)
    moved = [env.step(np.full(1, action, np.float32))[4]["cable_mm"] for action in (1, 1, -0.4, -0.4, -0.4)]
    assert moved == pytest.approx([0.3, 0.8, 0.8, 0.8, 0.6])


@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/LoadCell-Paper-v1", "CCR/SpatialPush-v1"])
def test_load_cells_read_a_hysteresis_of_the_tension(env_id):
    """The reading jumps by 1/(1 − η)² where a cable reverses, and stays on its branch while the cable rests."""
    loss, ratio, zero = 0.2, 1.5, 0.03
    env = make(env_id, sensing=only(tendon_loss=loss, rigidity_ratio=ratio, tension_zero=zero))
    record = given(env, [1.0] * 12 + [0.0] * 3 + [-1.0] * 8 + [0.0] * 3 + [1.0] * 4)
    unit = env.settings.scales.tension_n
    read, tensions, cables = (
        np.array([np.atleast_1d(entry) for entry in entries])
        for entries in (
            [o["tension"] * TENSION_SPAN * unit for o, _ in record],
            [info["tension"] for _, info in record],
            [info["cable_mm"] for _, info in record],
        )
    )
    zeros = read[0] - ratio * tensions[0]  # at rest nothing is pulled
    assert np.abs(zeros) == pytest.approx(np.full(read.shape[1], zero * unit), abs=1e-5 * unit)
    direction, branches = np.ones(read.shape[1]), np.zeros(2, int)
    for k in range(1, len(read)):
        change = cables[k] - cables[k - 1]
        direction = np.where(change == 0, direction, np.sign(change))
        expected = ratio * tensions[k] * np.where(direction > 0, 1 / (1 - loss), 1 - loss)
        assert read[k] - zeros == pytest.approx(expected, abs=2e-6 * TENSION_SPAN * unit)
        branches += (tensions[k] > 0.1 * unit) @ np.array([direction > 0, direction < 0]).T
    assert (branches >= 8).all()


@EVERY_ID
def test_a_command_that_rests_keeps_the_direction_of_its_cables(env_id):
    env = make(env_id, sensing=only(tendon_loss=0.3))
    read = [observation["tension"] for observation, _ in given(env, [1.0] * 6 + [-0.3] + [0.0] * 8)]
    for later in read[8:]:
        assert later == pytest.approx(read[7], abs=1e-6)


@EVERY_ID
@pytest.mark.parametrize("steps", [1, 4])
def test_only_what_is_seen_or_felt_comes_late(env_id, steps):
    kwargs = only(force_noise=0.05, force_bias=0.1, angle_noise=0.01, place_error=0.002, tension_noise=0.01)
    now, late = (play(make(env_id, sensing={**kwargs, "latency": [k, k]})) for k in (0, steps))
    assert {"nodes", "force_measured", "force_error", "contact", "force_est", "tension"} < late[0][0].keys()
    for k, (observed, info) in enumerate(late):
        for key, value in observed.items():
            then = max(k - steps, 0) if key in DELAYED else k
            assert np.array_equal(value, now[then][0][key]), key
        same(info, now[k][1])


def test_rigidity_scales_forces_and_tensions_and_keeps_shapes():
    soft, stiff = (play(make(sensing=only(rigidity_ratio=ratio))) for ratio in (0.5, 2.0))
    touched = False
    for (observed, info), (other, other_info) in zip(soft, stiff, strict=True):
        assert np.array_equal(observed["nodes"], other["nodes"])
        assert other_info["force_true"] == pytest.approx(4 * info["force_true"])
        assert other["tension"] == pytest.approx(4 * observed["tension"], rel=1e-6)
        assert other_info["force_est"] == pytest.approx(4 * info["force_est"], rel=0.01)  # learnt, with a prior of 1
        touched |= bool(info["force_true"].any())
    assert touched


@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/SoftObstacle-v1"])
def test_the_force_sensor_reads_whole_steps(env_id, noise):
    step, bias, steps_read = 0.06, 0.1, set()
    env = make(env_id, sensing=only(force_resolution=step, force_noise=noise, force_bias=bias))
    for observation, info in play(env):
        read = observation["force_measured"] * FORCE_SPAN / step
        assert read == pytest.approx(np.round(read), abs=1e-4)
        steps_read |= set(np.round(read).astype(int).tolist())
        if not noise:
            away = np.abs(read * step - info["force_true"] / env.settings.scales.force_n)
            assert (away >= bias - step / 2 - 1e-6).all()  # the bias, and half a step either way
            assert (away <= bias + step / 2 + 1e-6).all()
    assert len(steps_read) > 8


def test_errors_are_constant_in_an_episode_and_of_either_sign():
    count, zero, bias = 200, 0.03, 0.1
    env = make_vec("CCR/PushObstacle-v1", count, sensing=only(tension_zero=zero, force_bias=bias))
    read = [env.reset(seed=0)[0]]
    read += [env.step(np.zeros((count, 1), np.float32))[0] for _ in range(5)]
    for key, size, numbers in (("tension", zero / TENSION_SPAN, 1), ("force_measured", bias / FORCE_SPAN, 2)):
        values = np.array([observation[key] for observation in read])  # nothing is pulled and nothing touches
        assert np.array_equal(values, np.broadcast_to(values[0], values.shape))
        assert np.abs(values[0]) == pytest.approx(np.full((count, numbers), size), rel=1e-5)
        assert (values[0] > 0).mean() == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(count * numbers))
    again = env.reset()[0]
    assert not np.array_equal(again["tension"], read[0]["tension"])  # each episode has its own


def towards(observation):
    """Return the commands that bend a robot in space towards its obstacle, 1 in the plane, where a pull does."""
    sideways = observation.get("obstacle", np.ones(1))[:2]
    return sideways / np.abs(sideways).max()


@EVERY_ID
def test_contact_flags_are_those_of_the_nominal_robot_at_the_encoders(env_id):
    env = make(env_id, sensing="realistic")
    touched = 0
    for seed in range(3):
        observation, _ = env.reset(seed=seed)
        robot, scene = env.settings.robot, env.equilibrium.scene
        solver = (Solver if isinstance(robot, Robot) else SpatialSolver)(robot, scene)
        model, generator = solver.rest(), np.random.default_rng(seed)
        aim = towards(observation)
        for _ in range(40):
            action = (aim * generator.uniform(-0.3, 1, env.action_space.shape)).astype(np.float32)
            observation, *_ = env.step(action)
            motors, commands = env.privileged_state.motor_mm, env.action_spec.commands
            model = solver.step(model, env.settings.actuation.cables_mm(motors[:commands]), *motors[commands:])
            assert np.array_equal(observation["contact"], model.contact.any(axis=0).ravel())
            touched += int(model.contact.any())
    assert touched >= 10


@EVERY_ID
def test_without_a_force_sensor_the_rest_is_the_same(env_id):
    realistic, blind, flagged = (
        play(make(env_id, **kwargs))
        for kwargs in (
            {"sensing": "realistic"},
            {"sensing": "sensorless"},
            {"sensing": "realistic", "force_sensor": False},
        )
    )
    for (all_of_it, info), (observed, other_info), (other, _) in zip(realistic, blind, flagged, strict=True):
        assert all_of_it.keys() - observed.keys() == {"force_measured", "force_error"}
        same(observed, {key: all_of_it[key] for key in observed})
        same(other, observed)
        same(other_info, info)


@EVERY_ID
@pytest.mark.parametrize("sensing", ["realistic", "sensorless"])
def test_vector_and_single_environments_agree(env_id, sensing):
    kwargs = {"sensing": sensing, "obs_mode": "flat", "max_episode_steps": 17}
    ours = gymnasium.make_vec(env_id, 3, vectorization_mode="vector_entry_point", **kwargs)
    theirs = gymnasium.make_vec(env_id, 3, vectorization_mode="sync", **kwargs)
    assert ours.observation_space == theirs.observation_space
    assert np.array_equal(ours.reset(seed=5)[0], theirs.reset(seed=5)[0])
    generator = np.random.default_rng(1)
    for _ in range(60):
        actions = generator.uniform(-0.4, 1, ours.action_space.shape).astype(np.float32)
        our, their = ours.step(actions), theirs.step(actions)
        assert all(np.array_equal(one, other) for one, other in zip(our[:4], their[:4], strict=True))
        for key in ("force_true", "force_est", "tension", "solver_status"):
            assert np.array_equal(our[4][key], their[4][key]), key


@EVERY_ID
@pytest.mark.parametrize("sensing", ["ideal", "realistic"])
def test_privileged_states_and_probes_agree_with_single_environments(env_id, sensing):
    envs = gymnasium.make_vec(env_id, 3, vectorization_mode="vector_entry_point", sensing=sensing)
    singles, generator = [make(env_id, sensing=sensing) for _ in range(3)], np.random.default_rng(1)
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


def scenes_of(env, seeds=12):
    """Return the parameters of the scenes of some seeds."""
    found = []
    for seed in range(seeds):
        env.reset(seed=seed)
        found.append(env.equilibrium.scene.parameters)
    return found


@EVERY_ID
def test_a_seed_has_the_same_scenes_whatever_is_sensed(env_id):
    """Rigidity and play decide which scenes can be played; all else leaves them alone."""
    mechanics = {"rigidity_ratio": [1, 1], "backlash": [0, 0]}
    ideal, seen, blind = (scenes_of(make(env_id, sensing=s)) for s in ("ideal", mechanics, "sensorless"))
    realistic = scenes_of(make(env_id, sensing="realistic"))
    assert ideal == seen
    assert realistic == blind
    assert sum(one == other for one, other in zip(ideal, realistic, strict=True)) >= 6


@EVERY_ID
def test_training_and_test_scenes_are_disjoint(env_id):
    scenes = {split: scenes_of(make(env_id, split=split)) for split in ("train", "test", "all")}
    assert not set(scenes["train"]) & set(scenes["test"])
    assert set(scenes["all"]) & set(scenes["train"])


@pytest.mark.parametrize("robot", ["guidewire", "snake-arm"])
def test_the_split_of_a_scene_does_not_depend_on_the_robots_size(robot):
    for split in ("train", "test"):
        scenes = []
        for robot_or_default in (robot, None):
            env = make(split=split, robot=robot_or_default, task={"force": (0.1, 0.1)})
            length = env.settings.scales.length_mm
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
        ({"sensing": {"force_noise": [0.2, 0.1]}}, "force_noise is"),
        ({"sensing": {"angle_noise": [0.0, 1.1]}}, "angle_noise is"),
        ({"sensing": {"tension_zero": [0.0, 1e30]}}, "tension_zero is .* from 0 to 1000000"),
        ({"sensing": {"tension_noise": [1e7, 1e7]}}, "tension_noise is .* from 0 to 1000000"),
        ({"sensing": {"rigidity_ratio": [0.0, 1.0]}}, "rigidity_ratio is"),
        ({"split": "validation"}, "split is"),
    ],
)
def test_invalid_ranges_are_refused(kwargs, message):
    with pytest.raises(ValueError, match=message):
        make(**kwargs)


@pytest.mark.parametrize("sensing", ["realistic", "sensorless"])
def test_names_stand_for_the_default_ranges(sensing):
    assert make(sensing=sensing).settings.sensors == Sensing()
    assert make().settings.sensors is None


@pytest.mark.parametrize("sensing", ["realistic", EXACT])
def test_the_share_is_that_of_the_nominal_model_at_the_encoder(sensing):
    env = make("CCR/BracedPush-v1", sensing=sensing)
    shares = []
    for seed in range(6):
        scene = env.task.sample(env.settings.robot, np.random.default_rng(seed)).scene
        observation, _ = env.reset(seed=seed, options={"scene": list(scene), "desired_force": 0.1})
        model = Solver(env.settings.robot, scene)
        state = model.rest()
        for _ in range(40):
            sizes = np.linalg.norm(state.forces, axis=1)
            assert observation["share"] == pytest.approx(sizes[1] / max(sizes.sum(), 1e-300), abs=1e-5)
            shares.append(float(observation["share"][0]))
            observation, *_ = env.step(np.array([0.7], np.float32))
            state = model.step(state, *env.privileged_state.motor_mm)
    assert {0.0, 1.0} <= set(shares)
    assert any(0.1 < share < 0.9 for share in shares)


@pytest.mark.parametrize("env_id", [env_id for env_id in IDS if "Spatial" not in env_id])
def test_what_the_free_nominal_robot_needs_is_that_of_an_own_solver(env_id):
    """What the tension has beyond it, over the lever, is the estimate of the contact force."""
    env, others = make(env_id, sensing=only(latency=3)), [*BY_ESTIMATE, "CCR/BracedPush-v1"]  # which has two forces
    unit = TENSION_SPAN * env.settings.scales.tension_n
    env.reset(seed=2)
    solver = Solver(env.settings.robot, Scene())
    free, touched, generator = solver.rest(), 0, np.random.default_rng(0)
    for _ in range(50):
        action = generator.uniform(-0.2, 1, env.action_space.shape).astype(np.float32)
        observation, *_, info = env.step(action)
        free = solver.step(free, *env.privileged_state.motor_mm)
        assert observation["free_tension"] * unit == pytest.approx(free.tensions, abs=1e-5 * unit)
        if not observation["contact"].any():
            assert observation["lever"] == 0
        elif observation["lever"][0] > 0.05 and env_id not in others:
            lacking = max(observation["tension"][0] - observation["free_tension"][0], 0.0)  # the rigidity is known
            estimate = lacking / observation["lever"][0] * FORCE_SPAN * env.settings.scales.force_n
            assert np.linalg.norm(info["force_est"]) == pytest.approx(estimate, rel=0.02)
            touched += 1
    assert touched >= 10 or env_id in others
