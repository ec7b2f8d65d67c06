"""Obstacles of space, shaded, with shadows on the ground."""

import math
from itertools import repeat

import numpy as np

from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.marks import draw_notes, draw_spring, draw_way, obstacle_notes
from ccr_gym.rendering.page import Region
from ccr_gym.rendering.palette import LAYOUT, PALETTE, mix
from ccr_gym.rendering.view import LIGHT, NEAR, View, on_ground
from solver import Obstacle
from solver.spatial import HalfSpace

LEAST_AREA = 1e-12  # of a face that has a normal, over the square of the robot's length
DARK = mix(PALETTE.outline, PALETTE.ink, 0.35)
BRIGHT = mix(PALETTE.obstacle, PALETTE.panel, 0.55)
WALL_PART = 0.45  # half the side of the piece of a wall that is drawn, over the robot's length
CELLS = 11


def far_to_near(view: View) -> list[int]:
    """Return the indices of the solid obstacles, those far from the viewer first; walls are not among them."""
    depths = {
        index: float(np.dot(obstacle.extent.center, NEAR))
        for index, obstacle in enumerate(view.equilibrium.scene_now)
        if not isinstance(obstacle, HalfSpace)
    }
    return sorted(depths, key=depths.__getitem__)


def draw_shadow(canvas: Canvas, view: View, obstacle: Obstacle) -> None:
    """Draw the shadow of a solid obstacle on the ground."""
    canvas.polygons(view(on_ground(faces(obstacle.outline()))), repeat(PALETTE.shadow))


def draw_solid(canvas: Canvas, view: View, obstacle: Obstacle) -> None:
    """Draw the faces of an obstacle that face the viewer, lighter the more they face the light."""
    corners = faces(obstacle.outline())
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    sizes, smallest = np.linalg.norm(normals, axis=1), LEAST_AREA * view.camera.length_mm**2
    corners, normals = corners[sizes > smallest], normals[sizes > smallest] / sizes[sizes > smallest, None]
    middle = np.array(obstacle.extent.center)
    normals *= np.sign(np.sum((corners.mean(axis=1) - middle) * normals, axis=1))[:, None]  # outward
    facing = normals @ NEAR > 0
    shades = 0.5 + 0.5 * normals[facing] @ LIGHT
    if obstacle.nodes is not None:
        shades = 0.5 + 0.5 * shades
    colors = (view.faded(mix(DARK, BRIGHT, shade), middle) for shade in shades.tolist())
    canvas.polygons(view(corners[facing]), colors)


def draw_wall(canvas: Canvas, view: View, wall: HalfSpace) -> None:
    """Draw a square piece of a wall: a grid, filled where it is behind the robot; of a load cell its pad."""
    middle, first, second = wall_axes(view, wall)
    half = (WALL_PART if wall.nodes is None else 0.4 * LAYOUT.plate_part) * view.camera.length_mm
    ends = half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)])
    square = view(middle + ends @ np.array([first, second]))
    if wall.nodes is not None:
        canvas.polygon(square, mix(PALETTE.clamp, PALETTE.background, 0.35))
    elif np.dot(wall.normal, NEAR) > 0:
        shade = 0.5 + 0.5 * float(np.dot(wall.normal, LIGHT))
        canvas.polygon(square, mix(PALETTE.obstacle, PALETTE.background, shade))
    canvas.line(square, 1.6, PALETTE.outline)
    if wall.nodes is None:
        for part in np.linspace(-half, half, CELLS):
            for across in (np.array([(part, -half), (part, half)]), np.array([(-half, part), (half, part)])):
                canvas.line(view(middle + across @ np.array([first, second])), 1.0, PALETTE.hatch)


def draw_ways(canvas: Canvas, view: View, frame: Frame) -> None:
    """Draw the way of moving obstacles since the start of the episode."""
    for pair in frame.moved:
        draw_way(canvas, *(view(middle_of(view, obstacle)) for obstacle in pair))


def middle_of(view: View, obstacle: Obstacle) -> np.ndarray:
    """Return the centre of an obstacle, of a wall the middle of what is drawn of it, ``(3,)`` [mm]."""
    return wall_axes(view, obstacle)[0] if isinstance(obstacle, HalfSpace) else np.array(obstacle.extent.center)


def wall_axes(view: View, wall: HalfSpace) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the point of a wall nearest to what it stops of the robot, and two unit vectors along the wall."""
    nodes = view.equilibrium.nodes
    near = nodes.mean(axis=0) if wall.nodes is None else nodes[list(wall.nodes)].mean(axis=0)
    normal = np.array(wall.normal)
    helper = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    first = np.cross(normal, helper)
    first /= math.sqrt(float(first @ first))
    return near - (near - np.array(wall.point)) @ normal * normal, first, np.cross(normal, first)


def draw_springs_and_notes(canvas: Canvas, view: View, world: Region) -> None:
    """Draw the springs of obstacles, and write what is to be known of each obstacle below it, off the robot."""
    equilibrium = view.equilibrium
    for rest, obstacle, moved in zip(equilibrium.scene, equilibrium.scene_now, equilibrium.displacements, strict=True):
        flat, middle = isinstance(obstacle, HalfSpace), middle_of(view, obstacle)
        x, y = view(middle)
        if rest.spring is not None:
            aside = 0.6 * (0.0 if flat else obstacle.extent.inradius * view.camera.scale)
            draw_spring(canvas, view(middle - moved), view(middle), aside, view(equilibrium.nodes))
        half = view.camera.units(0.5 * LAYOUT.plate_part)
        low = y + half if flat else view(obstacle.outline().reshape(-1, 3))[:, 1].max()
        side = -1.0 if x < view.camera.x else 1.0
        notes = obstacle_notes(rest, float(np.linalg.norm(moved)))
        draw_notes(canvas, notes, (x - side * half, low + 12.0), world, align=0.5 - 0.5 * side)


def faces(surface: np.ndarray) -> np.ndarray:
    """Return the corners of the faces of a grid ``(u, v, 3)``, ``(k, 4, 3)``."""
    corners = [surface[:-1, :-1], surface[1:, :-1], surface[1:, 1:], surface[:-1, 1:]]
    return np.stack(corners, axis=2).reshape(-1, 4, 3)
