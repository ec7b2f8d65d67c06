"""Pictures of the robot, its obstacles and its contact force, drawn off-screen with pygame."""

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import ArrayLike

from solver import Circle, Equilibrium, HalfPlane, Obstacle, Status

if TYPE_CHECKING:
    import pygame

Color = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Palette:
    """Colours of the picture."""

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
class Layout:
    """Lengths of the picture: ``*_mm`` in the world [mm], the rest in units of which its shorter side has 640."""

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
LAYOUT = Layout()
STATUS_COLORS: dict[Status, Color] = {
    Status.CONVERGED: PALETTE.force_true,
    Status.SNAPPED: PALETTE.desired,
    Status.STALLED: PALETTE.force_est,
    Status.BLOCKED: PALETTE.force_est,
    Status.GAVE_UP: PALETTE.contact,
}


@dataclass(frozen=True, slots=True)
class Frame:
    """What one picture shows.

    Attributes:
        equilibrium: The robot among its obstacles.
        force_true: Contact force on the robot by energy, base frame, ``(d,)`` [N].
        force_est: Contact force on the robot as estimated, base frame, ``(d,)`` [N].
        desired_force: Set-point of the force's magnitude [N].
        force_scale: Magnitude at which gauge and arrows have their full length, positive [N].
    """

    equilibrium: Any
    force_true: np.ndarray
    force_est: np.ndarray
    desired_force: float
    force_scale: float


class Renderer:
    """Draws frames as arrays, or in a window.

    Args:
        fps: Frames a second that :meth:`show` keeps to.
        draw_world: What draws the robot and its obstacles; ``None`` for those of the plane.
        size: Width and height of the picture [px].

    Raises:
        DependencyNotInstalled: If pygame is missing.
    """

    def __init__(
        self,
        fps: int,
        draw_world: "Callable[[Canvas, Frame], None] | None" = None,
        size: tuple[int, int] = (640, 640),
    ) -> None:
        self._pygame = import_pygame()
        self._draw_world = draw_world or draw_plane
        self._fps = fps
        self._size = size
        self._window: pygame.Surface | None = None
        self._clock: pygame.time.Clock | None = None

    def draw(self, frame: Frame) -> np.ndarray:
        """The picture of a frame, ``(height, width, 3)`` uint8. Needs no display."""
        pixels = self._pygame.surfarray.array3d(self._picture(frame))
        return np.ascontiguousarray(pixels.transpose(1, 0, 2))

    def show(self, frame: Frame) -> None:
        """Show a frame in the window, opened at the first call, and wait until the next one is due."""
        if self._window is None or self._pygame.display.get_surface() is not self._window:
            self._open()
        assert self._window is not None
        assert self._clock is not None
        self._pygame.event.pump()
        self._window.blit(self._picture(frame), (0, 0))
        self._pygame.display.flip()
        self._clock.tick(self._fps)

    def close(self) -> None:
        """Close the window, if any. Further calls do nothing."""
        if self._window is not None and self._pygame.display.get_surface() is self._window:
            self._pygame.display.quit()
        self._window = self._clock = None

    def _open(self) -> None:
        self._pygame.display.init()
        self._pygame.display.set_caption("ccr-gym")
        self._window = self._pygame.display.set_mode(self._size)
        self._clock = self._pygame.time.Clock()

    def _picture(self, frame: Frame) -> "pygame.Surface":
        canvas = Canvas(self._pygame, self._size)
        self._draw_world(canvas, frame)
        draw_gauge(canvas, frame)
        draw_footer(canvas, frame.equilibrium)
        return canvas.finish()


