"""Replays 20,000 fixed steps of every model and environment, and compares the bits with recorded checksums.

``python tests/replay.py`` compares with ``tests/data/replay.json``; ``--update`` records anew, which a change that is
meant to leave all numbers as they are must not need. The bits are those of one processor, compiler and library
version, so the recording names them.
"""

import argparse
import hashlib
import json
import platform
import re
import sys
from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np

import ccr_gym
from solver import Circle, HalfPlane, Polygon, Robot, Scene, Solver
from solver.spatial import Box, Cylinder, SpatialRobot, SpatialSolver, Sphere

RECORDED = Path(__file__).parent / "data" / "replay.json"
SOLVER_STEPS, SINGLE_STEPS, VECTOR_STEPS, ENVS = 2500, 350, 90, 4
INSERTED = replace(Robot.prototype(model="paper"), length_range_mm=(160.0, 200.0), between=1)
ROBOTS = {
    "paper": replace(Robot.prototype(model="paper"), model="paper"),
    "rod": replace(Robot.prototype(model="paper"), model="rod"),
    "insertion": INSERTED,
    "space": SpatialRobot.prototype(model="paper"),
}
STATE = ("nodes", "multipliers", "gaps", "forces", "displacements", "objective", "status", "factorizations")
FEATURES = ("avx", "avx2", "avx512f", "fma")


def machine() -> dict[str, str]:
    """What the last bits depend on."""
    cpu = Path("/proc/cpuinfo")
    found = re.search(r"^flags\s*:(.*)", cpu.read_text(), re.MULTILINE) if cpu.exists() else None
    flags = set(found[1].split()) if found else set()
    return {
        "processor": " ".join([platform.machine(), *(name for name in FEATURES if name in flags)]),
        "libc": " ".join(platform.libc_ver()),
        "compiler": platform.python_compiler(),
        "numpy": np.__version__,
        "gymnasium": gymnasium.__version__,
    }


def checksums() -> dict[str, str]:
    """Of the states of each model, and of what each environment returns."""
    sums = {name: _solver(name) for name in ROBOTS}
    for env_id in ccr_gym.ENV_IDS:
        for sensing in ("ideal", "realistic"):
            sums[f"{env_id} {sensing}"] = _single(env_id, sensing)
            sums[f"{env_id} {sensing} vector"] = _vector(env_id, sensing)
    return sums


def _solver(name: str) -> str:
    digest, generator, robot = hashlib.sha256(), np.random.default_rng(20), ROBOTS[name]
    steps = 0
    while steps < SOLVER_STEPS:
        solver = _sample_solver(robot, generator)
        state = solver.rest()
        for _ in range(min(125, SOLVER_STEPS - steps)):
            steps += 1
            state = _advance(solver, state, generator)
            _add(digest, *(getattr(state, name) for name in STATE))
    return digest.hexdigest()


def _sample_solver(robot, generator):
    kind = SpatialSolver if isinstance(robot, SpatialRobot) else Solver
    sample = _sample_in_space if kind is SpatialSolver else _sample_in_plane
    while True:
        scene = Scene([sample(generator) for _ in range(generator.integers(1, 4))])
        try:
            return kind(robot, scene)
        except ValueError:  # overlaps the unstressed robot
            continue


def _sample_in_plane(generator):
    center = generator.uniform((30, 70), (80, 155))
    radius = generator.uniform(8, 16)
    spring = generator.choice([None, 0.05])
    kind = generator.integers(3)
    if kind == 0:
        return HalfPlane(point=tuple(center + np.array([30.0, 0.0])), normal=(-1.0, generator.uniform(-0.3, 0.3)))
    if kind == 1:
        angles = np.sort(generator.uniform(0, 2 * np.pi, 3))
        corners = center + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return Polygon(corners=tuple(map(tuple, corners)), radius=2.0)
    return Circle(center=tuple(center), radius=radius, **_mounted(spring))


def _sample_in_space(generator):
    azimuth, height, radius = generator.uniform(-1, 1), generator.uniform(70, 155), generator.uniform(10, 16)
    distance = generator.uniform(30, 75)
    center = (distance * np.cos(azimuth), distance * np.sin(azimuth), height)
    kind = generator.integers(3)
    if kind == 0:
        way = np.array([0.0, 30.0, 6.0])
        return Cylinder(start=tuple(center - way), end=tuple(center + way), radius=radius, edge=3.0)
    if kind == 1:
        return Box(center=center, sizes=(20.0, 30.0, 20.0), edge=3.0)
    return Sphere(center=center, radius=radius, **_mounted(generator.choice([None, 0.05])))


def _mounted(spring):
    return {} if spring is None else {"spring": float(spring)}


def _advance(solver, state, generator):
    far = generator.random() < 0.02
    if isinstance(solver.robot, SpatialRobot):
        cables = state.cables_mm + generator.uniform(-0.3, 0.3, 2) + (0.15, 0.03)
        return solver.step(state, np.clip(generator.uniform(-8, 10, 2) if far else cables, -12, 12))
    cable = generator.uniform(0, 13) if far else state.cable_mm + generator.uniform(-0.4, 0.5)
    low, high = solver.robot.lengths_mm
    length = np.clip(state.length_mm + generator.uniform(-1, 1), low, high)
    return solver.step(state, float(np.clip(cable, 0, 14)), float(length))


def _single(env_id: str, sensing: str) -> str:
    env, digest = gymnasium.make(env_id, sensing=sensing), hashlib.sha256()
    observation, _ = env.reset(seed=3)
    env.action_space.seed(3)
    for _ in range(SINGLE_STEPS):
        observation, reward, terminated, truncated, info = env.step(_forward(env.action_space.sample()))
        _add(digest, observation, reward, terminated, truncated, info["force_true"], info["force_est"])
        if terminated or truncated:
            observation, _ = env.reset()
            _add(digest, observation)
    env.close()
    return digest.hexdigest()


def _vector(env_id: str, sensing: str) -> str:
    envs, digest = gymnasium.make_vec(env_id, num_envs=ENVS, sensing=sensing), hashlib.sha256()
    envs.reset(seed=5)
    envs.action_space.seed(5)
    for _ in range(VECTOR_STEPS):
        *returned, info = envs.step(_forward(envs.action_space.sample()))
        _add(digest, *returned, info["force_true"], info["force_est"])
    envs.close()
    return digest.hexdigest()


def _forward(actions: np.ndarray) -> np.ndarray:
    """Pull more than let out, so that most steps are in contact."""
    return np.clip(actions + np.float32(0.3), -1, 1)


def _add(digest, *values) -> None:
    for value in values:
        if isinstance(value, dict):
            _add(digest, *value.values())
            continue
        digest.update(np.ascontiguousarray(value, dtype=np.float64).tobytes())


def main() -> int:
    """Compare, or record; the number of checksums that differ."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--update", action="store_true", help="record the checksums instead of comparing with them")
    if parser.parse_args().update:
        RECORDED.write_text(json.dumps({"machine": machine(), "checksums": checksums()}, indent=1) + "\n")
        return 0
    recorded = json.loads(RECORDED.read_text())
    if recorded["machine"] != machine():
        print(f"recorded on another machine, whose bits may differ: {recorded['machine']}, here {machine()}")
    now = checksums()
    differ = [name for name in now | recorded["checksums"] if now.get(name) != recorded["checksums"].get(name)]
    print(f"{len(differ)} of {len(now)} checksums differ", *differ, sep="\n")
    return len(differ)


if __name__ == "__main__":
    sys.exit(main())
