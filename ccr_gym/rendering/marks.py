"""Marks that pictures of the plane and of space share: contacts, forces, springs and labels of obstacles."""

import math

import numpy as np
from numpy.typing import ArrayLike

from ccr_gym.rendering.camera import Camera, Strokes
from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.page import Region
from ccr_gym.rendering.palette import LAYOUT, PALETTE, Color, contact_color
from ccr_gym.rendering.units import length_text
from ccr_gym.rendering.view import View
from solver import Equilibrium, Obstacle
from solver.spatial import SpatialEquilibrium

Projection = Camera | View  # of world points (…, d) on the canvas (…, 2)
LEAST_PART = 1e-9  # of EI/(aL): smaller tensions are those of a slack cable
COILS = 5
MOST_TURN = 0.08  # of a drawn piece of a rod [rad]


def draw_marker(canvas: Canvas, at: ArrayLike, radius: float, color: Color) -> None:
    """Draw a contact marker."""
    canvas.disc(at, radius + 1.2, PALETTE.panel)
    canvas.disc(at, radius, color)


def draw_contacts(
    canvas: Canvas, project: Projection, frame: Frame, equilibrium: Equilibrium | SpatialEquilibrium, strokes: Strokes
) -> None:
    """Draw a marker on each point in contact, darker the larger its force, the multiplier times the energy scale."""
    forces = equilibrium.energy_scale * equilibrium.multipliers.max(axis=0, initial=0.0)
    points, touching = equilibrium.points, forces > 0
    for order in np.argsort(forces[touching], kind="stable"):
        point, force = points[touching][order], float(forces[touching][order])
        draw_marker(canvas, project(point), strokes.marker, contact_color(force / frame.force_scale))


def draw_forces(
    canvas: Canvas,
    project: Projection,
    frame: Frame,
    equilibrium: Equilibrium | SpatialEquilibrium,
    full_mm: float,
    marker: float,
) -> None:
    """Draw arrows of the true and estimated force on the obstacles side by side, from the mean contact point.

    Args:
        canvas: The canvas.
        project: The projection onto it.
        frame: What is shown.
        equilibrium: The robot among its obstacles.
        full_mm: Length of the arrow of a force of the full scale [mm].
        marker: Radius of the contact markers, from whose rim the arrows start.
    """
    chosen = slice(None) if frame.target is None else slice(frame.target, frame.target + 1)
    weights = equilibrium.multipliers[chosen].sum(axis=0).ravel()
    if not weights.any():
        return
    start = np.average(equilibrium.points.reshape(weights.size, -1), axis=0, weights=weights)
    first = project(start)
    arrows = [
        project(start - full_mm * scaled_force(force, frame.force_scale)) - first
        for force in (frame.force_true, frame.force_est)
    ]
    along = arrows[0] if math.hypot(*arrows[0]) > 1 else arrows[1]
    along = along / max(math.hypot(*along), 1.0)
    first, side = first + marker * along, np.array([-along[1], along[0]])
    for shift, vector, width, color in (
        (-0.5 * LAYOUT.arrow - 0.3, arrows[0], LAYOUT.arrow, PALETTE.force_true),
        (0.5 * LAYOUT.arrow_slim + 1.5, arrows[1], LAYOUT.arrow_slim, PALETTE.force_est),
    ):
        draw_arrow(canvas, first + shift * side, vector, width, color)


def scaled_force(force: np.ndarray, full_scale: float) -> np.ndarray:
    """Return a force over the full scale, limited in length; zero for a force that is not finite."""
    size = float(np.linalg.norm(force))
    if not (math.isfinite(size) and size > 0):
        return np.zeros_like(force)
    return np.asarray(force * (min(size / full_scale, LAYOUT.arrow_reach) / size))


def draw_arrow(canvas: Canvas, start: ArrayLike, vector: np.ndarray, width: float, color: Color) -> None:
    """Draw an arrow with a light rim; one shorter than its head shrinks in proportion."""
    length = float(np.hypot(*vector))
    if length < 1:
        return
    along = vector / length
    side = np.array([-along[1], along[0]])
    head = min(1.4 * width + 7, length)
    half_head, half_shaft, neck = 0.5 * head, min(0.5 * width, 0.25 * head), length - head
    profile = np.array([(0, half_shaft), (neck, half_shaft), (neck, half_head), (length, 0)])
    shape = np.vstack([profile, profile[-2::-1] * (1, -1)]) @ np.array([along, side]) + start
    canvas.line(np.vstack([shape, shape[:1]]), 2, PALETTE.panel)
    canvas.polygon(shape, color)


