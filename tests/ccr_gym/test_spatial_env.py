"""The environment in space: force vectors as set-points, obstacle features, settings."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from ccr_gym import EXACT, FORCE_SPAN, SpatialPushEnv
from solver import Circle, Scene
from solver.spatial import Cylinder, Sphere

VECTOR = {"task": {"force_vector": True}}


def make(**kwargs):
    return gymnasium.make("CCR/SpatialPush-v1", disable_env_checker=True, **{"obs_mode": "dict", **kwargs})


def test_docstring_lists_the_indices_of_the_flat_observation():
    env = make(obs_mode="flat")
    flat, _ = env.reset(seed=0)
    columns, start = {}, 0
    for key, box in make().observation_space.items():
        columns[key] = (start, start + box.shape[0] - 1)
        start += box.shape[0]
    assert flat.shape == (283,)
    for key, (first, last) in columns.items():
        ends = f"{first}–{last}" if last > first else f"{first}"
        assert f"{ends} | `{key}`" in SpatialPushEnv.__doc__ or key == "contact"


def test_observation_matches_the_equilibrium():
    env = make()
    kinds = set()
    for seed in range(8):
        observation, _ = env.reset(seed=seed)
        observation, *_ = env.step(np.array([0.8, -0.4], np.float32))
        equilibrium = env.unwrapped.equilibrium
        obstacle = equilibrium.scene.obstacles[0]
        kinds.add(type(obstacle))
        seen = observation["obstacle"]
        assert 180 * seen[:3] == pytest.approx(obstacle.extent.center, abs=1e-4)
        assert 20 * seen[6] == pytest.approx(obstacle.radius, abs=1e-5)
        axis = np.zeros(3) if isinstance(obstacle, Sphere) else np.subtract(obstacle.end, obstacle.start) / 60
        assert seen[3:6] == pytest.approx(axis, abs=1e-6)
        assert 180 * observation["nodes"].reshape(-1, 3) == pytest.approx(equilibrium.nodes, abs=1e-4)
        axes = observation["frames"].reshape(-1, 2, 3)
        assert axes[:, 0] == pytest.approx(equilibrium.frames[:, :, 0], abs=1e-6)
        assert axes[:, 1] == pytest.approx(equilibrium.frames[:, :, 2], abs=1e-6)
        assert 14 * observation["cable"] == pytest.approx(equilibrium.cables_mm[:2], abs=1e-6)
    assert kinds == {Sphere, Cylinder}


def test_vector_set_points_are_forces_that_a_ramp_ends_with():
    env = make(**VECTOR)
    most = FORCE_SPAN * env.unwrapped.settings.scales.force_n
    for seed in range(5):
        observation, info = env.reset(seed=seed)
        goal = info["desired_force"]
        assert goal.shape == (3,)
        assert 0.06 <= np.linalg.norm(goal) <= most
        assert most * observation["desired_force"] == pytest.approx(goal, abs=1e-7)
        assert most * observation["force_error"] == pytest.approx(goal, abs=1e-7)
        _, _, _, _, info = env.step(np.zeros(2, np.float32))
        assert info["reward_force_error"] == -1
    x, y, z = goal
    scene = env.unwrapped.equilibrium.scene
    observation, info = env.reset(options={"scene": scene, "desired_force": (x, y, z)})
    assert info["desired_force"] == pytest.approx(goal)
    with pytest.raises(ValueError, match="of shape"):
        env.reset(options={"scene": scene, "desired_force": 0.1})


def test_vector_environment_agrees_with_single_ones():
    ours = gymnasium.make_vec(
        "CCR/SpatialPush-v1", 3, vectorization_mode="vector_entry_point", obs_mode="dict", **VECTOR
    )
    theirs = gymnasium.make_vec("CCR/SpatialPush-v1", 3, vectorization_mode="sync", obs_mode="dict", **VECTOR)
    (our, our_infos), (their, their_infos) = ours.reset(seed=4), theirs.reset(seed=4)
    generator = np.random.default_rng(0)
    for _ in range(70):
        for key, value in their.items():
            assert np.array_equal(our[key], value)
        assert np.array_equal(our_infos["desired_force"], their_infos["desired_force"])
        actions = generator.uniform(-1, 1, (3, 2)).astype(np.float32)
        our, our_rewards, *_, our_infos = ours.step(actions)
        their, their_rewards, *_, their_infos = theirs.step(actions)
        assert np.array_equal(our_rewards, their_rewards)


def test_robot_and_backend_are_validated():
    assert len(make().unwrapped.settings.robot.cables) == 4
    robot = {"length_mm": 180.0, "segments": 12, "offset_mm": 8.0, "angle": 2.0, "between": 1}
    observation, _ = make(robot=robot, model="paper").reset(seed=0)
    assert observation["nodes"].shape == (39,)
    with pytest.raises(ValueError, match="in space it must be 'native'"):
        make(backend="casadi")
    with pytest.raises(ValueError, match="not in the plane"):
        make().reset(options={"scene": Scene([Circle(center=(44, 104), radius=15)]), "desired_force": 0.1})


@pytest.mark.parametrize("estimator", ["contact", "paper"])
@pytest.mark.parametrize("sensing", ["ideal", replace(EXACT, tendon_loss=(0.2, 0.2), rigidity_ratio=(1.5, 1.5))])
def test_the_papers_robot_senses_and_estimates_alike_in_all_quadrants(estimator, sensing):
    """One displacement of its model is of a pair of opposite cables, of which the sign tells the one that is pulled."""
    env = gymnasium.make("CCR/SpatialPush-Paper-v1", estimator=estimator, sensing=sensing).unwrapped
    slices, records = env.observation_slices, []
    for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
        scene = [Sphere(center=(35.0 * x, 35.0 * y, 120.0), radius=15)]
        env.reset(seed=0, options={"scene": scene, "desired_force": 0.1})
        pulls = [1.0] * 25 + [-0.3] * 3 + [0.3] * 3
        steps = [env.step(np.array([x * pull, y * pull], np.float32)) for pull in pulls]
        rows = np.array([observation[slices["tension"]] for observation, *_ in steps]) if "tension" in slices else 0.0
        forces = [[np.linalg.norm(info[key]) for key in ("force_true", "force_est")] for *_, info in steps]
        records.append((np.array(forces), rows))
    assert records[0][0].min(axis=0) == pytest.approx(0)
    assert (records[0][0].max(axis=0) > 0).all()
    for forces, rows in records[1:]:
        assert forces == pytest.approx(records[0][0], abs=1e-6)
        assert rows == pytest.approx(records[0][1], abs=1e-6)


@pytest.mark.parametrize("weight", [(1e-12, 0.0, 0.0), (5e-5, 0.0, 0.0), (0.0, 5e-5, 0.0)])
def test_a_robot_that_hangs_in_a_cable_finds_scenes(weight):
    """A cable that holds the robot at rest is at its length to roundoff, of either sign."""
    env = make(robot=replace(make().unwrapped.settings.robot, weight_per_length=weight))
    for seed in range(3):
        env.reset(seed=seed)
