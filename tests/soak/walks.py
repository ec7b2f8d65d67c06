"""Random walks: ways to pull, release and insert, and the states they lead to."""

from typing import NamedTuple

import numpy as np

from soak.cores import line_points
from soak.drives import drives_of
from solver import Robot, Status

SIGNED = 0.8  # share of the moves of several cables that are signed commands
IN_VAIN = 10  # steps given up on in a row after which a walk ends: it would go on so, from a robot folded over


class Walk(NamedTuple):
    """Commands of a walk and its states."""

    states: list
    commands: np.ndarray  # (T, cables + 1) [mm], the length last


class Numbers(NamedTuple):
    """Numbers of the states of a walk, read from all of their blocks at once.

    Attributes:
        blocks: The blocks, ``(k, size)``.
        work: Factorisations, ``(k,)``.
        gaps: Gaps, ``(k, m, p, positions)`` [mm].
        touching: Whether any point touches an obstacle, ``(k,)`` bool.
        tensions: Tensions of the cables, ``(k, c)`` [N].
        points: The points that can touch, ``(k, p, positions, d)`` [mm].
        displacements: Displacements of the obstacles, ``(k, m, d)`` [mm].
    """

    blocks: np.ndarray
    work: np.ndarray
    gaps: np.ndarray
    touching: np.ndarray
    tensions: np.ndarray
    points: np.ndarray
    displacements: np.ndarray

    @classmethod
    def of(cls, states):
        """Return the numbers of states of one robot and scene."""
        robot, layout = states[0].robot, states[0]._layout
        blocks = np.stack([state.block for state in states])
        frames = None if isinstance(robot, Robot) else layout.frames(blocks)
        return cls(
            blocks=blocks,
            work=np.array([state.factorizations for state in states]),
            gaps=layout.gaps(blocks),
            touching=(layout.multipliers(blocks) > 0).any(axis=(1, 2, 3)),
            tensions=layout.tensions(blocks),
            points=line_points(robot, layout.nodes(blocks), frames),
            displacements=layout.displacements(blocks),
        )


def walk(solver, increments):
    """Walk by increments on what the robot has reached, clipped to its range.

    Each is a pair of a drive and a move of its inputs, the length last. A walk that gets nowhere ends early.
    """
    states, commands = [solver.rest()], []
    for drive, increment in increments:
        reached = command_of(states[-1])
        command = np.append(drive.pulls(reached[:-1], increment[:-1]), reached[-1] + increment[-1])
        commands.append(_in_range(solver.robot, command))
        states.append(step(solver, states[-1], commands[-1]))
        if all(state.status == Status.GAVE_UP for state in states[-IN_VAIN:]):
            break
    return Walk(states, np.reshape(commands, (-1, len(solver.robot.cables) + 1)))


def replay(solver, commands):
    """Return the walk of commands ``(T, cables + 1)`` from rest."""
    states = [solver.rest()]
    for command in commands:
        states.append(step(solver, states[-1], command))
    return Walk(states, np.asarray(commands))


def step(solver, state, command):
    """Return the equilibrium after one step to a command (cables, length)."""
    if isinstance(solver.robot, Robot):
        return solver.step(state, command[:-1], float(command[-1]))
    return solver.step(state, command[:-1])


def command_of(state):
    """Return the present cable displacements and length of a state, ``(cables + 1,)`` [mm]."""
    return np.array([*state.cables_mm, state.length_mm])


def _in_range(robot, command):
    cables = np.clip(command[:-1], robot.least_cable_mm, robot.cable_limit_mm)
    return np.array([*cables, np.clip(command[-1], robot.shortest_mm, robot.longest_mm)])


def sample_increments(generator, solver, scale, steps):
    """Return moves in several ways in turn, a list of (drive, increments of its inputs and of the length [mm])."""
    rows, calm = [], generator.random() < 0.6
    drives = drives_of(generator, solver.robot)
    while len(rows) < steps:
        count, sizes = int(generator.integers(3, 31)), _sizes(generator, calm)
        drive = drives[0] if len(drives) == 1 or generator.random() < SIGNED else drives[1]
        direction = _direction(generator, solver, drive)
        insertion = _insertion(generator) if getattr(solver.robot, "length_range_mm", None) else lambda: 0.0
        rows += [(drive, scale * np.array([*(sizes() * direction), insertion()])) for _ in range(count)]
    return rows[:steps]


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


def _direction(generator, solver, drive):
    """Return the direction of the inputs, in space that of the first two mostly towards an obstacle."""
    planar = isinstance(solver.robot, Robot)
    if planar and drive.inputs == 1 and solver.robot.least_cable_mm == 0:
        return np.ones(1)
    if planar or (drive.matrix is None and solver.robot.model == "rod"):
        towards = generator.normal(size=drive.inputs)
        if generator.random() < 0.3:
            towards = np.abs(towards)
    elif generator.random() < 0.3 or not len(solver.scene):
        towards = generator.normal(size=drive.inputs)
    else:
        towards = np.array(solver.scene.obstacles[generator.integers(len(solver.scene))].extent.center[:2])
        towards = np.append(towards, np.linalg.norm(towards) * generator.normal(size=drive.inputs - 2))
    return towards / np.linalg.norm(towards)


def _insertion(generator):
    way = generator.uniform(-2, 3)
    return [lambda: 0.0, lambda: way, lambda: generator.uniform(-3, 3), lambda: generator.uniform(-40, 40)][
        generator.choice(4, p=[0.4, 0.3, 0.2, 0.1])
    ]
