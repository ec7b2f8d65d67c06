"""The panel beside the world: the force gauge, its readings and the tensions of the cables."""

import math
from collections.abc import Sequence

import numpy as np

from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.marks import taut
from ccr_gym.rendering.page import Region
from ccr_gym.rendering.palette import LAYOUT, PALETTE, Color
from ccr_gym.rendering.units import force_unit, round_ticks, short

TICKS = 6
ROW = 20.0
TENSIONS = 2 * ROW + LAYOUT.tension_height + 12.0  # height of the part of the tensions
READINGS = 3 * ROW + 24.0
NATURAL_TENSION = 4.0  # full scale of a robot without a limit, over EI/(aL)


def draw_panel(canvas: Canvas, frame: Frame, panel: Region) -> None:
    """Draw the panel: force magnitudes and their set-point, and below them the tensions."""
    canvas.fill(panel, PALETTE.panel)
    canvas.box(panel.left, panel.top, 1, panel.height, PALETTE.border)
    unit = force_unit(frame.force_scale)
    canvas.label(f"force [{unit.name}]", (panel.left + 0.5 * panel.width, panel.top + 14), PALETTE.ink, 0.5)
    gauge = gauge_region(panel)
    draw_gauge_scale(canvas, frame.force_scale, gauge)
    readings = (
        ("true", float(np.linalg.norm(frame.force_true)), PALETTE.force_true),
        ("est.", float(np.linalg.norm(frame.force_est)), PALETTE.force_est),
        ("goal", frame.desired_force, PALETTE.desired),
    )
    draw_gauge_readings(canvas, readings, frame.force_scale, gauge)
    for row, (name, force, color) in enumerate(readings):
        y = gauge.bottom + 22 + ROW * row
        canvas.label(name, (panel.left + LAYOUT.margin, y), color)
        canvas.label(unit.text(force, frame.force_scale), (panel.right - LAYOUT.margin, y), color, 1)
    draw_tensions(canvas, frame, Region(panel.left, panel.bottom - TENSIONS, panel.width, TENSIONS))


def gauge_region(panel: Region) -> Region:
    """Return where the bars of the gauge are."""
    height = min(LAYOUT.gauge_height, panel.height - 36 - READINGS - TENSIONS)
    return Region(panel.left + 48, panel.top + 36, 2 * LAYOUT.gauge_bar + 10, height)


def draw_gauge_scale(canvas: Canvas, full_scale: float, gauge: Region) -> None:
    """Draw the empty gauge and its ticks, at round numbers."""
    canvas.fill(gauge, PALETTE.grid)
    unit = force_unit(full_scale)
    for tick in round_ticks(full_scale * unit.per_newton, TICKS):
        y = gauge.bottom - tick / (full_scale * unit.per_newton) * gauge.height
        canvas.box(gauge.left - 6, y - 0.5, 6, 1, PALETTE.muted)
        canvas.label(f"{tick:.4g}", (gauge.left - 9, y), PALETTE.muted, 1, LAYOUT.small_font)


def draw_gauge_readings(
    canvas: Canvas, readings: Sequence[tuple[str, float, Color]], full_scale: float, gauge: Region
) -> None:
    """Draw the bars of both forces and the line of the set-point, the last reading, clipped to the scale."""
    heights = [gauge.height * _part(force, full_scale) for _, force, _ in readings]
    for index, (height, (_, _, color)) in enumerate(zip(heights[:-1], readings[:-1], strict=True)):
        if height > 0:
            left = gauge.left + 3 + index * (LAYOUT.gauge_bar + 4)
            canvas.box(left, gauge.bottom - height, LAYOUT.gauge_bar, height, color)
    y, right = gauge.bottom - heights[-1], gauge.right
    canvas.box(gauge.left - 3, y - 1.5, gauge.width + 6, 3, readings[-1][2])
    canvas.polygon([(right + 2, y), (right + 11, y - 6), (right + 11, y + 6)], readings[-1][2])


def _part(value: float, full_scale: float) -> float:
    """Return a value over the full scale, within the scale; zero for no number."""
    return 0.0 if math.isnan(value) else min(max(value / full_scale, 0.0), 1.0)


def draw_tensions(canvas: Canvas, frame: Frame, region: Region) -> None:
    """Draw a bar for the tension of each cable, up to the limit of the motors."""
    equilibrium, robot = frame.equilibrium, frame.equilibrium.robot
    limited = math.isfinite(robot.max_tension)
    natural = NATURAL_TENSION * robot.rigidity / (robot.offset_mm * robot.longest_mm)
    full = robot.max_tension if limited else natural
    unit = force_unit(full)
    canvas.box(region.left, region.top - 8, region.width, 1, PALETTE.border)
    canvas.label(f"tension [{unit.name}]", (region.left + 0.5 * region.width, region.top + 8), PALETTE.ink, 0.5)
    bars = Region(region.left + 40, region.top + 26, region.width - 40 - LAYOUT.margin, LAYOUT.tension_height)
    canvas.fill(bars, PALETTE.grid)
    step = bars.width / len(equilibrium.tensions)
    for index, (tension, tight) in enumerate(zip(equilibrium.tensions, taut(equilibrium), strict=True)):
        height, width = max(bars.height * _part(tension, full), 1.5), min(0.7 * step, 18.0)
        left = bars.left + (index + 0.5) * step - 0.5 * width
        canvas.box(left, bars.bottom - height, width, height, PALETTE.cable if tight else PALETTE.slack)
    ends = ((bars.bottom, "0"), (bars.top, short(full * unit.per_newton)))
    for y, text in ends:
        canvas.box(bars.left - 5, y - 0.5, 5, 1, PALETTE.muted)
        canvas.label(text, (bars.left - 8, y), PALETTE.muted, 1, LAYOUT.small_font)
    if limited:
        canvas.box(bars.left, bars.top - 1, bars.width, 2, PALETTE.contact)
    draw_largest(canvas, equilibrium.tensions, full, (bars.left + 0.5 * bars.width, bars.bottom + 14))


def draw_largest(canvas: Canvas, tensions: np.ndarray, full: float, at: tuple[float, float]) -> None:
    """Write the tensions of one or two cables, else the largest."""
    texts = [force_unit(full).text(float(tension), full) for tension in tensions]
    largest = texts[int(np.argmax(tensions))]
    canvas.label(", ".join(texts) if len(texts) <= 2 else f"max {largest}", at, PALETTE.cable, 0.5, LAYOUT.small_font)
