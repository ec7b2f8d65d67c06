"""Whatever is passed to a public callable: a result, or a ValueError or TypeError that names the argument.

The callables are those that the packages list, so that a new one is not forgotten.
"""

import inspect
import math
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import torch
from gymnasium.error import Error as GymnasiumError
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import agents
import ccr_gym
import solver
from solver import Robot, Scene, spatial
from solver.common.operations import ARRAYS
from solver.planar.solve import Solver


class Idle:
    """A policy that does nothing."""

    def reset(self, env):
        """Take an environment."""

    def act(self, observation):
        """Return no move."""
        return np.zeros(1, np.float32)


PACKAGES = ("solver", "solver.spatial", "ccr_gym", "agents")
ENV_ID = "CCR/LoadCell-v1"
ROBOT = Robot(length_mm=180, segments=6, offset_mm=8, between=2)
SPATIAL_ROBOT = spatial.SpatialRobot(length_mm=180, segments=6, offset_mm=8, between=2)
SCENE = Scene([solver.Circle(center=(50, 110), radius=18)])
SPATIAL_SCENE = Scene([spatial.Sphere(center=(50, 0, 110), radius=18)])
SOLVER, SPATIAL_SOLVER = Solver(ROBOT, SCENE), spatial.SpatialSolver(SPATIAL_ROBOT, SPATIAL_SCENE)
PULLED = SOLVER.step(SOLVER.rest(), 7.0)
SPATIAL_PULLED = SPATIAL_SOLVER.step(SPATIAL_SOLVER.rest(), (7.0, 1.0))
MOTION = solver.free_motion(ROBOT, np.array(3.0), np.array(180.0))
OVAL = solver.Family.trace(lambda point, sizes: (point[0] / sizes[0]) ** 2 + (point[1] / sizes[1]) ** 2 - 1, sizes=2)
REPLAY = Path(__file__).parents[1] / "examples" / "estimate"
REPLAYED = agents.read_robot(REPLAY / "robot.json")
REPLAYED_SCENE = agents.read_scene(REPLAY / "scene.json", REPLAYED)
LOG = agents.read_log(REPLAY / "log.csv", REPLAYED)
OBSERVATION = ccr_gym.LoadCellEnv(obs_mode="dict").reset(seed=0)[0]
PLANE = {"robot": ROBOT, "scene": SCENE}
SPACE = {"robot": SPATIAL_ROBOT, "scene": SPATIAL_SCENE}
FREE = {"robot": ROBOT, "cable_mm": 3.0}
SIZES = {"length_mm": 180, "segments": 6, "offset_mm": 8}
BATCH = {"count": 2, "obstacles": 1}
PLAY = {"policy": Idle(), "env_id": ENV_ID, "seed": 0}

NUMBERS = (
    *(0, 1, -1, 3, 0.5, -0.0, 7.25, 1e3, 1e12, 1e155, 1.7e308, 1e-320, 10**400, math.nan, math.inf, -math.inf),
    *(True, None, "3", "", b"1", 1j, np.float32(2.5), np.int64(4), np.bool_(True), np.timedelta64(3, "s")),
)
OBJECTS = (
    *(object(), float, range(3), {1, 2}, (), [], {}, {"a": 1}, (1, 2), (1.0, 2.0, 3.0), [[1], [2, 3]], [None, 1j]),
    *(ROBOT, SPATIAL_ROBOT, SCENE, SPATIAL_SCENE, SOLVER, PULLED, SPATIAL_PULLED, MOTION),
    *(np.zeros(0), np.zeros(3), np.full(2, math.nan), np.full((2, 3), 1e308), np.zeros((2, 2), complex)),
    *(np.array(["a"]), np.array([None]), np.array(10**400), np.ones((1, 2, 3, 4), int), np.ones(3, bool)),
)
JUNK = st.sampled_from([*NUMBERS, *OBJECTS]) | st.floats() | st.integers(-5, 5)

