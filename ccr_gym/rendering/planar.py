"""The world of a planar robot."""

import numpy as np

from ccr_gym.rendering.camera import Bounds, Camera, Strokes, extent_points, planar_bounds, rail_part
from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.marks import disk_widths, draw_contacts, draw_forces, draw_scale_bar, smooth_path, taut
from ccr_gym.rendering.obstacles import draw_all_notes, draw_obstacles, draw_springs, draw_ways
from ccr_gym.rendering.page import Region
from ccr_gym.rendering.palette import LAYOUT, PALETTE
from ccr_gym.rendering.units import length_text
from solver import Equilibrium, HalfPlane
from solver.common.rod import full_cables


def draw_plane(canvas: Canvas, frame: Frame, world: Region) -> None:
    """Draw the planar world."""
    equilibrium = frame.equilibrium
    assert isinstance(equilibrium, Equilibrium)
    camera = planar_camera(equilibrium, world)
    strokes = Strokes.fit(equilibrium.robot.offset_mm * camera.scale)
    draw_grid(canvas, camera, world)
    draw_obstacles(canvas, camera, equilibrium)
    draw_ways(canvas, camera, frame)
    draw_base(canvas, camera, equilibrium, strokes, world)
    draw_springs(canvas, camera, equilibrium)
    draw_robot(canvas, camera, equilibrium, strokes)
    draw_all_notes(canvas, camera, equilibrium, world)
    draw_forces(canvas, camera, frame, equilibrium, LAYOUT.arrow_part * camera.length_mm, strokes.marker)
    draw_contacts(canvas, camera, frame, equilibrium, strokes)
    draw_scale_bar(canvas, camera, world)


def planar_camera(equilibrium: Equilibrium, world: Region) -> Camera:
    """Return the camera that keeps the robot, and the obstacles it can reach, in a region."""
    length = equilibrium.robot.longest_mm
    return Camera.fit(world, _bounds(equilibrium, length), length)


def _bounds(equilibrium: Equilibrium, length: float) -> Bounds:
    solids = [obstacle.extent for obstacle in equilibrium.scene_now if not isinstance(obstacle, HalfPlane)]
    around = extent_points([np.array(e.center) / length for e in solids], [e.radius / length for e in solids])
    return planar_bounds(equilibrium.robot).around(np.vstack([around, equilibrium.nodes[:, :2] / length]))


def draw_grid(canvas: Canvas, camera: Camera, world: Region) -> None:
    """Draw a square grid through the origin, a tenth of the robot's length wide."""
    step = camera.units(LAYOUT.grid_part)
    for x in np.arange(world.left + (camera.x - world.left) % step, world.right, step):
        canvas.line([(x, world.top), (x, world.bottom)], 1, PALETTE.grid)
    for y in np.arange(world.top + (camera.y - world.top) % step, world.bottom, step):
        canvas.line([(world.left, y), (world.right, y)], 1, PALETTE.grid)


def draw_base(canvas: Canvas, camera: Camera, equilibrium: Equilibrium, strokes: Strokes, world: Region) -> None:
    """Draw the clamp, and where the base inserts the robot the rail, the carriage and the part not yet inserted."""
    robot = equilibrium.robot
    half = max(1.6 * robot.offset_mm * camera.scale, camera.units(0.05))
    height = camera.units(0.045)
    rail = camera.units(rail_part(robot))
    if rail > 0:
        shortest, longest = robot.lengths_mm
        out = rail * (longest - equilibrium.length_mm) / (longest - shortest)
        _draw_rail(canvas, camera, rail + height, out + height, half, strokes)
        text = f"length {length_text(equilibrium.length_mm, 1e-3 * robot.longest_mm)}"
        at = camera.x + 1.5 * half + 6, camera.y + 2 * height + out
        canvas.label(text, at, PALETTE.ink, 0.0, LAYOUT.small_font, world)
    canvas.box(camera.x - half, camera.y, 2 * half, height, PALETTE.clamp)
    canvas.box(camera.x - 2 * half, camera.y + height, 4 * half, 0.5 * height, PALETTE.outline)


def _draw_rail(canvas: Canvas, camera: Camera, rail: float, out: float, half: float, strokes: Strokes) -> None:
    x, y, height = camera.x, camera.y, camera.units(0.045)
    for side in (-0.8, 0.8):
        canvas.line([(x + side * half, y), (x + side * half, y + rail + height)], 1.5, PALETTE.outline)
    canvas.line([(x, y), (x, y + out)], strokes.backbone, PALETTE.backbone)
    canvas.box(x - 1.3 * half, y + out, 2.6 * half, height, PALETTE.clamp)


def draw_robot(canvas: Canvas, camera: Camera, equilibrium: Equilibrium, strokes: Strokes) -> None:
    """Draw disks, cables, each to the disk where it ends, and backbone."""
    robot, nodes = equilibrium.robot, equilibrium.nodes
    across = np.column_stack([np.cos(nodes[:, 2]), np.sin(nodes[:, 2])])
    cables = full_cables(robot)
    holes = [cable.hole_mm[0] for cable in cables]
    sides = np.array([min(0.0, *holes, *robot.lines_mm), max(0.0, *holes, *robot.lines_mm)])
    thickness, spacing = robot.disk_thickness_mm * camera.scale, robot.segment_mm * camera.scale
    widths = disk_widths(len(nodes), thickness, spacing, strokes)
    for node in np.flatnonzero(widths):
        ends = camera(nodes[node, :2] + sides[:, None] * across[node])
        canvas.line(ends, widths[node], PALETTE.disk)
    tight = taut(equilibrium)
    for index in np.argsort(tight, kind="stable"):
        end = cables[index].end
        assert end is not None
        path, color = camera(equilibrium.pulled[index, : end + 1]), PALETTE.cable if tight[index] else PALETTE.slack
        canvas.line(path, strokes.cable, color)
        canvas.disc(path[-1], 1.2 * strokes.cable + 0.6, color)
    path = nodes[:, :2]
    if robot.model == "rod":
        path = smooth_path(path, across @ [[0.0, 1.0], [-1.0, 0.0]], equilibrium.length_mm / robot.segments)
    canvas.line(camera(path), strokes.backbone, PALETTE.backbone)
