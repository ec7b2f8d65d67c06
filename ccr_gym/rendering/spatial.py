"""The world of a spatial robot, seen at an angle: what is far is paler, and all cast shadows on the ground."""

import math

import numpy as np

from ccr_gym.rendering.camera import Strokes
from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.marks import disk_widths, draw_contacts, draw_forces, draw_scale_bar, smooth_path, taut
from ccr_gym.rendering.page import Region
from ccr_gym.rendering.palette import LAYOUT, PALETTE, mix
from ccr_gym.rendering.surfaces import (
    draw_shadow,
    draw_solid,
    draw_springs_and_notes,
    draw_wall,
    draw_ways,
    far_to_near,
)
from ccr_gym.rendering.view import NEAR, View, on_ground
from solver.common.rod import full_cables
from solver.spatial import HalfSpace, SpatialEquilibrium

RINGS = (0.2, 0.4, 0.6, 0.8)  # over the robot's length
TURNS = np.linspace(0, 2 * math.pi, 49)
CIRCLE = np.column_stack([np.cos(TURNS), np.sin(TURNS), np.zeros_like(TURNS)])


def draw_space(canvas: Canvas, frame: Frame, world: Region) -> None:
    """Draw the spatial world."""
    equilibrium = frame.equilibrium
    assert isinstance(equilibrium, SpatialEquilibrium)
    view = View.fit(equilibrium, world)
    strokes = Strokes.fit(equilibrium.robot.offset_mm * view.camera.scale)
    draw_ground(canvas, view, world)
    for obstacle in equilibrium.scene_now:
        if isinstance(obstacle, HalfSpace):
            draw_wall(canvas, view, obstacle)
    draw_shadows(canvas, view)
    draw_base(canvas, view)
    hidden = draw_solids(canvas, view, strokes)
    draw_hidden(canvas, view, hidden)
    draw_ways(canvas, view, frame)
    draw_springs_and_notes(canvas, view, world)
    draw_forces(canvas, view, frame, equilibrium, LAYOUT.arrow_part * view.camera.length_mm, strokes.marker)
    draw_contacts(canvas, view, frame, equilibrium, strokes)
    draw_scale_bar(canvas, view.camera, world)


def draw_ground(canvas: Canvas, view: View, world: Region) -> None:
    """Draw the ground as a disc, rings around the base, and the x and y axes."""
    length = view.camera.length_mm
    canvas.polygon(view(RINGS[-1] * length * CIRCLE), PALETTE.ground)
    for radius in RINGS:
        canvas.line(view(radius * length * CIRCLE), 1.0, PALETTE.border)
    for side, name in zip(np.eye(3)[:2], "xy", strict=True):
        canvas.line(view(RINGS[-1] * length * np.array([-side, side])), 1.0, PALETTE.border)
        at = view(1.06 * RINGS[-1] * length * side)
        canvas.label(name, at, PALETTE.muted, 0.5, within=world)


def draw_shadows(canvas: Canvas, view: View) -> None:
    """Draw the shadows of obstacles and robot, and plumb lines from the tip and the obstacles to the ground."""
    equilibrium = view.equilibrium
    solids = [obstacle for obstacle in equilibrium.scene_now if math.isfinite(obstacle.extent.radius)]
    for obstacle in solids:
        draw_shadow(canvas, view, obstacle)
    canvas.line(view(on_ground(equilibrium.nodes)), 4.0, mix(PALETTE.shadow, PALETTE.outline, 0.45))
    for point in (equilibrium.nodes[-1], *(np.array(obstacle.extent.center) for obstacle in solids)):
        foot = on_ground(point)
        canvas.dashes(view([point, foot]), 1.0, PALETTE.muted, 3.0)
        canvas.disc(view(foot), 2.0, PALETTE.muted)


