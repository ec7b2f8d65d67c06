"""Latency and backlash of the motors, estimated from the observed shape with the exact geometry of the robot."""

from collections.abc import Mapping

import numpy as np

from agents.environment import EnvIndex
from solver import Robot
from solver.spatial import SpatialRobot

LATENCIES = 7  # candidates, in steps from 0
HALF_BACKLASHES_MM = np.linspace(0.0, 0.4, 41)  # candidates
ALL = slice(None)


class LagEstimator:
    """Estimates where the cables of many robots are now, from motor positions and delayed observations of the shape.

    Every pair of a latency and a backlash predicts, from the past of the motors, the displacements that are observed
    now; the pair with the smallest sum of squared errors so far is used.

    Args:
        count: Number N of robots.
        cables: Number of cables per robot.

    Attributes:
        latency: Delay of the observed shape in steps, ``(N,)``.
        half_backlash: Half of the backlash, ``(N,)`` [mm].
        cables: Present displacements of the cables, ``(N, cables)`` [mm].
        observed: Last observed displacements, ``(N, cables)`` [mm].
    """

    def __init__(self, count: int, cables: int) -> None:
        self._predicted = np.zeros((count, LATENCIES, cables, HALF_BACKLASHES_MM.size))  # latest first
        self._errors = np.zeros((count, LATENCIES, HALF_BACKLASHES_MM.size))
        self._fresh = np.ones(count, bool)
        self.latency, self.half_backlash = np.zeros(count, int), np.zeros(count)
        self.cables, self.observed = np.zeros((count, cables)), np.zeros((count, cables))

    def reset(self, index: EnvIndex = ALL) -> None:
        """Start new episodes of some robots."""
        self._errors[index], self._fresh[index] = 0.0, True

    def update(self, motors: np.ndarray, observed: np.ndarray, index: EnvIndex = ALL) -> None:
        """Take in the next step of some robots.

        Args:
            motors: Motor positions, ``(k, cables)`` [mm].
            observed: Observed displacements of the cables, ``(k, cables)`` [mm].
            index: The robots.
        """
        motors, fresh = motors[:, :, None], self._fresh[index]
        predicted = self._predicted[index]
        predicted = np.where(fresh[:, None, None, None], motors[:, None], predicted)
        now = np.clip(predicted[:, 0], motors - HALF_BACKLASHES_MM, motors + HALF_BACKLASHES_MM)
        predicted = np.concatenate([now[:, None], predicted[:, :-1]], axis=1)
        errors = self._errors[index] + ((predicted - observed[:, None, :, None]) ** 2).sum(axis=2)
        best = errors.reshape(len(errors), -1).argmin(axis=1)
        latency, pair = np.divmod(best, HALF_BACKLASHES_MM.size)
        self._predicted[index], self._errors[index], self._fresh[index] = predicted, errors, False
        self.latency[index], self.half_backlash[index] = latency, HALF_BACKLASHES_MM[pair]
        self.observed[index], self.cables[index] = observed, now[np.arange(len(now)), :, pair]


def observed_cables(observation: Mapping[str, np.ndarray], robot: Robot | SpatialRobot) -> np.ndarray:
    """Return the cable displacements of the observed shape, ``(..., cables)`` [mm].

    A displacement is the length of the backbone minus that of the cable. Cables run straight from disk to disk; so does
    the backbone of the paper's model (eq. 5), while that of the rod consists of arcs.

    Args:
        observation: The observation of one robot, or of many.
        robot: The robot.
    """
    shape = (*observation["nodes"].shape[:-1], -1)
    nodes = observation["nodes"].astype(float).reshape(*shape, 3)
    if isinstance(robot, Robot):
        return _planar_cable(nodes, robot)[..., None]
    frames = observation["frames"].astype(float).reshape(*shape, 2, 3)
    return _signed_cables(robot.length_mm * nodes, frames, robot)


def _planar_cable(nodes: np.ndarray, robot: Robot) -> np.ndarray:
    points, angles = max(robot.lengths_mm) * nodes[..., :2], np.pi * nodes[..., 2]
    holes = points + robot.offset_mm * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    turns = np.diff(angles) if robot.model == "rod" else 0.0
    return np.asarray(_length(points, turns) - _length(holes))


def _signed_cables(nodes: np.ndarray, frames: np.ndarray, robot: SpatialRobot) -> np.ndarray:
    first, second = frames[..., 0, :], np.cross(frames[..., 1, :], frames[..., 0, :])
    displacements = []
    for angle in (0.0, robot.angle):
        hole = robot.offset_mm * (np.cos(angle) * first + np.sin(angle) * second)
        pulled, opposite = (_length(nodes) - _length(nodes + side * hole) for side in (1, -1))
        displacements.append(np.where(pulled > 0, pulled, -opposite))
    return np.stack(displacements, axis=-1)


def _length(points: np.ndarray, turns: np.ndarray | float = 0.0) -> np.ndarray:
    """Return the length of arcs through points ``(..., n, d)``, each turning by ``turns`` ``(..., n − 1)`` [rad]."""
    return np.asarray((np.linalg.norm(np.diff(points, axis=-2), axis=-1) / np.sinc(turns / (2 * np.pi))).sum(axis=-1))
