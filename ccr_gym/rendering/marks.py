"""Marks that pictures of the plane and of space share: contacts, force arrows and their legend."""

import math

import numpy as np
from numpy.typing import ArrayLike

from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.palette import LAYOUT, PALETTE, Color


def draw_marker(canvas: Canvas, at: ArrayLike) -> None:
    """Draw a contact marker."""
    canvas.disc(at, LAYOUT.contact, PALETTE.panel)
    canvas.disc(at, LAYOUT.contact - 1, PALETTE.contact)
    canvas.disc(at, LAYOUT.contact - 3.5, PALETTE.panel)


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


def draw_legend(canvas: Canvas) -> None:
    """Draw the legend of lines, markers and arrows at the top left."""
    left, right, top, row = LAYOUT.margin, LAYOUT.margin + LAYOUT.glyph, LAYOUT.margin + 4, LAYOUT.row
    canvas.line([(left, top), (right, top)], LAYOUT.backbone, PALETTE.backbone)
    canvas.line([(left, top + row), (right, top + row)], LAYOUT.cable, PALETTE.cable)
    draw_marker(canvas, (0.5 * (left + right), top + 2 * row))
    sample = np.array([LAYOUT.glyph, 0.0])
    draw_arrow(canvas, (left, top + 3 * row), sample, LAYOUT.arrow, PALETTE.force_true)
    draw_arrow(canvas, (left, top + 4 * row), sample, LAYOUT.arrow_slim, PALETTE.force_est)
    for index, name in enumerate(("backbone", "cable", "contact", "force, true", "force, estimated")):
        canvas.label(name, (right + 10, top + index * row), PALETTE.ink)
