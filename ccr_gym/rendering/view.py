"""The view of space: an oblique parallel projection, and what is near and far in it."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ccr_gym.rendering.camera import Bounds, Camera, extent_points
from ccr_gym.rendering.page import Region
from ccr_gym.rendering.palette import LAYOUT, PALETTE, Color, mix
from solver.spatial import SpatialEquilibrium

AZIMUTH, ELEVATION = math.radians(-60), math.radians(22)  # of the viewer
RIGHT = np.array([-math.sin(AZIMUTH), math.cos(AZIMUTH), 0.0])
UP = np.array([-math.sin(ELEVATION) * math.cos(AZIMUTH), -math.sin(ELEVATION) * math.sin(AZIMUTH), math.cos(ELEVATION)])
NEAR = np.cross(RIGHT, UP)
LIGHT = (NEAR + 0.7 * UP - 0.5 * RIGHT) / np.linalg.norm(NEAR + 0.7 * UP - 0.5 * RIGHT)
PLANE = np.column_stack([RIGHT, UP])  # of the picture
FADE = 0.45  # part of a colour that is lost at the far end of a robot's reach
SAMPLES = np.linspace(0.004, 2.0, 250)[:, None]  # along a line of sight, over the robot's length


class View(NamedTuple):
    """The projection of space onto the canvas.

    Attributes:
        camera: The map from the picture plane to the canvas.
        equilibrium: What is seen.
    """

    camera: Camera
    equilibrium: SpatialEquilibrium

    @classmethod
    def fit(cls, equilibrium: SpatialEquilibrium, region: Region) -> "View":
        """Return the view that keeps all that a robot can reach in a region, whichever way it bends."""
        length = equilibrium.robot.longest_mm
        balls = [e for e in (obstacle.extent for obstacle in equilibrium.scene_now) if math.isfinite(e.radius)]
        around = extent_points(
            [np.array(ball.center) / length @ PLANE for ball in balls], [ball.radius / length for ball in balls]
        )
        reach, sunk = LAYOUT.reach_part, LAYOUT.reach_part * math.sin(ELEVATION) + 0.04
        bounds = Bounds(-reach, reach, -sunk, LAYOUT.top_part * math.cos(ELEVATION))
        shown = np.vstack([around, equilibrium.nodes / length @ PLANE])
        return cls(Camera.fit(region, bounds.around(shown), length), equilibrium)

    def __call__(self, points: ArrayLike) -> np.ndarray:
        """Return canvas positions of points ``(…, 3)`` [mm], ``(…, 2)``."""
        return self.camera(np.asarray(points, dtype=float) @ PLANE)

    def nearness(self, points: ArrayLike) -> np.ndarray:
        """Return how near points ``(…, 3)`` are to the viewer: 0 at the far end of the robot's reach, 1 at the near."""
        depth = np.asarray(points, dtype=float) @ NEAR / self.camera.length_mm
        return np.clip(0.5 + 0.5 * depth / LAYOUT.reach_part, 0.0, 1.0)

    def faded(self, color: Color, point: ArrayLike) -> Color:
        """Return a colour as it is seen at a point, paler the farther away it is."""
        return mix(color, PALETTE.background, FADE * (1 - float(self.nearness(point))))

    def hidden_by(self, points: np.ndarray) -> np.ndarray:
        """Return which obstacle hides which of the points ``(k, 3)`` from the viewer, ``(m, k)`` bool.

        The points of a line of sight are tried by the obstacle's own gap, so that all shapes are treated alike.
        """
        length = self.camera.length_mm
        sight = points[:, None] + length * SAMPLES * NEAR
        gaps = [obstacle.gap(sight).min(axis=1) for obstacle in self.equilibrium.scene_now]
        return np.array(gaps).reshape(-1, len(points)) < -0.002 * length


def on_ground(points: np.ndarray) -> np.ndarray:
    """Return points projected onto the ground."""
    return points * (1.0, 1.0, 0.0)
