"""The map from the world to the canvas, fitted to the robot and its obstacles."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ccr_gym.rendering.page import Region
from ccr_gym.rendering.palette import LAYOUT
from ccr_gym.rendering.units import SLACK
from solver import Robot
from solver.common.rod import full_cables


class Bounds(NamedTuple):
    """A rectangle of the picture plane, y up, over the robot's longest length."""

    left: float
    right: float
    bottom: float
    top: float

    def around(self, points: np.ndarray) -> "Bounds":
        """Return the bounds grown to hold points ``(k, 2)``, by whole steps, so that a moving robot seldom moves it."""
        if not len(points):
            return self
        grown = [_outward(side) for side in (*points.min(axis=0), *points.max(axis=0))]
        low_x, low_y, high_x, high_y = grown
        return Bounds(min(self.left, low_x), max(self.right, high_x), min(self.bottom, low_y), max(self.top, high_y))


def _outward(value: float) -> float:
    """Return a coordinate rounded away from zero to the steps of views, within the widest view."""
    steps = math.ceil(abs(value) / LAYOUT.bounds_part - SLACK)
    return math.copysign(min(steps * LAYOUT.bounds_part, LAYOUT.widest_part), value)


class Camera(NamedTuple):
    """The map from the picture plane, y up [mm], to the canvas, y down.

    Attributes:
        scale: Canvas units per millimetre.
        x: Canvas x of the world's origin.
        y: Canvas y of the world's origin.
        length_mm: The robot's longest length, in which the sizes of drawn things are given [mm].
    """

    scale: float
    x: float
    y: float
    length_mm: float

    @classmethod
    def fit(cls, region: Region, bounds: Bounds, length_mm: float) -> "Camera":
        """Fit bounds into a region of the canvas, centred and with equal aspect."""
        unit = min(region.width / (bounds.right - bounds.left), region.height / (bounds.top - bounds.bottom))
        middle_x, middle_y = 0.5 * (bounds.left + bounds.right), 0.5 * (bounds.bottom + bounds.top)
        x, y = region.left + 0.5 * region.width - unit * middle_x, region.top + 0.5 * region.height + unit * middle_y
        return cls(unit / length_mm, x, y, length_mm)

    def __call__(self, points: ArrayLike) -> np.ndarray:
        """Return canvas positions of points, ``(…, 2)`` [mm]."""
        return np.asarray(points, dtype=float) * (self.scale, -self.scale) + (self.x, self.y)

    def units(self, part: float) -> float:
        """Return a part of the robot's longest length in canvas units."""
        return part * self.length_mm * self.scale


class Strokes(NamedTuple):
    """Widths of the robot's lines and radius of its contact markers, in canvas units."""

    backbone: float
    cable: float
    disk: float
    marker: float

    @classmethod
    def fit(cls, offset_units: float) -> "Strokes":
        """Return strokes that leave a robot's cables apart from its backbone, this far from it on the canvas."""
        widths = ((0.32, 1.7, 5.0), (0.11, 1.0, 1.9), (0.09, 0.8, 1.6), (0.4, 4.0, 6.0))
        return cls(*(min(max(part * offset_units, low), high) for part, low, high in widths))


def planar_bounds(robot: Robot) -> Bounds:
    """Return the bounds of all that a planar robot reaches: on both sides where it can bend both ways."""
    reach, back = LAYOUT.reach_part, LAYOUT.back_part
    bottom = -LAYOUT.bottom_part - rail_part(robot)
    if robot.least_cable_mm < 0:
        return Bounds(-reach, reach, bottom, LAYOUT.top_part)
    left, right = (-back, reach) if full_cables(robot)[0].hole_mm[0] > 0 else (-reach, back)
    return Bounds(left, right, bottom, LAYOUT.top_part)


def rail_part(robot: Robot) -> float:
    """Return the length of the rail on which the base inserts the robot as it is drawn, 0 for a fixed length."""
    shortest, longest = robot.lengths_mm
    return min((longest - shortest) / longest, LAYOUT.rail_part)


def extent_points(centers: Iterable[np.ndarray], radii: Iterable[float]) -> np.ndarray:
    """Return the corners of the squares around discs, over the same length, that a robot can reach, ``(k, 2)``."""
    corners = [
        center + side * radius
        for center, radius in zip(centers, radii, strict=True)
        if math.isfinite(radius) and math.hypot(*center) - radius < LAYOUT.top_part
        for side in (-1.0, 1.0)
    ]
    return np.array(corners).reshape(-1, 2)
