"""The strip chart: forces and set-point over the last steps."""

from itertools import pairwise

import numpy as np

from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.page import Region
from ccr_gym.rendering.palette import LAYOUT, PALETTE, Color
from ccr_gym.rendering.units import force_unit, round_step, round_ticks

TICKS = 5


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
    for history, width, color in (
        (desired, 3.4, PALETTE.desired),
        (estimate, 1.6, PALETTE.force_est),
        (true, 1.6, PALETTE.force_true),
    ):
        if history is not None and len(history):
            draw_history(canvas, np.asarray(history, dtype=float) / frame.force_scale, plot, span, width, color)


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
    first = 0 if frame.step is None else frame.step - count + 1
    for step in step_ticks(first, span):
        x = plot.left + (step - first) / span * plot.width
        canvas.box(x - 0.5, plot.bottom, 1, 4, PALETTE.muted)
        canvas.label(str(step), (x, plot.bottom + 13), PALETTE.muted, 0.5, LAYOUT.small_font)
    canvas.label(
        "step", (plot.right + 18, plot.bottom + 13), PALETTE.muted, 0, LAYOUT.small_font
    )  # beside the last one


def step_ticks(first: int, span: int) -> list[int]:
    """Return the round numbers of steps among those that the chart shows."""
    every = max(1, round(round_step(span, 6)))
    return list(range(-(-first // every) * every, first + span + 1, every))


def draw_history(canvas: Canvas, parts: np.ndarray, plot: Region, span: int, width: float, color: Color) -> None:
    """Draw forces over the full scale as a line, clipped to the scale, with gaps where a number is not finite."""
    x = plot.left + np.arange(len(parts)) / span * plot.width
    points = np.column_stack([x, plot.bottom - np.clip(parts, 0.0, 1.0) * plot.height])
    finite = np.isfinite(parts)
    for index, (start, end) in enumerate(pairwise(points)):
        if finite[index] and finite[index + 1]:
            canvas.line([start, end], width, color)
    if finite[-1]:
        canvas.disc(points[-1], 1.2 * width + 1, color)
