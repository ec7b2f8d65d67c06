"""Obstacles of space, shaded, with shadows on the ground."""

import math

import numpy as np

from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.marks import draw_notes, draw_spring, obstacle_notes
from ccr_gym.rendering.page import Region
from ccr_gym.rendering.palette import LAYOUT, PALETTE, mix
from ccr_gym.rendering.view import LIGHT, NEAR, View, on_ground
from solver import Obstacle
from solver.spatial import HalfSpace

LEAST_AREA = 1e-12  # of a face that has a normal, over the square of the robot's length
DARK = mix(PALETTE.outline, PALETTE.ink, 0.35)
BRIGHT = mix(PALETTE.obstacle, PALETTE.panel, 0.55)
WALL_PART = 0.55  # half the side of the piece of a wall that is drawn, over the robot's length
CELLS = 11


def far_to_near(view: View) -> list[int]:
    """Return the indices of the obstacles, those far from the viewer first; walls are behind all others."""
    middles = [float(np.dot(obstacle.extent.center, NEAR)) for obstacle in view.equilibrium.scene_now]
    walls = [isinstance(obstacle, HalfSpace) for obstacle in view.equilibrium.scene_now]
    return sorted(range(len(middles)), key=lambda index: (not walls[index], middles[index]))


def draw_shadow(canvas: Canvas, view: View, obstacle: Obstacle) -> None:
    """Draw the shadow of a solid obstacle on the ground; a wall casts none."""
    if not isinstance(obstacle, HalfSpace):
        for face in view(on_ground(faces(obstacle.outline()))):
            canvas.polygon(face, PALETTE.shadow)


def draw_surface(canvas: Canvas, view: View, obstacle: Obstacle) -> None:
    """Draw an obstacle."""
    if isinstance(obstacle, HalfSpace):
        draw_wall(canvas, view, obstacle)
    else:
        draw_solid(canvas, view, obstacle)


def draw_solid(canvas: Canvas, view: View, obstacle: Obstacle) -> None:
    """Draw the faces of an obstacle that face the viewer, lighter the more they face the light."""
    corners = faces(obstacle.outline())
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    sizes, smallest = np.linalg.norm(normals, axis=1), LEAST_AREA * view.camera.length_mm**2
    corners, normals = corners[sizes > smallest], normals[sizes > smallest] / sizes[sizes > smallest, None]
    middle = np.array(obstacle.extent.center)
    normals *= np.sign(np.sum((corners.mean(axis=1) - middle) * normals, axis=1))[:, None]  # outward
    for face, normal in zip(corners, normals, strict=True):
        if normal @ NEAR > 0:
            shade = 0.5 + 0.5 * float(normal @ LIGHT)
            color = mix(DARK, BRIGHT, shade if obstacle.nodes is None else 0.5 + 0.5 * shade)
            canvas.polygon(view(face), view.faded(color, middle))


def draw_wall(canvas: Canvas, view: View, wall: HalfSpace) -> None:
    """Draw a square piece of a wall, filled behind the robot and as a grid in front of it; of a load cell its pad."""
    middle, first, second = wall_axes(view, wall)
    half = (WALL_PART if wall.nodes is None else 0.45 * LAYOUT.plate_part) * view.camera.length_mm
    ends = np.array([(-half, -half), (half, -half), (half, half), (-half, half)])
    square = view(middle + ends @ np.array([first, second]))
    behind = float(np.dot(wall.normal, NEAR)) > 0
    if behind:
        shade = 0.5 + 0.5 * float(np.dot(wall.normal, LIGHT))
        canvas.polygon(square, mix(PALETTE.outline, PALETTE.background, shade))
    lines = CELLS if wall.nodes is None else 2
    for part in np.linspace(-half, half, lines):
        for start, end in (((part, -half), (part, half)), ((-half, part), (half, part))):
            ends = np.array([start, end]) @ np.array([first, second])
            canvas.line(view(middle + ends), 1.0 if wall.nodes is None else 2.0, PALETTE.hatch)
    canvas.line(np.vstack([square, square[:1]]), 1.6, PALETTE.outline)


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
    """Draw the springs of obstacles, and write what is to be known of each obstacle below it."""
    equilibrium = view.equilibrium
    for rest, obstacle, moved in zip(equilibrium.scene, equilibrium.scene_now, equilibrium.displacements, strict=True):
        places = [wall_axes(view, o)[0] if isinstance(o, HalfSpace) else np.array(o.extent.center)
                  for o in (rest, obstacle)]
        before, now = view(places)
        if rest.spring is not None:
            draw_spring(canvas, before, now)
        if isinstance(obstacle, HalfSpace):
            below = now[1] + view.camera.units(0.5 * LAYOUT.plate_part)
        else:
            below = float(view(obstacle.outline().reshape(-1, 3))[:, 1].max())
        draw_notes(canvas, obstacle_notes(rest, float(np.linalg.norm(moved))), (now[0], below + 12.0), world)


def faces(surface: np.ndarray) -> np.ndarray:
    """Return the corners of the faces of a grid ``(u, v, 3)``, ``(k, 4, 3)``."""
    corners = [surface[:-1, :-1], surface[1:, :-1], surface[1:, 1:], surface[:-1, 1:]]
    return np.stack(corners, axis=2).reshape(-1, 4, 3)
