"""Latency and backlash of the motors, estimated from the observed shape with the exact geometry of the robot."""

from collections.abc import Mapping

import numpy as np

from agents.environment import EnvIndex
from solver import Robot
from solver.spatial import SpatialRobot

LATENCIES = 7  # candidates, in steps from 0
HALF_BACKLASHES = np.linspace(0.0, 0.05, 41)  # candidates [a]
TIE = 1e-9 * HALF_BACKLASHES  # errors at first: of pairs that explain a steady motion alike, the smallest backlash
ALL = slice(None)


class LagEstimator:
    """Estimates where the cables of many robots are now, from motor positions and delayed observations of the shape.

    All displacements are commands of the sections, in the offset a of the cables. Every pair of a latency and a
    backlash predicts, from the past of the motors, the displacements that are observed now; the pair with the smallest
    sum of squared errors so far is used.

    Args:
        count: Number N of robots.
        commands: Number of commands per robot.

    Attributes:
        latency: Delay of the observed shape in steps, ``(N,)``.
        half_backlash: Half of the backlash, ``(N,)`` [a].
        cables: Present displacements, ``(N, commands)`` [a].
        observed: Last observed displacements, ``(N, commands)`` [a].
    """

    def __init__(self, count: int, commands: int) -> None:
        self._predicted = np.zeros((count, LATENCIES, commands, HALF_BACKLASHES.size))  # latest first
        self._errors = np.zeros((count, LATENCIES, HALF_BACKLASHES.size)) + TIE
        self._fresh = np.ones(count, bool)
        self.latency, self.half_backlash = np.zeros(count, int), np.zeros(count)
        self.cables, self.observed = np.zeros((count, commands)), np.zeros((count, commands))

    def reset(self, index: EnvIndex = ALL) -> None:
        """Start new episodes of some robots."""
        self._errors[index], self._fresh[index] = TIE, True

    def update(self, motors: np.ndarray, observed: np.ndarray, index: EnvIndex = ALL) -> None:
        """Take in the next step of some robots.

        Args:
            motors: Motor positions, ``(k, commands)`` [a].
            observed: Observed displacements, ``(k, commands)`` [a].
            index: The robots.
        """
        motors, fresh = motors[:, :, None], self._fresh[index]
        predicted = self._predicted[index]
        predicted = np.where(fresh[:, None, None, None], motors[:, None], predicted)
        now = np.clip(predicted[:, 0], motors - HALF_BACKLASHES, motors + HALF_BACKLASHES)
        predicted = np.concatenate([now[:, None], predicted[:, :-1]], axis=1)
        errors = self._errors[index] + ((predicted - observed[:, None, :, None]) ** 2).sum(axis=2)
        best = errors.reshape(len(errors), -1).argmin(axis=1)
        latency, pair = np.divmod(best, HALF_BACKLASHES.size)
        self._predicted[index], self._errors[index], self._fresh[index] = predicted, errors, False
        self.latency[index], self.half_backlash[index] = latency, HALF_BACKLASHES[pair]
        self.observed[index], self.cables[index] = observed, now[np.arange(len(now)), :, pair]


def observed_commands(observation: Mapping[str, np.ndarray], robot: Robot | SpatialRobot) -> np.ndarray:
    """Return the commands of the sections that the observed shape tells, ``(..., commands)`` [a].

    A command is the displacement of a cable at the offset a, of the pulled one of two on opposite sides: the length of
    the backbone minus that of the cable. Cables run straight from disk to disk; so does the backbone of the paper's
    model (eq. 5), while that of the rod consists of arcs.

    Args:
        observation: The observation of one robot, or of many.
        robot: The robot.
    """
    nodes = observation["nodes"].astype(float).reshape(*observation["nodes"].shape[:-1], -1, 3)
    if isinstance(robot, Robot):
        points, arcs, sides = _planar_shape(nodes, robot)
    else:
        points, arcs = robot.length_mm * nodes, np.full(nodes[..., 1:, 0].shape, robot.length_mm / robot.segments)
        sides = _sides_in_space(observation["frames"].astype(float).reshape(*nodes.shape[:-1], 2, 3), robot)
    holes = robot.offset_mm * sides
    ends = {robot.segments if cable.end is None else cable.end for cable in robot.cables}
    starts = [0] if robot.model == "paper" else [0, *sorted(ends)[:-1]]
    pulled, opposite = (
        np.add.reduceat(arcs[..., None] - _chords(points[..., None, :] + side * holes), starts, axis=-2)
        for side in (1, -1)
    )
    commands = np.where(pulled > 0, pulled, -opposite) / robot.offset_mm
    return np.asarray(commands.reshape(*nodes.shape[:-2], -1))


def _planar_shape(nodes: np.ndarray, robot: Robot) -> tuple[np.ndarray, ...]:
    """Return points, lengths of the segments, and the side of the cable at every disk, ``(..., n + 1, 1, 2)``."""
    points, angles = robot.longest_mm * nodes[..., :2], np.pi * nodes[..., 2]
    turns = np.diff(angles) if robot.model == "rod" else 0.0
    arcs = _chords(points[..., None, :])[..., 0] / np.sinc(turns / (2 * np.pi))
    return points, arcs, np.stack([np.cos(angles), np.sin(angles)], axis=-1)[..., None, :]


def _sides_in_space(frames: np.ndarray, robot: SpatialRobot) -> np.ndarray:
    """Return the directions of both commands at every disk, ``(..., n + 1, 2, 3)``."""
    first, second = frames[..., 0, :], np.cross(frames[..., 1, :], frames[..., 0, :])
    angle = robot.angle if robot.model == "paper" else np.pi / 2
    return np.stack([first, np.cos(angle) * first + np.sin(angle) * second], axis=-2)


def _chords(points: np.ndarray) -> np.ndarray:
    """Return the distances of neighbours in lines of points, ``(..., n, lines)`` for ``(..., n + 1, lines, d)``."""
    return np.asarray(np.linalg.norm(np.diff(points, axis=-3), axis=-1))
