"""By how much a force that bends a robot changes its lever, the motion of the points that touch.

Virtual work is exact for the motion along uniform bending of the points of the robot as it is; the environment tells
that of the free robot at the same displacement. Between both lies the bend by the force itself. Here the robot is an
elastica: its curvature falls by the moment of the force, and within each section the cables keep the sum of the angles.
The direction of the force is the model's, that of the entry ``force_est``. Nothing is fitted.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ccr_gym import Settings, SpatialSettings

LARGEST = 16.0  # force on the nominal robot up to which its bend is followed [EI/L²]
ROUNDS = 4  # of bending the robot by the force, and of correcting the force by the lever
BOUNDS = 0.2, 5.0  # of the lever over that of the free robot
LEAST_LEVER = 0.02  # of a contact's motion against its force; below, a pull hardly presses on it [L/a]
TINY = 1e-12


class Touch(NamedTuple):
    """Where k robots are touched, and how they are bent there.

    Attributes:
        below: Parts of the segments below the point that touches, ``(k, n)`` [L].
        turning: Curvature of the motion that is counted, a pull by a unit, ``(k, n)`` [rad/(L a)].
        curvature: Curvature of the free robot, ``(k, n)`` [rad/L].
        aside: Distance of the point from the backbone, to the inner side, ``(k,)`` [L].
        normal: Angle of the obstacle's push from that across the robot at rest, ``(k,)``; NaN where it is not known.
    """

    below: np.ndarray
    turning: np.ndarray
    curvature: np.ndarray
    aside: np.ndarray
    normal: np.ndarray


class Shape(NamedTuple):
    """Shapes of k robots, and how their points that touch move.

    Attributes:
        angles: Angles of the segments, ``(k, n)`` [rad].
        at: Angle of the disk that touches, ``(k,)`` [rad].
        across: Motion of the point across the robot at rest, when a command is pulled, ``(k,)`` [L/a].
        back: That towards the base.
    """

    angles: np.ndarray
    at: np.ndarray
    across: np.ndarray
    back: np.ndarray

    def lever(self, normal: np.ndarray) -> np.ndarray:
        """Return the motion of the point against forces at such angles, ``(k,)`` [L/a]."""
        return np.asarray(np.cos(normal) * self.across + np.sin(normal) * self.back)


class BentLevers:
    """Levers of bent robots.

    Args:
        settings: Settings of the environments.
    """

    def __init__(self, settings: Settings | SpatialSettings) -> None:
        robot = settings.robot
        self._is_rod = robot.model == "rod"  # the disks of the paper's model shear against its backbone instead
        self._count, lines = robot.segments, np.array(robot.lines_mm, float)
        self._lines = lines.reshape(len(lines), -1) / settings.scales.length_mm
        ends = {robot.segments if cable.end is None else cable.end for cable in robot.cables}
        self._sizes = np.diff([0, *sorted(ends)])  # of the sections [segments]
        self._starts = np.cumsum(self._sizes) - self._sizes
        self._range = settings.cable_limit_mm / settings.scales.travel_mm
        self._largest = LARGEST * len(self._sizes) ** 2  # sections that keep their bends are as many times as stiff

    def change(self, force: np.ndarray, observation: Mapping[str, np.ndarray], offset: np.ndarray) -> np.ndarray:
        """Return levers over those of the free robots, ``(k,)``.

        Args:
            force: What virtual work of the free robot tells, on a robot of nominal rigidity, ``(k,)`` [EI/L²].
            observation: Observations, arrays ``(k, ...)``.
            offset: Offset of the cables over the nominal one, ``(k,)``.
        """
        touching = observation["contact"].any(axis=1)
        ratio = np.ones(len(force))
        if self._is_rod and touching.any():
            seen = {key: observation[key][touching] for key in ("contact", "cable", "lever", "force_est")}
            ratio[touching] = self._change(force[touching], self._touch(seen, offset[touching]))
        return ratio

    def _change(self, force: np.ndarray, touch: Touch) -> np.ndarray:
        """Return levers over those of the free robots, ``(k,)``, by bending these and correcting the forces in turn."""
        shape = free = _shape(touch, touch.curvature)
        ratio = np.ones(len(force))
        for _ in range(ROUNDS):
            normal = np.where(np.isnan(touch.normal), shape.at, touch.normal)
            shape = _shape(touch, self._bent(touch, shape, normal, np.clip(force / ratio, 0.0, self._largest)))
            bent, unbent = (np.maximum(robot.lever(normal), LEAST_LEVER) for robot in (shape, free))
            ratio = np.clip(bent / unbent, *BOUNDS)
        return ratio

    def _touch(self, observation: Mapping[str, np.ndarray], offset: np.ndarray) -> Touch:
        """Return where robots are touched, on average over the points that touch, and how they are bent."""
        count, sections = len(offset), len(self._sizes)
        flags = observation["contact"].astype(float).reshape(count, len(self._lines), -1)
        flags = flags / np.maximum(flags.sum(axis=(1, 2), keepdims=True), 1.0)
        place = (flags * np.linspace(0, 1, flags.shape[2])).sum(axis=(1, 2))
        pulls = self._range * observation["cable"].astype(float).reshape(count, sections, -1) / offset[:, None, None]
        along = _directions(pulls.sum(axis=1))
        bends = (pulls * along[:, None]).sum(axis=2)
        way = np.where(bends.any(axis=1, keepdims=True), _directions(bends), 1 / np.sqrt(sections))
        return Touch(
            below=np.clip(place[:, None] - np.arange(self._count) / self._count, 0, 1 / self._count),
            turning=self._spread(way),
            curvature=self._spread(bends),
            aside=(flags.sum(axis=2) @ self._lines * along).sum(axis=1) * offset,
            normal=_normals(observation["force_est"].astype(float), along),
        )

    def _spread(self, bends: np.ndarray) -> np.ndarray:
        """Return the curvatures of segments ``(k, n)`` for bends of the sections ``(k, sections)``."""
        return np.repeat(self._count * bends / self._sizes, self._sizes, axis=1)

    def _bent(self, touch: Touch, shape: Shape, normal: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Return curvatures under the moments of forces on robots of such shapes, ``(k, n)``."""
        across, up = (
            _above(steps) for steps in (touch.below * np.sin(shape.angles), touch.below * np.cos(shape.angles))
        )
        across, up = across + (touch.aside * np.cos(shape.at))[:, None], up - (touch.aside * np.sin(shape.at))[:, None]
        arms = np.cos(normal)[:, None] * up + np.sin(normal)[:, None] * across
        moments = force[:, None] * arms * (touch.below * self._count)
        means = np.add.reduceat(moments, self._starts, axis=1) / self._sizes
        return np.asarray(touch.curvature - moments + np.repeat(means, self._sizes, axis=1))