# Good arguments of what checks its arguments, by package and name.
GOOD = {
    "solver.Actuation.of": {"robot": ROBOT, "space": 2},
    "solver.BatchSolver": {"robot": ROBOT, **BATCH},
    "solver.Cable": {"angle": 0.0, "offset_mm": 8.0, "end": 6},
    "solver.Capsule": {"start": (50, 110), "end": (80, 120), "radius": 18},
    "solver.Circle": {"center": (50, 110), "radius": 18},
    "solver.Custom": {"family": OVAL, "sizes": (20, 25), "center": (60, 110), "axis": (1, 0), "reach": 30},
    "solver.Ellipse": {"center": (60, 110), "radii": (18, 30), "axis": (1, 2)},
    "solver.Equilibrium": {**PLANE, "block": PULLED.block, "status": PULLED.status, "iterations": 1},
    "solver.Family": {"text": OVAL.text},
    "solver.Family.trace": {"function": lambda point, sizes: point[0] ** 2 + point[1] ** 2 - 9, "sizes": 0},
    "solver.HalfPlane": {"point": (50, 0), "normal": (-1, 0)},
    "solver.Load": {"node": 3, "force": (0.1, 0.0)},
    "solver.Polygon": {"corners": ((50, 80), (80, 80), (60, 120)), "radius": 16},
    "solver.Preset": {**SIZES, "rigidity": 5e3, "max_tension": 15.0, "source": "a"},
    "solver.ReferenceBatch": {"robot": ROBOT, **BATCH},
    "solver.ReferenceSolver": PLANE,
    "solver.RigidityFit.prior": {},
    "solver.Robot": SIZES,
    "solver.Robot.preset": {"name": "prototype"},
    "solver.Robot.prototype": {},
    "solver.Scene": {"obstacles": tuple(SCENE)},
    "solver.Sensitivity.rows": {"robot": ROBOT},
    "solver.Solver": PLANE,
    "solver.TransitionMemo": {"solver": SOLVER},
    "solver.Transmission.at_rest": {"cables": 1},
    "solver.VirtualWork": {"friction": 0.1, "fit_range_mm": (0.0, 4.0)},
    "solver.VirtualWork.calibrated": {"force": 1.0, "load": 1.0, "slopes": np.ones(3), "offset_mm": 8.0},
    "solver.clearance": {**PLANE, "cable_mm": 3.0},
    "solver.contact_estimate": {"nominal": PULLED, "tension": 1.0},
    "solver.fitted_slopes": {"robot": ROBOT, "low_mm": 0.0, "high_mm": 4.0},
    "solver.force_factor": {
        "robot": ROBOT,
        "motion": MOTION,
        "forces": solver.point_forces(PULLED),
        "tensions": np.ones(1),
        "rigidity_ratio": np.array(1.0),
    },
    "solver.force_true": {"equilibrium": PULLED},
    "solver.free_motion": {"robot": ROBOT, "cable_mm": np.array([3.0]), "length_mm": np.array([180.0])},
    "solver.free_nodes": FREE,
    "solver.free_tension": FREE,
    "solver.natural_frequency": {"robot": ROBOT, "mass_per_length": 0.05},
    "solver.quasi_static_rate": {"robot": ROBOT, "mass_per_length": 0.05},
    "solver.onset_tension": {"before": SOLVER.rest(), "now": PULLED},
    "solver.point_forces": {"equilibrium": PULLED},
    "solver.sensitivity": {"equilibrium": PULLED},
    "solver.shape_estimate": {"nominal": PULLED, "nodes": PULLED.nodes, "tension": 1.0},
    "solver.shape_motion": {"robot": ROBOT, "nodes": PULLED.nodes, "cable_mm": 7.0, "length_mm": 180.0},
    "solver.tip_slopes": FREE,
    "solver.virtual_work": {
        **{"x": np.ones(2), "y": np.ones(2), "load": np.ones(2), "slopes": np.ones((3, 2))},
        **{"offset_mm": 8.0, "operations": ARRAYS},
    },
    "solver.spatial.Box": {"center": (60, 0, 110), "sizes": (40, 45, 50), "edge": 3},
    "solver.spatial.Capsule": {"start": (50, -30, 110), "end": (50, 30, 120), "radius": 18},
    "solver.spatial.Cylinder": {"start": (50, -30, 110), "end": (50, 30, 120), "radius": 18, "edge": 2.0},
    "solver.spatial.HalfSpace": {"point": (50, 0, 0), "normal": (-1, 0, 0)},
    "solver.spatial.SpatialBatchSolver": {"robot": SPATIAL_ROBOT, **BATCH},
    "solver.spatial.SpatialEquilibrium": {
        **SPACE,
        **{"block": SPATIAL_PULLED.block, "status": SPATIAL_PULLED.status, "iterations": 1},
    },
    "solver.spatial.SpatialReferenceSolver": SPACE,
    "solver.spatial.SpatialRobot": SIZES,
    "solver.spatial.SpatialRobot.preset": {"name": "prototype"},
    "solver.spatial.SpatialRobot.prototype": {},
    "solver.spatial.SpatialSensitivity.rows": {"robot": SPATIAL_ROBOT},
    "solver.spatial.SpatialSolver": SPACE,
    "solver.spatial.SpatialVirtualWork": {"friction": 0.1},
    "solver.spatial.Sphere": {"center": (50, 0, 110), "radius": 18},
    "solver.spatial.force_true": {"equilibrium": SPATIAL_PULLED},
    "solver.spatial.sides": {"cables_mm": np.ones(2)},
    "solver.spatial.spatial_sensitivity": {"equilibrium": SPATIAL_PULLED},
    "solver.spatial.virtual_work": {"forces": np.ones(3), "loads": np.ones(2), "slopes": np.ones((2, 5))},
    "solver.spatial.with_friction": {"forces": np.ones(3), "slopes": np.ones((2, 3)), "friction": 0.1},
    "ccr_gym.ContactEnv": {"task": ccr_gym.LoadCell()},
    "ccr_gym.ContactVectorEnv": {"task": ccr_gym.LoadCell()},
    "ccr_gym.make_vector_env": {"task_name": "LoadCell"},
    "agents.DifferentiableVectorEnv": {
        "env": ccr_gym.make_vector_env("LoadCell", derivatives=True),
        "dtype": torch.float64,
    },
    "agents.ForceController": {},
    "agents.HarmonicController": {},
    "agents.LearnedPolicy": {"path": Path("nowhere")},
    "agents.MemoryVecEnv": {"venv": None},
    "agents.NewtonController": {},
    "agents.PredictiveController": {},
    "agents.RobotEstimator": {"settings": ccr_gym.Settings(), "count": 1},
    "agents.SB3VecEnv": {"env_id": ENV_ID, "n_envs": 1},
    "agents.differentiable": {"values": torch.ones((1, 1)), "equilibria": [PULLED], "rows": (0,)},
    "agents.measure": {"episode": None},
    "agents.reproduce": {"folder": None},
    "agents.run_episode": PLAY,
    "agents.run_episodes": {**PLAY, "count": 1},
    "agents.scores": {**PLAY, "count": 1},
    "agents.search": {"observation": OBSERVATION},
    "agents.trained": {"learner": "PPO", "env_id": ENV_ID},
}
ENVS = {name for name in ccr_gym.__all__ if name.endswith("Env")} - {"ContactEnv", "ContactVectorEnv"}
TASKS = {name.removesuffix("Env") for name in ENVS}
RANGES = {"Randomization", "RewardWeights", "Sensing", "InsertionSettings", "Settings", "SpatialSettings"}
GOOD |= {
    "agents.estimate_log": {
        **{"log": LOG.averaged(len(LOG.rows) // 8), "robot": REPLAYED, "scene": REPLAYED_SCENE},
        **{"instruments": agents.read_instruments(None, REPLAYED), "name": "log"},
    },
    "agents.read_instruments": {"path": None, "robot": REPLAYED},
    "agents.read_log": {"path": REPLAY / "log.csv", "robot": REPLAYED},
    "agents.read_robot": {"path": REPLAY / "robot.json"},
    "agents.read_scene": {"path": REPLAY / "scene.json", "robot": REPLAYED},
    "agents.robot_json": {"robot": ROBOT},
    "agents.scene_json": {"scene": SCENE},
}
GOOD |= {f"ccr_gym.{name}": {} for name in ENVS | TASKS | RANGES}
GOOD["agents.ForceController.proportional_only"] = GOOD["agents.NewtonController.knowing"] = {}
GOOD |= {f"agents.{name}.tuned": {"env_id": ENV_ID} for name in ("ForceController",)}
GOOD["ccr_gym.Scales.of"] = {"robot": ROBOT}
# What holds results, has no arguments, is abstract or a protocol, or reads and writes files with checks of their own.
UNCHECKED = {
    *("solver.Actuation", "solver.Extent", "solver.Motion", "solver.Optimality", "solver.Residuals", "solver.Rows"),
    *("solver.CommandSlopes", "solver.StepSlopes"),
    *("solver.RigidityFit", "solver.Sensitivity", "solver.Status", "solver.Trace", "solver.Transmission"),
    *("solver.Obstacle", "solver.held_signals", "solver.spatial.SpatialObstacle", "solver.spatial.SpatialSensitivity"),
    *("ccr_gym.ActionSpec", "ccr_gym.Assignment", "ccr_gym.PrivilegedState", "ccr_gym.Scales", "ccr_gym.Task"),
    *("ccr_gym.register_envs", "ccr_gym.check_packages", "ccr_gym.StepSlopes", "ccr_gym.StepSlopes.make"),
    *("agents.Episode", "agents.Knowledge", "agents.Metrics", "agents.Observation", "agents.Policy"),
}


OTHERS = {"solver.Custom": ("shape",), "agents.SB3VecEnv": ("num_envs",)}
OTHERS |= {
    "agents.estimate_log": ("obstacle",),
    "agents.read_log": ("column",),
    "agents.read_scene": ("shape",),
}  # further words that name what is wrong


def listed():
    """Return the public callables by name, and the class methods of those that are classes."""
    found = {}
    for package in PACKAGES:
        module = import_module(package)
        for name in module.__all__:
            value = getattr(module, name)
            if not callable(value):
                continue
            found[f"{package}.{name}"] = value
            if inspect.isclass(value):
                own = [key for key, member in vars(value).items() if isinstance(member, classmethod | staticmethod)]
                found |= {f"{package}.{name}.{key}": getattr(value, key) for key in own if key[0] != "_"}
    return found


LISTED = listed()


def test_every_public_callable_is_fuzzed():
    assert {*LISTED} == {*GOOD, *UNCHECKED}


@pytest.mark.parametrize("name", sorted(GOOD))  # sets have another order in every process
def test_what_is_passed_works_or_is_refused_by_name(name):
    call, good = LISTED[name], GOOD[name]
    kinds = inspect.signature(call).parameters.values()
    known = [kind.name for kind in kinds if kind.kind in (kind.POSITIONAL_OR_KEYWORD, kind.KEYWORD_ONLY)]

    @settings(
        max_examples=30 if name.startswith("solver") else 15, deadline=None, suppress_health_check=list(HealthCheck)
    )
    @given(st.sampled_from(known), JUNK)
    def run(argument, junk):
        try:
            call(**{**good, argument: junk})
        except (ValueError, TypeError) as error:
            assert named(error, argument)  # noqa: PT017 - a result is right, too
        except OSError:  # of a file that does not exist
            assert argument == "path"
        except GymnasiumError:  # of an id that is not registered
            assert argument == "env_id"

    def named(error, argument):
        """Return whether a message names an argument, or another that does not go with it."""
        return any(word in str(error) for word in (argument, *known, *OTHERS.get(name, ())))

    if known:
        run()
