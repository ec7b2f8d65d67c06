"""Random walks: ways to pull, release and insert, and the states they lead to."""

from typing import NamedTuple

import numpy as np

from solver import Robot


class Walk(NamedTuple):
    """Commands of a walk and its states."""

    states: list
    commands: np.ndarray  # (T, cables + 1) [mm], the length last


def walk(solver, increments):
    """Walk by increments ``(T, cables + 1)`` on what the robot has reached, clipped to its range."""
    states, commands = [solver.rest()], []
    for increment in increments:
        commands.append(_in_range(solver.robot, command_of(states[-1]) + increment))
        states.append(step(solver, states[-1], commands[-1]))
    return Walk(states, np.array(commands).reshape(-1, increments.shape[1]))


def replay(solver, commands):
    """Return the walk of commands ``(T, cables + 1)`` from rest."""
    states = [solver.rest()]
    for command in commands:
        states.append(step(solver, states[-1], command))
    return Walk(states, np.asarray(commands))


def step(solver, state, command):
    """Return the equilibrium after one step to a command (cables, length)."""
    if isinstance(solver.robot, Robot):
        return solver.step(state, float(command[0]), float(command[1]))
    return solver.step(state, command[:2])


def command_of(state):
    """Return the present cable displacements and length of a state, ``(cables + 1,)`` [mm]."""
    cables = [state.cable_mm] if isinstance(state.robot, Robot) else state.cables_mm
    return np.array([*cables, state.length_mm])


def _in_range(robot, command):
    high = robot.cable_limit_mm
    low, lengths = (0.0, robot.lengths_mm) if isinstance(robot, Robot) else (-high, 2 * (robot.length_mm,))
    return np.array([*np.clip(command[:-1], low, high), np.clip(command[-1], *lengths)])


def sample_increments(generator, solver, scale, steps):
    """Return increments of cables and length, in several ways of moving in turn, ``(steps, cables + 1)`` [mm]."""
    rows, calm = [], generator.random() < 0.6
    while len(rows) < steps:
        count, sizes = int(generator.integers(3, 31)), _sizes(generator, calm)
        direction = _direction(generator, solver)
        insertion = _insertion(generator) if getattr(solver.robot, "length_range_mm", None) else lambda: 0.0
        rows += [[*(sizes() * direction), insertion()] for _ in range(count)]
    return scale * np.array(rows[:steps])


def _sizes(generator, calm):
    """Return a way of moving the cables, in a calm episode only in small steps [mm]."""
    pull = generator.uniform(0.05, 1.0)
    ways = [
        lambda: generator.normal(0.05, 0.3),
        lambda: pull,
        lambda: pull * generator.uniform(0, 2),
        lambda: -pull,
        lambda: 0.1 * generator.choice([-1, 1]),
        lambda: generator.choice([-1e-3, 0.0, 1e-3]),
        lambda: generator.choice([-0.7, 1.0]) * generator.uniform(5, 11),
    ]
    weights = np.array([3, 5, 3, 3, 1, 1, 0 if calm else 5])
    return ways[generator.choice(len(ways), p=weights / weights.sum())]


def _direction(generator, solver):
    """Return the direction of the cables, in space mostly towards an obstacle."""
    if isinstance(solver.robot, Robot):
        return np.ones(1)
    if generator.random() < 0.3 or not len(solver.scene):
        towards = generator.normal(size=2)
    else:
        towards = np.array(solver.scene.obstacles[generator.integers(len(solver.scene))].extent.center[:2])
    return towards / np.linalg.norm(towards)


def _insertion(generator):
    way = generator.uniform(-2, 3)
    return [lambda: 0.0, lambda: way, lambda: generator.uniform(-3, 3), lambda: generator.uniform(-40, 40)][
        generator.choice(4, p=[0.4, 0.3, 0.2, 0.1])
    ]
