"""The world of a spatial robot, seen at an angle, with shadows on the ground."""

import math

import numpy as np
from numpy.typing import ArrayLike

from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.marks import draw_arrow, draw_legend, draw_marker, scaled_force
from ccr_gym.rendering.palette import LAYOUT, PALETTE, Color
from solver.spatial import SpatialEquilibrium

AZIMUTH, ELEVATION = math.radians(-60), math.radians(22)  # of the viewer
LEAST_AREA = 1e-9  # of a face that has a normal [mm²]
RIGHT = np.array([-math.sin(AZIMUTH), math.cos(AZIMUTH), 0.0])
UP = np.array([-math.sin(ELEVATION) * math.cos(AZIMUTH), -math.sin(ELEVATION) * math.sin(AZIMUTH), math.cos(ELEVATION)])
NEAR = np.cross(RIGHT, UP)
RINGS_MM = (20.0, 40.0, 60.0, 80.0)
TURNS = np.linspace(0, 2 * math.pi, 49)
CIRCLE = np.column_stack([np.cos(TURNS), np.sin(TURNS), np.zeros_like(TURNS)])
SHADOW: Color = (226, 230, 237)


def project(points: ArrayLike) -> np.ndarray:
    """Return the projections of points ``(…, 3)`` on the picture plane, which the camera maps, ``(…, 2)`` [mm]."""
    middle = (LAYOUT.left_mm + LAYOUT.right_mm) / 2
    return np.asarray(np.asarray(points) @ np.column_stack([RIGHT, UP]) + (middle, 0.0))


def draw_space(canvas: Canvas, frame: Frame) -> None:
    """Draw the spatial world, left of the gauge and above the footer."""
    equilibrium = frame.equilibrium
    assert isinstance(equilibrium, SpatialEquilibrium)
    draw_ground(canvas)
    surfaces = [obstacle.outline() for obstacle in equilibrium.scene_now]
    for surface in surfaces:
        fill(canvas, shadow(surface), SHADOW)
    line(canvas, shadow(equilibrium.nodes), 3.0, SHADOW)
    middles = (equilibrium.nodes[:-1] + equilibrium.nodes[1:]) / 2 @ NEAR
    nearest = max((float(surface.reshape(-1, 3).mean(axis=0) @ NEAR) for surface in surfaces), default=-math.inf)
    draw_robot(canvas, equilibrium, middles < nearest)
    for surface in sorted(surfaces, key=lambda surface: float(surface.reshape(-1, 3).mean(axis=0) @ NEAR)):
        draw_surface(canvas, surface)
    draw_robot(canvas, equilibrium, middles >= nearest)
    draw_forces(canvas, frame, equilibrium)
    for point in equilibrium.points[equilibrium.contact.any(axis=0)]:
        draw_marker(canvas, canvas.camera(project(point)))
    draw_legend(canvas)


def draw_ground(canvas: Canvas) -> None:
    """Draw rings around the base, and the x and y axes."""
    for radius in RINGS_MM:
        line(canvas, radius * CIRCLE, 1.0, PALETTE.grid)
    for side, name in zip(np.eye(3)[:2], "xy", strict=True):
        line(canvas, [-RINGS_MM[-1] * side, RINGS_MM[-1] * side], 1.0, PALETTE.border)
        x, y = canvas.camera(project((RINGS_MM[-1] + 8) * side))
        canvas.label(name, (float(x), float(y)), PALETTE.muted, 0.5)


def draw_surface(canvas: Canvas, surface: np.ndarray) -> None:
    """Draw the visible faces of a grid ``(u, v, 3)``, lighter the more they face the viewer."""
    corners = faces(surface)
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    sizes = np.linalg.norm(normals, axis=1)
    facing = np.where(sizes > LEAST_AREA, normals @ NEAR / np.maximum(sizes, LEAST_AREA), 0.0)
    dark, light = np.array(PALETTE.outline), np.array(PALETTE.obstacle)
    outward = np.sum((corners.mean(axis=1) - corners.mean(axis=(0, 1))) * normals)
    shades = np.abs(facing) if len(corners) == 1 else np.copysign(facing, facing * outward)
    for face, shade in zip(canvas.camera(project(corners)), shades, strict=True):
        if shade > 0:
            color = dark + (0.35 + 0.65 * shade) * (light - dark)
            red, green, blue = color.astype(int).tolist()
            canvas.polygon(face, (red, green, blue))


def draw_robot(canvas: Canvas, equilibrium: SpatialEquilibrium, visible: np.ndarray) -> None:
    """Draw disks, pulled cables and backbone of some segments, from far to near."""
    nodes, frames, pulled = equilibrium.nodes, equilibrium.frames, equilibrium.pulled
    order = np.flatnonzero(visible)
    for i in order[np.argsort(nodes[order] @ NEAR)]:
        rim = nodes[i + 1] + equilibrium.robot.offset_mm * CIRCLE @ frames[i + 1].T
        line(canvas, rim, LAYOUT.disk if i % 2 == 0 else 0.6 * LAYOUT.major_disk, PALETTE.disk)
        for cable in pulled:
            line(canvas, cable[i : i + 2], LAYOUT.cable, PALETTE.cable)
        line(canvas, nodes[i : i + 2], LAYOUT.backbone, PALETTE.backbone)


def draw_forces(canvas: Canvas, frame: Frame, equilibrium: SpatialEquilibrium) -> None:
    """Draw arrows of the true and estimated force on the obstacles, from the mean contact point."""
    if not equilibrium.contact.any():
        return
    weights = np.where(equilibrium.contact, equilibrium.multipliers, 0.0).sum(axis=0)
    start = np.average(equilibrium.points.reshape(-1, 3), axis=0, weights=weights.ravel())
    for force, width, color in (
        (frame.force_true, LAYOUT.arrow, PALETTE.force_true),
        (frame.force_est, LAYOUT.arrow_slim, PALETTE.force_est),
    ):
        end = start - LAYOUT.arrow_mm * scaled_force(force, frame.force_scale)
        first, last = canvas.camera(project([start, end]))
        draw_arrow(canvas, first, last - first, width, color)


def shadow(points: np.ndarray) -> np.ndarray:
    """Project points onto the ground."""
    return points * (1.0, 1.0, 0.0)


def line(canvas: Canvas, points: ArrayLike, width: float, color: Color) -> None:
    """Draw a polyline through points in space."""
    canvas.line(canvas.camera(project(points)), width, color)


def fill(canvas: Canvas, surface: np.ndarray, color: Color) -> None:
    """Fill all faces of a grid ``(u, v, 3)``."""
    for face in canvas.camera(project(faces(surface))):
        canvas.polygon(face, color)


def faces(surface: np.ndarray) -> np.ndarray:
    """Return the corners of the faces of a grid ``(u, v, 3)``, ``(k, 4, 3)``."""
    corners = [surface[:-1, :-1], surface[1:, :-1], surface[1:, 1:], surface[:-1, 1:]]
    return np.stack(corners, axis=2).reshape(-1, 4, 3)