def import_pygame() -> Any:
    """The pygame module, with its font module ready and its banner kept off standard output.

    Raises:
        DependencyNotInstalled: If it is missing.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    try:
        import pygame
    except ImportError as error:
        raise DependencyNotInstalled('pygame is not installed; run `pip install "ccr-gym[render]"`') from error
    pygame.font.init()
    return pygame


class Label(NamedTuple):
    """A line of text; ``align`` is the part of its width that lies left of ``at``, which is at half its height."""

    text: str
    at: tuple[float, float]
    color: Color
    align: float


class Canvas:
    """A surface to draw on, in units of which its shorter side has ``LAYOUT.short_side``; origin top left, y down.

    Shapes are drawn at ``LAYOUT.supersampling`` times the resolution and scaled down, text after that.

    Args:
        pygame: The module.
        size: Width and height of the finished picture [px].
    """

    def __init__(self, pygame: ModuleType, size: tuple[int, int]) -> None:
        self._pygame = pygame
        self._size = size
        self._unit = min(size) / LAYOUT.short_side
        self._scale = self._unit * LAYOUT.supersampling
        self._surface = pygame.Surface([side * LAYOUT.supersampling for side in size], 0, 32)
        self._labels: list[Label] = []
        self._surface.fill(PALETTE.background)
        self.width = size[0] / self._unit
        self.height = size[1] / self._unit
        self.camera = Camera.fit(self.width - LAYOUT.panel, self.height - LAYOUT.footer)

    def polygon(self, points: ArrayLike, color: Color) -> None:
        """Fill a polygon, ``(k, 2)``."""
        self._pygame.draw.polygon(self._surface, color, np.rint(np.asarray(points) * self._scale).tolist())

    def box(self, left: float, top: float, width: float, height: float, color: Color) -> None:
        """Fill a rectangle."""
        right, bottom = left + width, top + height
        self.polygon([(left, top), (right, top), (right, bottom), (left, bottom)], color)

    def disc(self, center: ArrayLike, radius: float, color: Color) -> None:
        """Fill a disc."""
        middle = np.rint(np.asarray(center) * self._scale).tolist()
        self._pygame.draw.circle(self._surface, color, middle, radius * self._scale)

    def segment(self, start: np.ndarray, end: np.ndarray, width: float, color: Color) -> None:
        """Draw a straight line with square ends."""
        along = end - start
        side = 0.5 * width * np.array([-along[1], along[0]]) / max(math.hypot(*along), 1e-9)
        self.polygon([start + side, end + side, end - side, start - side], color)

    def line(self, points: ArrayLike, width: float, color: Color) -> None:
        """Draw a polyline with round joints and ends, ``(k, 2)``."""
        path = np.asarray(points, dtype=float)
        for start, end in pairwise(path):
            self.segment(start, end, width, color)
        for point in path:
            self.disc(point, 0.5 * width, color)

    def label(self, text: str, at: tuple[float, float], color: Color, align: float = 0.0) -> None:
        """Write a line of text; ``align`` is 0 for left, 0.5 for centred, 1 for right."""
        self._labels.append(Label(text, at, color, align))

    def finish(self) -> "pygame.Surface":
        """The picture at its final resolution."""
        picture = self._pygame.transform.smoothscale(self._surface, self._size)
        font = self._pygame.font.Font(None, round(LAYOUT.font * self._unit))
        for text, (x, y), color, align in self._labels:
            words = font.render(text, True, color)
            picture.blit(words, (x * self._unit - align * words.get_width(), y * self._unit - words.get_height() / 2))
        return picture  # type: ignore[no-any-return]


class Camera(NamedTuple):
    """Maps the world, y up [mm], to the canvas, y down.

    Attributes:
        scale: Canvas units a millimetre.
        x: Canvas position of the world's origin.
        y: Canvas position of the world's origin.
    """

    scale: float
    x: float
    y: float

    @property
    def center(self) -> np.ndarray:
        """Middle of the view, ``(2,)`` [mm]."""
        return 0.5 * np.array([LAYOUT.left_mm + LAYOUT.right_mm, LAYOUT.bottom_mm + LAYOUT.top_mm])

    @classmethod
    def fit(cls, width: float, height: float) -> "Camera":
        """Show the view of ``LAYOUT`` centred in a canvas region at the top left, with equal aspect."""
        scale = min(width / (LAYOUT.right_mm - LAYOUT.left_mm), height / (LAYOUT.top_mm - LAYOUT.bottom_mm))
        middle_x, middle_y = 0.5 * (LAYOUT.left_mm + LAYOUT.right_mm), 0.5 * (LAYOUT.bottom_mm + LAYOUT.top_mm)
        return cls(scale, 0.5 * width - scale * middle_x, 0.5 * height + scale * middle_y)

    def __call__(self, points: ArrayLike) -> np.ndarray:
        """Canvas positions of world points, ``(…, 2)`` [mm]."""
        return np.asarray(points, dtype=float) * (self.scale, -self.scale) + (self.x, self.y)


def draw_plane(canvas: Canvas, frame: Frame) -> None:
    """Everything left of the gauge and above the footer, in the plane."""
    equilibrium = frame.equilibrium
    draw_grid(canvas)
    for obstacle in equilibrium.scene_now:
        if isinstance(obstacle, Circle):
            draw_circle(canvas, obstacle)
        elif not isinstance(obstacle, HalfPlane):
            draw_solid(canvas, obstacle)
        elif obstacle.nodes is None:
            draw_wall(canvas, obstacle)
        else:
            draw_load_cell(canvas, obstacle, equilibrium)
    draw_robot(canvas, equilibrium)
    draw_forces(canvas, frame)
    draw_contacts(canvas, equilibrium)
    draw_legend(canvas)


def draw_grid(canvas: Canvas) -> None:
    """Lines of a square grid through the origin, and a bar as long as one square."""
    camera, step = canvas.camera, LAYOUT.grid_mm * canvas.camera.scale
    for x in np.arange(camera.x % step, canvas.width, step):
        canvas.line([(x, 0), (x, canvas.height)], 1, PALETTE.grid)
    for y in np.arange(camera.y % step, canvas.height, step):
        canvas.line([(0, y), (canvas.width, y)], 1, PALETTE.grid)
    left, y = LAYOUT.margin, canvas.height - LAYOUT.footer - LAYOUT.margin
    canvas.line([(left, y), (left + step, y)], 2, PALETTE.muted)
    for x in (left, left + step):
        canvas.line([(x, y - 4), (x, y + 4)], 2, PALETTE.muted)
    canvas.label(f"{LAYOUT.grid_mm:g} mm", (left + step + 10, y), PALETTE.muted)


def draw_circle(canvas: Canvas, circle: Circle) -> None:
    """A disc with a rim."""
    center, radius = canvas.camera(circle.center), circle.radius * canvas.camera.scale
    canvas.disc(center, radius, PALETTE.outline)
    canvas.disc(center, radius - LAYOUT.outline, PALETTE.obstacle)


def draw_solid(canvas: Canvas, obstacle: Obstacle) -> None:
    """A filled outline."""
    outline = canvas.camera(obstacle.outline())
    canvas.polygon(outline, PALETTE.obstacle)
    canvas.line(np.vstack([outline, outline[:1]]), LAYOUT.outline, PALETTE.outline)


def draw_wall(canvas: Canvas, wall: HalfPlane) -> None:
    """A half-plane, hatched all over."""
    inward, along = wall.axes
    reach = LAYOUT.horizon_mm
    center = wall.nearest(canvas.camera.center)
    canvas.polygon(surface_box(canvas, wall, center, 2 * reach, 0, reach), PALETTE.obstacle)
    for shift in np.arange(-2 * reach, reach, LAYOUT.hatch_mm):
        start = center + shift * along
        canvas.line(canvas.camera([start, start + reach * (inward + along)]), LAYOUT.hatch, PALETTE.hatch)
    canvas.line(canvas.camera([center - reach * along, center + reach * along]), LAYOUT.wall, PALETTE.outline)


def draw_load_cell(canvas: Canvas, cell: HalfPlane, equilibrium: Equilibrium) -> None:
    """A plate level with the nodes that can touch it, on a cell and its mount."""
    center = cell.nearest(equilibrium.nodes[list(cell.nodes or ()), :2].mean(axis=0))
    plate, thickness = LAYOUT.plate_mm, LAYOUT.plate_thickness_mm
    for width, near, far, color in (
        (0.30 * plate, thickness, thickness + 4, PALETTE.outline),
        (0.55 * plate, thickness + 4, thickness + 16, PALETTE.cell),
        (plate, 0, thickness, PALETTE.clamp),
    ):
        canvas.polygon(surface_box(canvas, cell, center, width, near, far), color)


def surface_box(
    canvas: Canvas, plane: HalfPlane, center: np.ndarray, width: float, near: float, far: float
) -> np.ndarray:
    """Canvas corners of a rectangle behind a surface, from depth ``near`` to ``far`` [mm], ``(4, 2)``."""
    inward, along = plane.axes
    corners = ((-0.5, near), (0.5, near), (0.5, far), (-0.5, far))
    return canvas.camera([center + across * width * along + depth * inward for across, depth in corners])


def draw_robot(canvas: Canvas, equilibrium: Equilibrium) -> None:
    """Clamp, disks, cable and backbone."""
    backbone, cable = canvas.camera(equilibrium.nodes[:, :2]), canvas.camera(equilibrium.cable_nodes)
    offset = equilibrium.robot.offset_mm
    canvas.polygon(
        canvas.camera([(-1.5 * offset, -8), (2.5 * offset, -8), (2.5 * offset, 0), (-1.5 * offset, 0)]), PALETTE.clamp
    )
    canvas.polygon(
        canvas.camera([(-3 * offset, -12), (4 * offset, -12), (4 * offset, -8), (-3 * offset, -8)]), PALETTE.outline
    )
    for node, ends in enumerate(zip(backbone, cable, strict=True)):
        canvas.line(np.array(ends), LAYOUT.disk if node % 2 else LAYOUT.major_disk, PALETTE.disk)
    canvas.line(cable, LAYOUT.cable, PALETTE.cable)
    canvas.line(backbone, LAYOUT.backbone, PALETTE.backbone)


def draw_contacts(canvas: Canvas, equilibrium: Equilibrium) -> None:
    """A marker on each point that touches an obstacle."""
    for point in canvas.camera(equilibrium.points[equilibrium.contact.any(axis=0)]):
        draw_marker(canvas, point)


def draw_marker(canvas: Canvas, at: ArrayLike) -> None:
    """The marker of a contact."""
    canvas.disc(at, LAYOUT.contact, PALETTE.panel)
    canvas.disc(at, LAYOUT.contact - 1, PALETTE.contact)
    canvas.disc(at, LAYOUT.contact - 3.5, PALETTE.panel)


def draw_forces(canvas: Canvas, frame: Frame) -> None:
    """Arrows of the true and estimated force on the obstacles, from the mean contact point; none without contact."""
    equilibrium = frame.equilibrium
    if not equilibrium.contact.any():
        return
    weights = np.where(equilibrium.contact, equilibrium.multipliers, 0.0).sum(axis=0)
    start = canvas.camera(np.average(equilibrium.points.reshape(-1, 2), axis=0, weights=weights.ravel()))
    for force, width, color in (
        (frame.force_true, LAYOUT.arrow, PALETTE.force_true),
        (frame.force_est, LAYOUT.arrow_slim, PALETTE.force_est),
    ):
        draw_arrow(canvas, start, arrow_of(canvas.camera, force, frame.force_scale), width, color)


def arrow_of(camera: Camera, force: np.ndarray, full_scale: float) -> np.ndarray:
    """Canvas vector of the reaction to a force on the robot, limited in length, zero for a force that is not finite."""
    return limited(force, full_scale) * (-LAYOUT.arrow_mm * camera.scale, LAYOUT.arrow_mm * camera.scale)


def limited(force: np.ndarray, full_scale: float) -> np.ndarray:
    """A force over the full scale, limited in size, zero for one that is not finite."""
    size = float(np.linalg.norm(force))
    if not (math.isfinite(size) and size > 0):
        return np.zeros_like(force)
    return np.asarray(force * (min(size / full_scale, LAYOUT.arrow_reach) / size))


def draw_arrow(canvas: Canvas, start: ArrayLike, vector: np.ndarray, width: float, color: Color) -> None:
    """An arrow with a light rim, shrunk in proportion when it is shorter than its head."""
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
    """What the lines, markers and arrows of the world mean, at its top left."""
    left, right, top, row = LAYOUT.margin, LAYOUT.margin + LAYOUT.glyph, LAYOUT.margin + 4, LAYOUT.row
    canvas.line([(left, top), (right, top)], LAYOUT.backbone, PALETTE.backbone)
    canvas.line([(left, top + row), (right, top + row)], LAYOUT.cable, PALETTE.cable)
    draw_marker(canvas, (0.5 * (left + right), top + 2 * row))
    sample = np.array([LAYOUT.glyph, 0.0])
    draw_arrow(canvas, (left, top + 3 * row), sample, LAYOUT.arrow, PALETTE.force_true)
    draw_arrow(canvas, (left, top + 4 * row), sample, LAYOUT.arrow_slim, PALETTE.force_est)
    for index, name in enumerate(("backbone", "cable", "contact", "force, true", "force, estimated")):
        canvas.label(name, (right + 10, top + index * row), PALETTE.ink)


def draw_gauge(canvas: Canvas, frame: Frame) -> None:
    """The panel at the right: force magnitudes against their set-point."""
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
    """The empty gauge and its ticks."""
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
    """The bars of the two forces and the line of the set-point, the last reading; all stay within the scale."""
    left, bar = canvas.width - LAYOUT.panel + 46, LAYOUT.gauge_bar
    heights = [LAYOUT.gauge_height * min(max(force / full_scale, 0.0), 1.0) for _, force, _ in readings]
    bottom = top + LAYOUT.gauge_height
    for index, (height, (_, _, color)) in enumerate(zip(heights[:-1], readings[:-1], strict=True)):
        if height > 0:
            canvas.box(left + 3 + index * (bar + 4), bottom - height, bar, height, color)
    y, right = bottom - heights[-1], left + 2 * bar + 10
    canvas.box(left - 3, y - 1.5, right - left + 6, 3, readings[-1][2])
    canvas.polygon([(right + 2, y), (right + 11, y - 6), (right + 11, y + 6)], readings[-1][2])


def draw_footer(canvas: Canvas, equilibrium: Any) -> None:
    """The line at the bottom: cable, tension and the solver's verdict."""
    top = canvas.height - LAYOUT.footer
    canvas.box(0, top, canvas.width, LAYOUT.footer, PALETTE.panel)
    canvas.box(0, top, canvas.width, 1, PALETTE.border)
    y, color = top + 0.5 * LAYOUT.footer, STATUS_COLORS[equilibrium.status]
    in_plane = isinstance(equilibrium, Equilibrium)
    cables = [equilibrium.cable_mm] if in_plane else equilibrium.cables_mm
    tensions = [equilibrium.tension] if in_plane else equilibrium.tensions
    shift = 150 + 45 * (len(cables) - 1)
    canvas.label(f"cable {', '.join(f'{cable:.2f}' for cable in cables)} mm", (LAYOUT.margin, y), PALETTE.ink)
    canvas.label(f"tension {', '.join(f'{t:.2f}' for t in tensions)} N", (LAYOUT.margin + shift, y), PALETTE.ink)
    canvas.disc((LAYOUT.margin + 2 * shift, y), 4, color)
    canvas.label(equilibrium.status.name.lower(), (LAYOUT.margin + 2 * shift + 12, y), color)
