"""The world of a planar robot."""

import numpy as np

from ccr_gym.rendering.camera import Camera
from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.marks import draw_arrow, draw_legend, draw_marker, scaled_force
from ccr_gym.rendering.palette import LAYOUT, PALETTE
from solver import Circle, Equilibrium, HalfPlane, Obstacle


def draw_plane(canvas: Canvas, frame: Frame) -> None:
    """Draw the planar world, left of the gauge and above the footer."""
    equilibrium = frame.equilibrium
    assert isinstance(equilibrium, Equilibrium)
    draw_grid(canvas)
    for obstacle in equilibrium.scene_now:
        if isinstance(obstacle, Circle):
            draw_circle(canvas, obstacle)
        elif not isinstance(obstacle, HalfPlane):
            draw_solid(canvas, obstacle)
        elif obstacle.nodes is None:
            draw_wall(canvas, obstacle)
        else:
            draw_load_cell(canvas, obstacle, equilibrium)
    draw_robot(canvas, equilibrium)
    draw_forces(canvas, frame, equilibrium)
    draw_contacts(canvas, equilibrium)
    draw_legend(canvas)


def draw_grid(canvas: Canvas) -> None:
    """Draw a square grid through the origin, and a scale bar as long as one square."""
    camera, step = canvas.camera, LAYOUT.grid_mm * canvas.camera.scale
    for x in np.arange(camera.x % step, canvas.width, step):
        canvas.line([(x, 0), (x, canvas.height)], 1, PALETTE.grid)
    for y in np.arange(camera.y % step, canvas.height, step):
        canvas.line([(0, y), (canvas.width, y)], 1, PALETTE.grid)
    left, y = LAYOUT.margin, canvas.height - LAYOUT.footer - LAYOUT.margin
    canvas.line([(left, y), (left + step, y)], 2, PALETTE.muted)
    for x in (left, left + step):
        canvas.line([(x, y - 4), (x, y + 4)], 2, PALETTE.muted)
    canvas.label(f"{LAYOUT.grid_mm:g} mm", (left + step + 10, y), PALETTE.muted)


def draw_circle(canvas: Canvas, circle: Circle) -> None:
    """Draw a disc with a rim."""
    center, radius = canvas.camera(circle.center), circle.radius * canvas.camera.scale
    canvas.disc(center, radius, PALETTE.outline)
    canvas.disc(center, radius - LAYOUT.outline, PALETTE.obstacle)


def draw_solid(canvas: Canvas, obstacle: Obstacle) -> None:
    """Draw a filled outline."""
    outline = canvas.camera(obstacle.outline())
    canvas.polygon(outline, PALETTE.obstacle)
    canvas.line(np.vstack([outline, outline[:1]]), LAYOUT.outline, PALETTE.outline)


def draw_wall(canvas: Canvas, wall: HalfPlane) -> None:
    """Draw a hatched half-plane."""
    inward, along = wall.axes
    reach = LAYOUT.horizon_mm
    center = wall.nearest(canvas.camera.center)
    canvas.polygon(surface_box(canvas, wall, center, 2 * reach, 0, reach), PALETTE.obstacle)
    for shift in np.arange(-2 * reach, reach, LAYOUT.hatch_mm):
        start = center + shift * along
        canvas.line(canvas.camera([start, start + reach * (inward + along)]), LAYOUT.hatch, PALETTE.hatch)
    canvas.line(canvas.camera([center - reach * along, center + reach * along]), LAYOUT.wall, PALETTE.outline)


def draw_load_cell(canvas: Canvas, cell: HalfPlane, equilibrium: Equilibrium) -> None:
    """Draw a plate on a load cell and its mount, level with the nodes that can touch it."""
    center = cell.nearest(equilibrium.nodes[list(cell.nodes or ()), :2].mean(axis=0))
    plate, thickness = LAYOUT.plate_mm, LAYOUT.plate_thickness_mm
    for width, near, far, color in (
        (0.30 * plate, thickness, thickness + 4, PALETTE.outline),
        (0.55 * plate, thickness + 4, thickness + 16, PALETTE.cell),
        (plate, 0, thickness, PALETTE.clamp),
    ):
        canvas.polygon(surface_box(canvas, cell, center, width, near, far), color)


def surface_box(
    canvas: Canvas, plane: HalfPlane, center: np.ndarray, width: float, near: float, far: float
) -> np.ndarray:
    """Return the canvas corners of a rectangle behind a surface, from depth ``near`` to ``far`` [mm], ``(4, 2)``."""
    inward, along = plane.axes
    corners = ((-0.5, near), (0.5, near), (0.5, far), (-0.5, far))
    return canvas.camera([center + across * width * along + depth * inward for across, depth in corners])


def draw_robot(canvas: Canvas, equilibrium: Equilibrium) -> None:
    """Draw clamp, disks, cable and backbone."""
    backbone, cable = canvas.camera(equilibrium.nodes[:, :2]), canvas.camera(equilibrium.cable_nodes)
    offset = equilibrium.robot.offset_mm
    canvas.polygon(
        canvas.camera([(-1.5 * offset, -8), (2.5 * offset, -8), (2.5 * offset, 0), (-1.5 * offset, 0)]), PALETTE.clamp
    )
    canvas.polygon(
        canvas.camera([(-3 * offset, -12), (4 * offset, -12), (4 * offset, -8), (-3 * offset, -8)]), PALETTE.outline
    )
    for node, ends in enumerate(zip(backbone, cable, strict=True)):
        canvas.line(np.array(ends), LAYOUT.disk if node % 2 else LAYOUT.major_disk, PALETTE.disk)
    canvas.line(cable, LAYOUT.cable, PALETTE.cable)
    canvas.line(backbone, LAYOUT.backbone, PALETTE.backbone)


def draw_contacts(canvas: Canvas, equilibrium: Equilibrium) -> None:
    """Draw a marker on each point in contact."""
    for point in canvas.camera(equilibrium.points[equilibrium.contact.any(axis=0)]):
        draw_marker(canvas, point)


def draw_forces(canvas: Canvas, frame: Frame, equilibrium: Equilibrium) -> None:
    """Draw arrows of the true and estimated force on the obstacles, from the mean contact point."""
    if not equilibrium.contact.any():
        return
    weights = np.where(equilibrium.contact, equilibrium.multipliers, 0.0).sum(axis=0)
    start = canvas.camera(np.average(equilibrium.points.reshape(-1, 2), axis=0, weights=weights.ravel()))
    for force, width, color in (
        (frame.force_true, LAYOUT.arrow, PALETTE.force_true),
        (frame.force_est, LAYOUT.arrow_slim, PALETTE.force_est),
    ):
        draw_arrow(canvas, start, reaction_arrow(canvas.camera, force, frame.force_scale), width, color)


def reaction_arrow(camera: Camera, force: np.ndarray, full_scale: float) -> np.ndarray:
    """Return the arrow of the reaction to a force on the robot in canvas units, limited in length."""
    return scaled_force(force, full_scale) * (-LAYOUT.arrow_mm * camera.scale, LAYOUT.arrow_mm * camera.scale)
