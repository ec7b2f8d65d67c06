"""Helpers of the spatial solver's tests: sampled scenes and walks, and rotations about the base axis."""

import math

import numpy as np
import pytest

from solver import Scene
from solver.spatial import Box, Capsule, Cylinder, HalfSpace, SpatialRobot, SpatialSolver, Sphere


def turned(vectors, angle):
    """Return vectors (..., 3) turned about the base axis."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.asarray(vectors) @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])


def random_shape(generator):
    """Return an obstacle of any kind around the robot, sometimes on a spring."""
    azimuth, radius = generator.uniform(0, 2 * math.pi), generator.uniform(10, 16)
    outward = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    center = generator.uniform(35, 75) * outward + [0.0, 0.0, generator.uniform(75, 150)]
    axis, second = generator.normal(size=(2, 3))
    axis /= np.linalg.norm(axis)
    spring = float(np.exp(generator.uniform(-3, 1))) if generator.random() < 0.3 else None
    match generator.integers(5):
        case 0:
            return Sphere(center=center, radius=radius, spring=spring)
        case 1:
            return Capsule(start=center - 15 * axis, end=center + 15 * axis, radius=0.7 * radius, spring=spring)
        case 2:
            ends = {"start": center - 15 * axis, "end": center + 15 * axis}
            return Cylinder(**ends, radius=0.8 * radius, edge=2, spring=spring)
        case 3:
            sizes = generator.uniform(14, 30, 3)
            return Box(center=center, sizes=sizes, edge=2, axis=axis, second=second, spring=spring)
        case _:
            return HalfSpace(point=center, normal=0.3 * axis - outward, spring=spring)


def random_solver(generator, robot):
    """Return the solver of a robot among one to three obstacles that are clear of it at rest."""
    while True:
        try:
            return SpatialSolver(robot, Scene(random_shape(generator) for _ in range(generator.integers(1, 4))))
        except ValueError:
            continue


def random_walk(generator, solver, steps):
    """Return the states of a random walk of both cables, towards an obstacle, or anywhere, for fifty steps each."""
    states, limit = [solver.rest()], solver.robot.cable_limit_mm
    for k in range(steps):
        if k % 50 == 0:
            x, y, _ = solver.scene.obstacles[generator.integers(len(solver.scene))].extent.center
            towards = np.array([x, y]) / math.hypot(x, y) * generator.uniform(4, 10)
            goal = towards if generator.random() < 0.8 else generator.uniform(-8, 8, 2)
        pull = 0.06 * (goal - states[-1].cables_mm) + generator.uniform(-0.3, 0.3, 2)
        states.append(solver.step(states[-1], np.clip(states[-1].cables_mm + pull, -limit, limit)))
    return states


@pytest.fixture(scope="session", name="robot")
def robot_fixture():
    return SpatialRobot.prototype(model="paper")


@pytest.fixture(scope="session", name="turned")
def turned_fixture():
    return turned


@pytest.fixture(scope="session", name="random_solver")
def random_solver_fixture():
    return random_solver


@pytest.fixture(scope="session", name="random_walk")
def random_walk_fixture():
    return random_walk


@pytest.fixture(scope="session", name="walk")
def walk_fixture():
    """Return a function that follows commands one after the other."""

    def walk(solver, commands):
        equilibrium = solver.rest()
        for command in commands:
            equilibrium = solver.step(equilibrium, command)
        return equilibrium

    return walk
