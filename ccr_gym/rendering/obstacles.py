"""Obstacles of the plane."""

import numpy as np

from ccr_gym.rendering.camera import Camera
from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.marks import draw_notes, draw_spring, draw_way, obstacle_notes
from ccr_gym.rendering.page import Region
from ccr_gym.rendering.palette import LAYOUT, PALETTE, mix
from solver import Circle, Equilibrium, HalfPlane, Obstacle


def draw_obstacles(canvas: Canvas, camera: Camera, equilibrium: Equilibrium) -> None:
    """Draw the obstacles where they are, and dashed where those on springs rest."""
    for rest, obstacle in zip(equilibrium.scene, equilibrium.scene_now, strict=True):
        draw_obstacle(canvas, camera, obstacle, equilibrium)
        if rest.spring is not None:
            canvas.dashes(camera(_rest_line(rest, equilibrium)), 1.2, PALETTE.spring)


def draw_ways(canvas: Canvas, camera: Camera, frame: Frame) -> None:
    """Draw where moving obstacles were at the start of the episode, dashed, and the way from there."""
    equilibrium = frame.equilibrium
    assert isinstance(equilibrium, Equilibrium)
    for before, now in frame.moved:
        canvas.dashes(camera(_rest_line(before, equilibrium)), 1.2, PALETTE.muted)
        draw_way(canvas, *(camera(note_place(obstacle, equilibrium)[0]) for obstacle in (before, now)))


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
    _, along = cell.axes
    points = stopped_points(cell, equilibrium)
    heights = (points - cell.point) @ along
    center = np.asarray(cell.point) + 0.5 * (heights.min() + heights.max()) * along
    plate = LAYOUT.plate_part * equilibrium.robot.longest_mm
    light = mix(PALETTE.background, PALETTE.outline, 0.35)
    for width, near, far, color in (
        (0.12 * plate, 0.12 * plate, 0.55 * plate, light),
        (0.75 * plate, 0.55 * plate, 1.15 * plate, light),
        (float(np.ptp(heights)) + 0.5 * plate, 0.0, 0.12 * plate, PALETTE.clamp),
    ):
        canvas.polygon(surface_box(camera, cell, center, width, near, far), color)
    for point in points:
        canvas.dashes(camera([point, cell.nearest(point)]), 1.2, PALETTE.muted, 3.0)


def stopped_points(cell: HalfPlane, equilibrium: Equilibrium) -> np.ndarray:
    """Return the point nearest to a load cell of each node that it stops, ``(k, 2)`` [mm]."""
    positions = (equilibrium.robot.between + 1) * np.array(cell.nodes)
    points = equilibrium.points[:, positions]
    return np.asarray(points[cell.gap(points).argmin(axis=0), np.arange(len(positions))])


def surface_box(
    camera: Camera, plane: HalfPlane, center: np.ndarray, width: float, near: float, far: float
) -> np.ndarray:
    """Return the canvas corners of a rectangle behind a surface, from depth ``near`` to ``far`` [mm], ``(4, 2)``."""
    inward, along = plane.axes
    corners = ((-0.5, near), (0.5, near), (0.5, far), (-0.5, far))
    return camera([center + across * width * along + depth * inward for across, depth in corners])


def draw_springs(canvas: Canvas, camera: Camera, equilibrium: Equilibrium) -> None:
    """Draw the springs of obstacles, beside the arrows of forces."""
    for obstacle, moved in zip(equilibrium.scene_now, equilibrium.displacements, strict=True):
        if obstacle.spring is not None:
            middle, _ = note_place(obstacle, equilibrium)
            aside = 0.6 * (0.0 if isinstance(obstacle, HalfPlane) else obstacle.extent.inradius * camera.scale)
            draw_spring(canvas, camera(middle - moved), camera(middle), aside, camera(equilibrium.nodes[:, :2]))


def draw_all_notes(canvas: Canvas, camera: Camera, equilibrium: Equilibrium, world: Region) -> None:
    """Write what is to be known of each obstacle below it, away from the robot."""
    for obstacle, moved in zip(equilibrium.scene_now, equilibrium.displacements, strict=True):
        middle, low = note_place(obstacle, equilibrium)
        side = -1.0 if middle[0] < 0 else 1.0
        x, y = camera((middle[0], low))
        notes = obstacle_notes(obstacle, float(np.linalg.norm(moved)))
        at = x - 0.5 * side * camera.units(LAYOUT.plate_part), y + 14.0
        draw_notes(canvas, notes, at, world, align=0.5 - 0.5 * side)


def note_place(obstacle: Obstacle, equilibrium: Equilibrium) -> tuple[np.ndarray, float]:
    """Return the middle of an obstacle, of a flat one that of what is drawn of it, and its lowest y [mm]."""
    if not isinstance(obstacle, HalfPlane):
        return np.array(obstacle.extent.center), float(obstacle.outline()[:, 1].min())
    plate = LAYOUT.plate_part * equilibrium.robot.longest_mm
    stopped = equilibrium.nodes[:, :2] if obstacle.nodes is None else stopped_points(obstacle, equilibrium)
    middle = obstacle.nearest(stopped.mean(axis=0)) + 0.85 * plate * obstacle.axes[0]
    return middle, float(middle[1] - 0.4 * plate)


def _rest_line(obstacle: Obstacle, equilibrium: Equilibrium) -> np.ndarray:
    """Return the outline of an obstacle, of a flat one a line as long as the picture is high, ``(k, 2)`` [mm]."""
    if not isinstance(obstacle, HalfPlane):
        return _closed(obstacle.outline())
    length = equilibrium.robot.longest_mm
    reach = length if obstacle.nodes is None else 0.5 * LAYOUT.plate_part * length
    middle = obstacle.nearest(note_place(obstacle, equilibrium)[0])
    return np.asarray(middle + np.array([[-reach], [reach]]) * obstacle.axes[1])


def _closed(outline: np.ndarray) -> np.ndarray:
    return np.vstack([outline, outline[:1]])