def _directions(vectors: np.ndarray) -> np.ndarray:
    """Return vectors ``(k, d)`` over their lengths, zero where they are."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), TINY))


def _angles(curvature: np.ndarray) -> np.ndarray:
    """Return the angles of the middles of segments, ``(k, n)`` [rad]."""
    return np.asarray((np.cumsum(curvature, axis=1) - curvature / 2) / curvature.shape[1])


def _shape(touch: Touch, curvature: np.ndarray) -> Shape:
    """Return the shape of robots of some curvature, ``(k, n)``."""
    angles, at = _angles(curvature), (touch.below * curvature).sum(axis=1)
    aside = touch.aside * (touch.below * touch.turning).sum(axis=1)
    moved = touch.below * _angles(touch.turning)
    across = (moved * np.cos(angles)).sum(axis=1) - aside * np.sin(at)
    back = (moved * np.sin(angles)).sum(axis=1) + aside * np.cos(at)
    return Shape(angles, at, across, back)


def _above(steps: np.ndarray) -> np.ndarray:
    """Return the sums of the steps from the middle of each to the end, ``(k, n)``."""
    return np.asarray(steps.sum(axis=-1, keepdims=True) - np.cumsum(steps, axis=-1) + steps / 2)


def _normals(force: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the angles of forces on robots that are bent this way, 0 for one straight against it; NaN for no force."""
    across = (force[:, :-1] * along).sum(axis=1)
    return np.asarray(np.where(force.any(axis=1), np.arctan2(force[:, -1], -across), np.nan))
