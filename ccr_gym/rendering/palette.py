"""Colours and dimensions of the pictures."""

from dataclasses import dataclass

from solver import Status

Color = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Palette:
    """Colours of the pictures."""

    background: Color = (249, 250, 252)
    grid: Color = (236, 239, 244)
    panel: Color = (255, 255, 255)
    border: Color = (216, 221, 230)
    ink: Color = (38, 48, 68)
    muted: Color = (118, 129, 150)
    clamp: Color = (74, 85, 108)
    backbone: Color = (33, 60, 114)
    cable: Color = (150, 106, 74)
    disk: Color = (132, 150, 184)
    obstacle: Color = (204, 212, 223)
    hatch: Color = (176, 187, 203)
    outline: Color = (128, 141, 162)
    cell: Color = (164, 175, 193)
    contact: Color = (214, 40, 78)
    force_true: Color = (0, 140, 126)
    force_est: Color = (244, 146, 30)
    desired: Color = (112, 62, 184)


@dataclass(frozen=True, slots=True)
class PictureLayout:
    """Dimensions: ``*_mm`` in the world [mm], the rest in canvas units, 640 of which span its shorter side."""

    short_side: float = 640.0
    supersampling: int = 4

    left_mm: float = -60.0
    right_mm: float = 150.0
    bottom_mm: float = -20.0
    top_mm: float = 200.0
    grid_mm: float = 20.0

    panel: float = 104.0
    footer: float = 36.0
    margin: float = 16.0
    font: float = 19.0
    row: float = 19.0
    glyph: float = 28.0

    backbone: float = 5.0
    cable: float = 1.8
    disk: float = 1.6
    major_disk: float = 3.4
    outline: float = 1.6
    contact: float = 6.0

    arrow_mm: float = 45.0
    arrow: float = 5.0
    arrow_slim: float = 2.2
    arrow_reach: float = 1.3

    plate_mm: float = 30.0
    plate_thickness_mm: float = 3.0
    hatch_mm: float = 8.0
    horizon_mm: float = 300.0
    hatch: float = 1.0
    wall: float = 3.0

    gauge_height: float = 330.0
    gauge_bar: float = 14.0
    gauge_ticks: int = 4


PALETTE = Palette()
LAYOUT = PictureLayout()
STATUS_COLORS: dict[Status, Color] = {
    Status.CONVERGED: PALETTE.force_true,
    Status.SNAPPED: PALETTE.desired,
    Status.STALLED: PALETTE.force_est,
    Status.BLOCKED: PALETTE.force_est,
    Status.GAVE_UP: PALETTE.contact,
}
