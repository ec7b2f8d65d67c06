"""The panels beside the world: the force gauge at the right and the status line at the bottom."""

from collections.abc import Sequence

import numpy as np

from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.palette import LAYOUT, PALETTE, STATUS_COLORS, Color
from solver import Equilibrium
from solver.spatial import SpatialEquilibrium


def draw_gauge(canvas: Canvas, frame: Frame) -> None:
    """Draw the panel at the right: force magnitudes and their set-point."""
    left = canvas.width - LAYOUT.panel
    canvas.box(left, 0, LAYOUT.panel, canvas.height, PALETTE.panel)
    canvas.box(left, 0, 1, canvas.height, PALETTE.border)
    canvas.label("force [mN]", (left + 0.5 * LAYOUT.panel, LAYOUT.margin + 4), PALETTE.ink, 0.5)
    top = LAYOUT.margin + 32
    draw_gauge_scale(canvas, frame.force_scale, top)
    readings = (
        ("true", float(np.linalg.norm(frame.force_true)), PALETTE.force_true),
        ("est.", float(np.linalg.norm(frame.force_est)), PALETTE.force_est),
        ("goal", frame.desired_force, PALETTE.desired),
    )
    draw_gauge_readings(canvas, readings, frame.force_scale, top)
    for row, (name, force, color) in enumerate(readings):
        y = top + LAYOUT.gauge_height + 34 + 24 * row
        canvas.label(name, (left + LAYOUT.margin, y), color)
        canvas.label(f"{1000 * force:.1f}", (canvas.width - LAYOUT.margin, y), color, 1)


def draw_gauge_scale(canvas: Canvas, full_scale: float, top: float) -> None:
    """Draw the empty gauge and its ticks."""
    left, bar = canvas.width - LAYOUT.panel + 46, LAYOUT.gauge_bar
    canvas.box(left, top, 2 * bar + 10, LAYOUT.gauge_height, PALETTE.grid)
    for tick in range(LAYOUT.gauge_ticks + 1):
        part = tick / LAYOUT.gauge_ticks
        y = top + (1 - part) * LAYOUT.gauge_height
        canvas.box(left - 6, y - 0.5, 6, 1, PALETTE.muted)
        canvas.label(f"{1000 * part * full_scale:.4g}", (left - 10, y), PALETTE.muted, 1)


def draw_gauge_readings(
    canvas: Canvas, readings: Sequence[tuple[str, float, Color]], full_scale: float, top: float
) -> None:
    """Draw the bars of both forces and the line of the set-point, the last reading, clipped to the scale."""
    left, bar = canvas.width - LAYOUT.panel + 46, LAYOUT.gauge_bar
    heights = [LAYOUT.gauge_height * min(max(force / full_scale, 0.0), 1.0) for _, force, _ in readings]
    bottom = top + LAYOUT.gauge_height
    for index, (height, (_, _, color)) in enumerate(zip(heights[:-1], readings[:-1], strict=True)):
        if height > 0:
            canvas.box(left + 3 + index * (bar + 4), bottom - height, bar, height, color)
    y, right = bottom - heights[-1], left + 2 * bar + 10
    canvas.box(left - 3, y - 1.5, right - left + 6, 3, readings[-1][2])
    canvas.polygon([(right + 2, y), (right + 11, y - 6), (right + 11, y + 6)], readings[-1][2])


def draw_footer(canvas: Canvas, equilibrium: Equilibrium | SpatialEquilibrium) -> None:
    """Draw the line at the bottom: cable displacements, tensions and solver status."""
    top = canvas.height - LAYOUT.footer
    canvas.box(0, top, canvas.width, LAYOUT.footer, PALETTE.panel)
    canvas.box(0, top, canvas.width, 1, PALETTE.border)
    y, color = top + 0.5 * LAYOUT.footer, STATUS_COLORS[equilibrium.status]
    if isinstance(equilibrium, Equilibrium):
        cables, tensions = [equilibrium.cable_mm], [equilibrium.tension]
    else:
        cables, tensions = equilibrium.cables_mm.tolist(), equilibrium.tensions.tolist()
    shift = 150 + 45 * (len(cables) - 1)
    canvas.label(f"cable {', '.join(f'{cable:.2f}' for cable in cables)} mm", (LAYOUT.margin, y), PALETTE.ink)
    canvas.label(f"tension {', '.join(f'{t:.2f}' for t in tensions)} N", (LAYOUT.margin + shift, y), PALETTE.ink)
    canvas.disc((LAYOUT.margin + 2 * shift, y), 4, color)
    canvas.label(equilibrium.status.name.lower(), (LAYOUT.margin + 2 * shift + 12, y), color)
