"""The commands of the sections that an observed shape tells."""

from collections.abc import Mapping

import numpy as np

from ccr_gym import Settings, SpatialSettings
from solver import Robot
from solver.spatial import SpatialRobot


def observed_commands(observation: Mapping[str, np.ndarray], settings: Settings | SpatialSettings) -> np.ndarray:
    """Return the commands of the sections that the observed shape tells, ``(..., commands)`` [a of the robot].

    A command is half of what a line of holes on the inner side is shorter than that on the outer side, which run
    straight from disk to disk: so errors of the disks' places, which both share, take themselves out. The backbone of
    the rod consists of arcs, which are longer than their chords; that of the paper's model of chords (eq. 5).

    Args:
        observation: The observation of one robot, or of many; where robots are random, its entry ``robot`` tells their
            offset and length, and without the entry they are taken to be the nominal ones.
        settings: Settings of the environment.
    """
    robot, (_, length, offset) = settings.robot, observed_ratios(observation, settings)
    nodes = observation["nodes"].astype(float).reshape(*observation["nodes"].shape[:-1], -1, 3)
    if isinstance(robot, Robot):
        points, sides = _planar_shape(nodes, settings.reach_mm)
    else:
        points = settings.reach_mm * nodes
        sides = _sides_in_space(observation["frames"].astype(float).reshape(*nodes.shape[:-1], 2, 3), robot)
    offset_mm, length_mm = robot.offset_mm * offset[..., None, None], robot.length_mm * length[..., None, None]
    holes = offset_mm[..., None] * sides
    ends = {robot.segments if cable.end is None else cable.end for cable in robot.cables}
    starts = [0] if robot.model == "paper" else [0, *sorted(ends)[:-1]]
    inner, outer = (_chords(points[..., None, :] + side * holes) for side in (1, -1))
    bends = (outer - inner) / (2 * offset_mm)
    commands = np.add.reduceat(bends, starts, axis=-2)
    if robot.model == "rod":
        turns = np.linalg.norm(bends, axis=-1, keepdims=True)
        longer = length_mm / robot.segments / offset_mm * (1 - np.sinc(turns / (2 * np.pi)))
        commands = commands + np.sign(commands) * np.add.reduceat(longer, starts, axis=-2)
    return np.asarray(commands.reshape(*nodes.shape[:-2], -1))


def observed_ratios(
    observation: Mapping[str, np.ndarray], settings: Settings | SpatialSettings
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rigidity, length and offset over the nominal ones, ``(...)`` each, 1 where nothing tells them."""
    if settings.randomize is None or "robot" not in observation:
        one = np.ones(observation["nodes"].shape[:-1])
        return one, one, one
    ratios = settings.randomize.ratios(observation["robot"].astype(float))
    return ratios[..., 0], ratios[..., 1], ratios[..., 2]


def _planar_shape(nodes: np.ndarray, reach_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points, and the side of the cable at every disk, ``(..., n + 1, 1, 2)``."""
    points, angles = reach_mm * nodes[..., :2], np.pi * nodes[..., 2]
    return points, np.stack([np.cos(angles), np.sin(angles)], axis=-1)[..., None, :]


def _sides_in_space(frames: np.ndarray, robot: SpatialRobot) -> np.ndarray:
    """Return the directions of both commands at every disk, ``(..., n + 1, 2, 3)``."""
    first, second = frames[..., 0, :], np.cross(frames[..., 1, :], frames[..., 0, :])
    angle = robot.angle if robot.model == "paper" else np.pi / 2
    return np.stack([first, np.cos(angle) * first + np.sin(angle) * second], axis=-2)


def _chords(points: np.ndarray) -> np.ndarray:
    """Return the distances of neighbours in lines of points, ``(..., n, lines)`` for ``(..., n + 1, lines, d)``."""
    return np.asarray(np.linalg.norm(np.diff(points, axis=-3), axis=-1))