def draw_base(canvas: Canvas, view: View) -> None:
    """Draw the clamp, a low round block on the ground."""
    robot = view.equilibrium.robot
    radius = max(1.6 * robot.offset_mm, 0.05 * robot.longest_mm)
    low, high = (radius * CIRCLE + (0.0, 0.0, height * radius) for height in (-0.5, 0.0))
    rims = view(low), view(high)
    canvas.polygon(rims[0], PALETTE.clamp)
    left, right = (rims[0][:, 0].argmin(), rims[0][:, 0].argmax())
    canvas.polygon([rims[0][left], rims[0][right], rims[1][right], rims[1][left]], PALETTE.clamp)
    canvas.polygon(rims[1], mix(PALETTE.clamp, PALETTE.panel, 0.35))


def draw_solids(canvas: Canvas, view: View, strokes: Strokes) -> np.ndarray:
    """Draw obstacles and robot, what is hidden before what hides it; return which segments are hidden, ``(n,)``."""
    nodes, obstacles = view.equilibrium.nodes, list(view.equilibrium.scene_now)
    order = far_to_near(view)
    hidden = view.hidden_by(0.5 * (nodes[:-1] + nodes[1:]))
    left = np.ones(len(nodes) - 1, dtype=bool)
    for index in order:
        draw_robot(canvas, view, strokes, left & hidden[index])
        draw_solid(canvas, view, obstacles[index])
        left &= ~hidden[index]
    draw_robot(canvas, view, strokes, left)
    return ~left


def draw_robot(canvas: Canvas, view: View, strokes: Strokes, chosen: np.ndarray) -> None:
    """Draw disks, cables, each to the disk where it ends, and backbone of some segments, from far to near."""
    equilibrium = view.equilibrium
    robot, nodes = equilibrium.robot, equilibrium.nodes
    cables = _cables(equilibrium)
    scale = view.camera.scale
    widths = disk_widths(len(nodes), 0.0, robot.segment_mm * scale, strokes, least=9.0)
    order = np.flatnonzero(chosen)
    for i in order[np.argsort((nodes[order] + nodes[order + 1]) @ NEAR, kind="stable")]:
        middle = 0.5 * (nodes[i] + nodes[i + 1])
        size = 0.75 + 0.5 * float(view.nearness(middle))
        for path, tight in cables:
            if i + 1 < len(path):
                color = view.faded(PALETTE.cable if tight else PALETTE.slack, path[i])
                canvas.line(view(path[i : i + 2]), size * strokes.cable, color)
        path = nodes[i : i + 2]
        if robot.model == "rod":
            path = smooth_path(path, equilibrium.frames[i : i + 2, :, 2], robot.segment_mm)
        canvas.line(view(path), size * strokes.backbone, view.faded(PALETTE.backbone, middle))
        if widths[i + 1]:
            rim = nodes[i + 1] + robot.offset_mm * CIRCLE @ equilibrium.frames[i + 1].T
            canvas.line(view(rim), 0.8 * size * widths[i + 1], view.faded(PALETTE.disk, nodes[i + 1]))


def _cables(equilibrium: SpatialEquilibrium) -> list[tuple[np.ndarray, bool]]:
    """Return the points of all cables up to where they end, and which are taut; slack ones first."""
    robot, pulled, tight = equilibrium.robot, equilibrium.pulled, taut(equilibrium)
    if robot.model == "paper":
        opposite = [(2 * equilibrium.nodes - path, False) for path in pulled]
        return opposite + list(zip(pulled, tight.tolist(), strict=True))
    ends = [cable.end or robot.segments for cable in full_cables(robot)]
    paths = [path[: end + 1] for path, end in zip(pulled, ends, strict=True)]
    return sorted(zip(paths, tight.tolist(), strict=True), key=lambda cable: cable[1])


def draw_hidden(canvas: Canvas, view: View, hidden: np.ndarray) -> None:
    """Draw where the backbone runs behind obstacles, as a thin dashed line."""
    nodes = view.equilibrium.nodes
    color = mix(PALETTE.backbone, PALETTE.obstacle, 0.45)
    for i in np.flatnonzero(hidden):
        canvas.dashes(view(nodes[i : i + 2]), 1.4, color, 3.0)
