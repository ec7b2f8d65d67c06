"""Colours and dimensions of the pictures."""

from dataclasses import dataclass

import numpy as np

from solver import Status

Color = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Palette:
    """Colours of the pictures."""

    background: Color = (250, 251, 253)
    grid: Color = (235, 238, 244)
    ground: Color = (243, 245, 249)
    shadow: Color = (219, 224, 233)
    panel: Color = (255, 255, 255)
    border: Color = (216, 221, 230)
    ink: Color = (38, 48, 68)
    muted: Color = (108, 119, 140)
    clamp: Color = (74, 85, 108)
    backbone: Color = (33, 60, 114)
    cable: Color = (128, 72, 28)
    slack: Color = (214, 190, 166)
    disk: Color = (132, 150, 184)
    obstacle: Color = (204, 212, 223)
    hatch: Color = (180, 190, 206)
    outline: Color = (122, 135, 157)
    spring: Color = (92, 66, 140)
    contact_light: Color = (252, 176, 188)
    contact: Color = (208, 24, 66)
    contact_dark: Color = (98, 0, 30)
    force_true: Color = (0, 140, 126)
    force_est: Color = (244, 146, 30)
    desired: Color = (112, 62, 184)


@dataclass(frozen=True, slots=True)
class PictureLayout:
    """Dimensions: ``*_part`` over the robot's longest length, the rest in units of the canvas, see ``short_side``."""

    short_side: float = 640.0  # of a picture, in units
    smallest_side: float = 420.0  # the same of small pictures, which have no legend
    least_unit: float = 0.75  # below which a picture is small [px]
    legend_width: float = 600.0
    supersampling: int = 4

    reach_part: float = 0.86
    back_part: float = 0.34
    top_part: float = 1.1
    bottom_part: float = 0.13
    bounds_part: float = 0.125  # views grow by whole multiples of it
    widest_part: float = 1.75  # farthest that a view reaches from the base
    grid_part: float = 0.1

    title: float = 28.0
    legend: float = 26.0
    chart: float = 118.0
    panel: float = 104.0
    footer: float = 32.0
    margin: float = 14.0
    font: float = 17.0
    small_font: float = 15.0
    glyph: float = 24.0

    outline: float = 1.6
    wall: float = 3.0
    arrow_part: float = 0.25
    arrow: float = 5.0
    arrow_slim: float = 2.6
    arrow_reach: float = 1.3

    plate_part: float = 0.14
    hatch_part: float = 0.045
    horizon_part: float = 4.0
    rail_part: float = 0.25  # longest rail of an insertion

    gauge_height: float = 300.0
    gauge_bar: float = 14.0
    tension_height: float = 64.0
    chart_steps: int = 64


PALETTE = Palette()
LAYOUT = PictureLayout()
STATUS_COLORS: dict[Status, Color] = {
    Status.CONVERGED: PALETTE.force_true,
    Status.SNAPPED: PALETTE.desired,
    Status.STALLED: PALETTE.force_est,
    Status.BLOCKED: PALETTE.force_est,
    Status.GAVE_UP: PALETTE.contact,
}

TIE = 1e-6  # keeps values at a half from being rounded by their last bits


def snap(values: np.ndarray | float) -> np.ndarray:
    """Return values rounded to whole numbers, the same for values that differ in their last bits."""
    return np.floor(np.asarray(values, dtype=float) + (0.5 - TIE)).astype(int)


def mix(first: Color, second: Color, part: float) -> Color:
    """Return the colour a part, from 0 to 1, of the way from the first to the second."""
    start, end = np.array(first, dtype=float), np.array(second, dtype=float)
    red, green, blue = snap(start + min(max(part, 0.0), 1.0) * (end - start)).tolist()
    return red, green, blue


def contact_color(part: float) -> Color:
    """Return the colour of a contact whose force is a part, from 0 to 1, of the full scale."""
    part = min(max(part, 0.0), 1.0) ** 0.5  # tells small forces apart
    if part < 0.5:
        return mix(PALETTE.contact_light, PALETTE.contact, 2 * part)
    return mix(PALETTE.contact, PALETTE.contact_dark, 2 * part - 1)
