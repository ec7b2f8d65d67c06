"""Latency and play of the motors, from where the cables are seen to be: the exact model tells that from a shape."""

from collections.abc import Mapping
from typing import Any

import numpy as np

LATENCIES = 7  # steps that are thought possible, from 0
SLACKS_MM = np.linspace(0.0, 0.4, 41)  # halves of the play that are thought possible


class Lag:
    """What is not seen yet of the moves of many robots.

    Every pair of latency and play makes of the motors' past a place of the cables to be seen now; the pair with the
    least squared errors so far is believed.

    Args:
        count: Number N of robots.
        cables: Number of cables of each.

    Attributes:
        latency: Steps after which the shape is seen, ``(N,)``.
        slack: Half of the play, ``(N,)`` [mm].
        places: Where the cables are now, ``(N, cables)`` [mm].
        seen: Where they are seen to be, ``(N, cables)`` [mm].
    """

    def __init__(self, count: int, cables: int) -> None:
        self._places = np.zeros((count, LATENCIES, cables, SLACKS_MM.size))  # the latest first
        self._errors = np.zeros((count, LATENCIES, SLACKS_MM.size))
        self._fresh = np.ones(count, bool)
        self.latency, self.slack = np.zeros(count, int), np.zeros(count)
        self.places, self.seen = np.zeros((count, cables)), np.zeros((count, cables))

    def forget(self, which: Any = slice(None)) -> None:
        """Begin new episodes."""
        self._errors[which], self._fresh[which] = 0.0, True

    def see(self, motors: np.ndarray, seen: np.ndarray, which: Any = slice(None)) -> None:
        """Take in where motors are and cables are seen to be, ``(k, cables)`` [mm], of some robots at a next step."""
        motors, fresh = motors[:, :, None], self._fresh[which]
        places = self._places[which]
        places = np.where(fresh[:, None, None, None], motors[:, None], places)
        now = np.clip(places[:, 0], motors - SLACKS_MM, motors + SLACKS_MM)
        places = np.concatenate([now[:, None], places[:, :-1]], axis=1)
        errors = self._errors[which] + ((places - seen[:, None, :, None]) ** 2).sum(axis=2)
        best = errors.reshape(len(errors), -1).argmin(axis=1)
        latency, pair = np.divmod(best, SLACKS_MM.size)
        self._places[which], self._errors[which], self._fresh[which] = places, errors, False
        self.latency[which], self.slack[which], self.seen[which] = latency, SLACKS_MM[pair], seen
        self.places[which] = now[np.arange(len(now)), :, pair]


def seen_cables(observation: Mapping[str, np.ndarray], robot: Any) -> np.ndarray:
    """Displacements of the cables when the nodes were seen, ``(..., cables)`` [mm].

    Cables run straight from disk to disk, the backbone as well (eq. 5) or, with a sliding cable, in arcs; the
    difference of their lengths is what is pulled.

    Args:
        observation: Of one robot, or of many.
        robot: The robot.
    """
    shape = (*observation["nodes"].shape[:-1], -1)
    nodes = observation["nodes"].astype(float).reshape(*shape, 3)
    if "frames" not in observation:
        points, angles = max(robot.lengths_mm) * nodes[..., :2], np.pi * nodes[..., 2]
        holes = points + robot.offset_mm * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        turns = np.diff(angles) if robot.model == "rod" else 0.0
        return np.asarray(_length(points, turns) - _length(holes))[..., None]
    nodes *= robot.length_mm
    frames = observation["frames"].astype(float).reshape(*shape, 2, 3)
    first, second = frames[..., 0, :], np.cross(frames[..., 1, :], frames[..., 0, :])
    displacements = []
    for angle in (0.0, robot.angle):
        hole = robot.offset_mm * (np.cos(angle) * first + np.sin(angle) * second)
        pulled, opposite = (_length(nodes) - _length(nodes + side * hole) for side in (1, -1))
        displacements.append(np.where(pulled > 0, pulled, -opposite))
    return np.stack(displacements, axis=-1)


def _length(points: np.ndarray, turns: np.ndarray | float = 0.0) -> np.ndarray:
    """Length of arcs through points ``(..., n, d)`` that turn by so much between two, ``(..., n − 1)`` [rad]."""
    return np.asarray((np.linalg.norm(np.diff(points, axis=-2), axis=-1) / np.sinc(turns / (2 * np.pi))).sum(axis=-1))
