"""The strip chart: forces and set-point over the last steps."""

from itertools import pairwise

import numpy as np

from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.page import Region
from ccr_gym.rendering.palette import LAYOUT, PALETTE, Color
from ccr_gym.rendering.units import force_unit, round_ticks

TICKS = 3


def draw_chart(canvas: Canvas, frame: Frame, chart: Region) -> None:
    """Draw the histories of a frame; the present step is where their lines end."""
    if not frame.has_chart:
        return
    canvas.fill(chart, PALETTE.panel)
    canvas.box(chart.left, chart.top, chart.width, 1, PALETTE.border)
    plot = Region(chart.left + 52, chart.top + 12, chart.width - 52 - 58, chart.height - 36)
    count = max(len(history) for history in frame.histories if history is not None)
    span = max(count, LAYOUT.chart_steps) - 1
    draw_axes(canvas, frame, plot, count, span)
    true, estimate, desired = frame.histories
    draw_history(canvas, desired, frame.force_scale, plot, span, 3.4, PALETTE.desired)
    draw_history(canvas, estimate, frame.force_scale, plot, span, 1.6, PALETTE.force_est)
    draw_history(canvas, true, frame.force_scale, plot, span, 1.6, PALETTE.force_true)


def draw_axes(canvas: Canvas, frame: Frame, plot: Region, count: int, span: int) -> None:
    """Draw frame, ticks and labels of the chart."""
    canvas.fill(plot, PALETTE.background)
    unit = force_unit(frame.force_scale)
    for tick in round_ticks(frame.force_scale * unit.per_newton, TICKS):
        y = plot.bottom - tick / (frame.force_scale * unit.per_newton) * plot.height
        canvas.box(plot.left, y - 0.5, plot.width, 1, PALETTE.grid)
        canvas.label(f"{tick:.4g}", (plot.left - 6, y), PALETTE.muted, 1, LAYOUT.small_font)
    canvas.box(plot.left, plot.bottom, plot.width, 1, PALETTE.muted)
    canvas.label(unit.name, (plot.right + 8, plot.top + 4), PALETTE.muted, 0, LAYOUT.small_font)
    now = count - 1 if frame.step is None else frame.step
    for step in round_ticks(span, 6).astype(int):
        x = plot.left + step / span * plot.width
        canvas.box(x - 0.5, plot.bottom, 1, 4, PALETTE.muted)
        text = str(step - count + 1 + now)
        canvas.label(text, (x, plot.bottom + 13), PALETTE.muted, 0.5, LAYOUT.small_font)
    canvas.label("step", (plot.right + 8, plot.bottom + 13), PALETTE.muted, 0, LAYOUT.small_font)


def draw_history(
    canvas: Canvas, history: np.ndarray | None, full_scale: float, plot: Region, span: int, width: float, color: Color
) -> None:
    """Draw one line, clipped to the scale, with gaps where a number is not finite."""
    if history is None or not len(history):
        return
    parts = np.asarray(history, dtype=float) / full_scale
    x = plot.left + np.arange(len(parts)) / span * plot.width
    points = np.column_stack([x, plot.bottom - np.clip(parts, 0.0, 1.0) * plot.height])
    finite = np.isfinite(parts)
    for index, (start, end) in enumerate(pairwise(points)):
        if finite[index] and finite[index + 1]:
            canvas.line([start, end], width, color)
    if finite[-1]:
        canvas.disc(points[-1], 1.2 * width + 1, color)
