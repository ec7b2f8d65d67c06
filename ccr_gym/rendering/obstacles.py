"""Obstacles of the plane."""

import numpy as np

from ccr_gym.rendering.camera import Camera
from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.marks import draw_notes, draw_spring, obstacle_notes
from ccr_gym.rendering.page import Region
from ccr_gym.rendering.palette import LAYOUT, PALETTE, mix
from solver import Circle, Equilibrium, HalfPlane, Obstacle


def draw_obstacles(canvas: Canvas, camera: Camera, equilibrium: Equilibrium) -> None:
    """Draw the obstacles where they are, and dashed where those on springs rest."""
    for rest, obstacle in zip(equilibrium.scene, equilibrium.scene_now, strict=True):
        if rest.spring is not None and not isinstance(rest, HalfPlane):
            canvas.dashes(camera(_closed(rest.outline())), 1.2, PALETTE.spring)
        draw_obstacle(canvas, camera, obstacle, equilibrium)


def draw_obstacle(canvas: Canvas, camera: Camera, obstacle: Obstacle, equilibrium: Equilibrium) -> None:
    """Draw an obstacle; one that stops some nodes only is lighter, and its outline dashed."""
    if isinstance(obstacle, HalfPlane):
        (draw_wall if obstacle.nodes is None else draw_load_cell)(canvas, camera, obstacle, equilibrium)
    elif isinstance(obstacle, Circle) and obstacle.nodes is None:
        draw_circle(canvas, camera, obstacle)
    else:
        draw_solid(canvas, camera, obstacle)


def draw_circle(canvas: Canvas, camera: Camera, circle: Circle) -> None:
    """Draw a disc with a rim."""
    center, radius = camera(circle.center), circle.radius * camera.scale
    canvas.disc(center, radius, PALETTE.outline)
    canvas.disc(center, radius - LAYOUT.outline, PALETTE.obstacle)


def draw_solid(canvas: Canvas, camera: Camera, obstacle: Obstacle) -> None:
    """Draw a filled outline."""
    outline = camera(obstacle.outline())
    whole = obstacle.nodes is None
    canvas.polygon(outline, PALETTE.obstacle if whole else mix(PALETTE.background, PALETTE.obstacle, 0.5))
    (canvas.line if whole else canvas.dashes)(_closed(outline), LAYOUT.outline, PALETTE.outline)


def draw_wall(canvas: Canvas, camera: Camera, wall: HalfPlane, equilibrium: Equilibrium) -> None:
    """Draw a hatched half-plane."""
    inward, along = wall.axes
    length = equilibrium.robot.longest_mm
    reach, step = LAYOUT.horizon_part * length, LAYOUT.hatch_part * length
    center = wall.nearest(np.array([0.0, 0.5 * length]))
    canvas.polygon(surface_box(camera, wall, center, 2 * reach, 0, reach), PALETTE.obstacle)
    for shift in step * np.arange(-round(2 * reach / step), round(reach / step)):
        start = center + shift * along
        canvas.line(camera([start, start + reach * (inward + along)]), 1.0, PALETTE.hatch)
    canvas.line(camera([center - reach * along, center + reach * along]), LAYOUT.wall, PALETTE.outline)


def draw_load_cell(canvas: Canvas, camera: Camera, cell: HalfPlane, equilibrium: Equilibrium) -> None:
    """Draw the pad of a load cell, its stem and its body, level with the nodes that it stops.

    The pad is no longer than what it stops, and the rest is light: the robot's other nodes pass by the load cell.
    """
    inward, along = cell.axes
    nodes = equilibrium.nodes[list(cell.nodes or ()), :2]
    heights = (nodes - cell.point) @ along
    center = np.asarray(cell.point) + 0.5 * (heights.min() + heights.max()) * along
    plate = LAYOUT.plate_part * equilibrium.robot.longest_mm
    pad = max(float(np.ptp(heights)), 0.0) + 0.4 * plate
    light = mix(PALETTE.background, PALETTE.outline, 0.35)
    for width, near, far, color in (
        (0.12 * plate, 0.12 * plate, 0.55 * plate, light),
        (0.75 * plate, 0.55 * plate, 1.15 * plate, light),
        (pad, 0.0, 0.12 * plate, PALETTE.clamp),
    ):
        canvas.polygon(surface_box(camera, cell, center, width, near, far), color)
    for node in nodes:
        canvas.dashes(camera([node, cell.nearest(node)]), 1.2, PALETTE.muted, 3.0)


def surface_box(
    camera: Camera, plane: HalfPlane, center: np.ndarray, width: float, near: float, far: float
) -> np.ndarray:
    """Return the canvas corners of a rectangle behind a surface, from depth ``near`` to ``far`` [mm], ``(4, 2)``."""
    inward, along = plane.axes
    corners = ((-0.5, near), (0.5, near), (0.5, far), (-0.5, far))
    return camera([center + across * width * along + depth * inward for across, depth in corners])


def draw_springs_and_notes(canvas: Canvas, camera: Camera, equilibrium: Equilibrium, world: Region) -> None:
    """Draw the springs of obstacles, and write what is to be known of each obstacle below it."""
    for rest, obstacle, moved in zip(equilibrium.scene, equilibrium.scene_now, equilibrium.displacements, strict=True):
        before, now = (_middle(each, equilibrium) for each in (rest, obstacle))
        if rest.spring is not None:
            draw_spring(canvas, camera(before), camera(now))
        below = obstacle.outline()[:, 1].min() if not isinstance(obstacle, HalfPlane) else now[1] - _half_body(camera)
        notes = obstacle_notes(rest, float(np.linalg.norm(moved)))
        draw_notes(canvas, notes, camera((now[0], below)) + (0.0, 14.0), world)


def _half_body(camera: Camera) -> float:
    return 0.5 * LAYOUT.plate_part * camera.length_mm


def _middle(obstacle: Obstacle, equilibrium: Equilibrium) -> np.ndarray:
    """Return the centre of an obstacle, or of a flat one the place of its surface that the robot can meet."""
    if not isinstance(obstacle, HalfPlane):
        return np.array(obstacle.extent.center)
    nodes = equilibrium.nodes[:, :2] if obstacle.nodes is None else equilibrium.nodes[list(obstacle.nodes), :2]
    return obstacle.nearest(nodes.mean(axis=0)) + _half_body_part(equilibrium) * obstacle.axes[0]


def _half_body_part(equilibrium: Equilibrium) -> float:
    return 0.85 * LAYOUT.plate_part * equilibrium.robot.longest_mm


def _closed(outline: np.ndarray) -> np.ndarray:
    return np.vstack([outline, outline[:1]])