def draw_spring(canvas: Canvas, anchor: np.ndarray, moved: np.ndarray, aside: float, robot: np.ndarray) -> None:
    """Draw a spring between where an obstacle rests and where it is.

    Args:
        canvas: The canvas.
        anchor: Where it rests, on the canvas.
        moved: Where it is.
        aside: How far the spring is drawn from the line between both, which the arrows of forces cover.
        robot: Nodes of the robot on the canvas, ``(k, 2)``; of both sides the spring takes the one farther from them.
    """
    along = moved - anchor
    length = math.hypot(*along)
    side = np.array([-along[1], along[0]]) / max(length, 1e-9)
    sides = [shift * aside * side for shift in (1.0, -1.0)]
    shift = max(sides, key=lambda shift: round(float(np.linalg.norm(robot - (anchor + shift), axis=1).min()), 3))
    anchor, moved = anchor + shift, moved + shift
    if length > 2:
        parts = (np.arange(2 * COILS) + 0.5) / (2 * COILS)
        swing = min(6.0, 0.4 * length) * np.where(np.arange(2 * COILS) % 2 == 0, 1.0, -1.0)
        coil = anchor + parts[:, None] * along + swing[:, None] * side
        canvas.line(np.vstack([anchor, coil, moved]), 1.6, PALETTE.spring)
        canvas.disc(moved, 2.8, PALETTE.spring)
    canvas.disc(anchor, 4.5, PALETTE.spring)
    canvas.disc(anchor, 2.5, PALETTE.panel)


def draw_way(canvas: Canvas, before: np.ndarray, now: np.ndarray) -> None:
    """Draw the way of a moving obstacle on the canvas: a dot where it was, and a thin line to where it is."""
    canvas.line([before, now], 1.4, PALETTE.muted)
    canvas.disc(before, 3.0, PALETTE.muted)
    canvas.disc(now, 3.0, PALETTE.panel)
    canvas.disc(now, 2.0, PALETTE.muted)


def obstacle_notes(obstacle: Obstacle, moved_mm: float) -> list[str]:
    """Return what is to be written at an obstacle: how far its spring gave way, and which nodes alone it stops."""
    notes = [f"on a spring, moved {length_text(moved_mm)}"] if obstacle.spring is not None else []
    if obstacle.nodes is None:
        return notes
    return [f"stops {nodes_text(obstacle.nodes)} only", *notes]


def nodes_text(nodes: tuple[int, ...]) -> str:
    """Return the names of nodes as text: of many their range, or their number."""
    if len(nodes) <= 3:
        return f"node{'s' * (len(nodes) > 1)} {', '.join(map(str, nodes))}"
    first, last = min(nodes), max(nodes)
    return f"nodes {first}–{last}" if last - first + 1 == len(nodes) else f"{len(nodes)} nodes"


def draw_notes(canvas: Canvas, notes: list[str], at: ArrayLike, world: Region, align: float) -> None:
    """Write notes below each other, from a place on."""
    x, y = np.asarray(at, dtype=float).tolist()
    for row, note in enumerate(notes):
        canvas.label(note, (x, y + 16 * row), PALETTE.ink, align, LAYOUT.small_font, world)


def draw_scale_bar(canvas: Canvas, camera: Camera, world: Region) -> None:
    """Draw a bar of a tenth of the robot's length at the lower left of the world."""
    left, y, step = world.left + LAYOUT.margin, world.bottom - LAYOUT.margin, camera.units(LAYOUT.grid_part)
    canvas.line([(left, y), (left + step, y)], 2, PALETTE.muted)
    for x in (left, left + step):
        canvas.line([(x, y - 4), (x, y + 4)], 2, PALETTE.muted)
    text = length_text(LAYOUT.grid_part * camera.length_mm)
    canvas.label(text, (left + step + 9, y), PALETTE.muted, size=LAYOUT.small_font, within=world)


def taut(equilibrium: Equilibrium | SpatialEquilibrium) -> np.ndarray:
    """Return which cables are under tension, ``(c,)`` bool."""
    robot = equilibrium.robot
    return np.asarray(equilibrium.tensions > LEAST_PART * robot.rigidity / (robot.offset_mm * robot.longest_mm))


def disk_widths(nodes: int, thickness: float, spacing: float, strokes: Strokes, least: float = 4.0) -> np.ndarray:
    """Return the stroke of each disk, zero for those left out where all would merge, ``(nodes,)``.

    Args:
        nodes: Number of nodes.
        thickness: Thickness of a disk on the canvas.
        spacing: Distance between nodes on the canvas.
        strokes: Strokes of the robot.
        least: Least distance between drawn disks on the canvas.
    """
    every = max(1, math.ceil(least / max(spacing, 1e-3)))
    widths = np.zeros(nodes)
    widths[::every] = max(strokes.disk, thickness)
    widths[:: 2 * every] = max(2 * strokes.disk, thickness)
    return widths


def smooth_path(points: np.ndarray, headings: np.ndarray, segment_mm: float) -> np.ndarray:
    """Return points of the curve of a rod, whose segments are arcs, as cubics through its nodes.

    Args:
        points: Nodes, ``(n+1, d)`` [mm].
        headings: Unit tangents there, ``(n+1, d)``.
        segment_mm: Length of a segment [mm].
    """
    turns = np.linalg.norm(np.diff(headings, axis=0), axis=1).max()
    count = min(max(1, math.ceil(turns / MOST_TURN - 1e-6)), 12)
    t = (np.arange(count) / count)[:, None, None]
    start, end, out, into = points[:-1], points[1:], segment_mm * headings[:-1], segment_mm * headings[1:]
    curve = (
        (1 + 2 * t) * (1 - t) ** 2 * start + t**2 * (3 - 2 * t) * end + t * (1 - t) ** 2 * out + t**2 * (t - 1) * into
    )
    return np.vstack([np.moveaxis(curve, 0, 1).reshape(-1, points.shape[1]), points[-1:]])
