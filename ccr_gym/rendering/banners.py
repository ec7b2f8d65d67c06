"""The lines above and below the world: title, legend, and cable displacements with the solver's status."""

import math
from collections.abc import Callable

import numpy as np

from ccr_gym.rendering.canvas import Canvas
from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.marks import draw_arrow, draw_marker
from ccr_gym.rendering.page import Region
from ccr_gym.rendering.palette import LAYOUT, PALETTE, STATUS_COLORS, Color, contact_color
from ccr_gym.rendering.units import length_text, signed

Glyph = Callable[[Canvas, float, float], None]  # draws from x on at the height y
MANY_CABLES = 6  # of which the footer names the range


def draw_title(canvas: Canvas, frame: Frame, region: Region) -> None:
    """Draw title, step and reward."""
    if not frame.has_title:
        return
    canvas.fill(region, PALETTE.panel)
    y = region.top + 0.5 * region.height + 2
    canvas.label(frame.title, (region.left + LAYOUT.margin, y), PALETTE.ink)
    texts = [f"step {frame.step}"] if frame.step is not None else []
    if frame.reward is not None:
        texts.append(f"reward {signed(f'{frame.reward:.3f}')}")
    canvas.label("     ".join(texts), (region.right - LAYOUT.margin, y), PALETTE.ink, 1)


def draw_legend(canvas: Canvas, frame: Frame, region: Region) -> None:
    """Draw the legend of lines, markers and arrows, evenly spread over a line."""
    if not region.height:
        return
    canvas.fill(region, PALETTE.panel)
    canvas.box(region.left, region.bottom - 1, region.width, 1, PALETTE.border)
    entries = legend_entries(frame)
    widths = [LAYOUT.glyph + 5 + canvas.text_width(name, LAYOUT.small_font) for name, _ in entries]
    free = region.width - 2 * LAYOUT.margin - sum(widths)
    gap = min(free / (len(entries) - 1), 26.0)
    x, y = region.left + LAYOUT.margin, region.top + 0.5 * region.height
    for (name, glyph), width in zip(entries, widths, strict=True):
        glyph(canvas, x, y)
        canvas.label(name, (x + LAYOUT.glyph + 5, y), PALETTE.ink, size=LAYOUT.small_font)
        x += width + gap


def legend_entries(frame: Frame) -> list[tuple[str, Glyph]]:
    """Return names and glyphs of what is drawn; a slack cable only of robots that can have one."""
    robot = frame.equilibrium.robot
    slack = [("slack", _line(1.9, PALETTE.slack))] if robot.model == "rod" or robot.least_cable_mm < 0 else []
    return [
        ("backbone", _line(4.0, PALETTE.backbone)),
        ("taut cable" if slack else "cable", _line(1.9, PALETTE.cable)),
        *slack,
        ("contact", _contacts),
        ("force on obstacle", _arrow(LAYOUT.arrow, PALETTE.force_true)),
        ("estimate", _arrow(LAYOUT.arrow_slim, PALETTE.force_est)),
        ("goal", _line(3.0, PALETTE.desired)),
    ]


def _line(width: float, color: Color) -> Glyph:
    return lambda canvas, x, y: canvas.line([(x, y), (x + LAYOUT.glyph, y)], width, color)


def _arrow(width: float, color: Color) -> Glyph:
    return lambda canvas, x, y: draw_arrow(canvas, (x, y), np.array([LAYOUT.glyph, 0.0]), width, color)


def _contacts(canvas: Canvas, x: float, y: float) -> None:
    for part, shift in ((0.0, 4.0), (0.25, 12.0), (1.0, 20.0)):
        draw_marker(canvas, (x + shift, y), 4.0, contact_color(part))


def draw_footer(canvas: Canvas, frame: Frame, region: Region) -> None:
    """Draw cable displacements, and how the solver's step ended."""
    equilibrium = frame.equilibrium
    canvas.fill(region, PALETTE.panel)
    canvas.box(region.left, region.top, region.width, 1, PALETTE.border)
    y, color = region.top + 0.5 * region.height, STATUS_COLORS[equilibrium.status]
    cables, resolution = equilibrium.cables_mm, displacement_digits(equilibrium.robot.offset_mm)
    canvas.label(cables_text(cables, resolution), (region.left + LAYOUT.margin, y), PALETTE.ink)
    status = equilibrium.status.name.lower().replace("_", " ")
    canvas.label(status, (region.right - LAYOUT.margin, y), color, 1)
    canvas.disc((region.right - LAYOUT.margin - canvas.text_width(status) - 12, y), 4, color)


def displacement_digits(offset_mm: float) -> float:
    """Return the resolution at which displacements are shown, a power of ten of about a thousandth of the offset."""
    return float(10.0 ** math.floor(math.log10(offset_mm / 300)))


def cables_text(cables_mm: np.ndarray, resolution_mm: float) -> str:
    """Return the displacements of all cables as text, or of many their range."""
    texts = [length_text(cable, resolution_mm, unit=False) for cable in cables_mm.tolist()]
    if len(texts) > MANY_CABLES:
        low, high = float(cables_mm.min()), float(cables_mm.max())
        lowest = length_text(low, resolution_mm, unit=False)
        return f"{len(texts)} cables from {lowest} to {length_text(high, resolution_mm)}"
    last = length_text(float(cables_mm[-1]), resolution_mm)
    return f"cable{'s' * (len(texts) > 1)} {', '.join([*texts[:-1], last])}"
