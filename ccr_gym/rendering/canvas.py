"""The surface that pictures are drawn on."""

import os
from collections.abc import Iterable
from itertools import repeat
from types import ModuleType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import ArrayLike

from ccr_gym.rendering.page import Region
from ccr_gym.rendering.palette import LAYOUT, PALETTE, Color, snap

if TYPE_CHECKING:
    import pygame

AROUND = [(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y]  # pixels of a rim around text


def import_pygame() -> ModuleType:
    """Import pygame with its font module initialised and its banner suppressed.

    Raises:
        DependencyNotInstalled: If pygame is missing.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    try:
        import pygame
    except ImportError as error:
        raise DependencyNotInstalled('pygame is not installed; run `pip install "ccr-gym[render]"`') from error
    pygame.font.init()
    return pygame


def shorter_side(pixels: int) -> float:
    """Return the units along the shorter side of a picture: fewer in small ones, whose text would be too small."""
    return min(max(pixels / LAYOUT.least_unit, LAYOUT.smallest_side), LAYOUT.short_side)


class Label(NamedTuple):
    """A line of text, vertically centred on ``at``; ``align`` is the fraction of its width to the left of ``at``."""

    text: str
    at: tuple[float, float]
    color: Color
    align: float
    size: float
    within: Region


class Canvas:
    """A drawing surface whose shorter side is ``shorter_side`` units long; origin top left, y down.

    Shapes are drawn at ``LAYOUT.supersampling`` times the resolution and scaled down; text is added afterwards.

    Args:
        pygame: The pygame module.
        size: Width and height of the finished picture [px].
    """

    _fonts: "dict[float, pygame.font.Font]"

    def __init__(self, pygame: ModuleType, size: tuple[int, int]) -> None:
        self._pygame = pygame
        self._size = size
        self._unit = min(size) / shorter_side(min(size))
        self._scale = self._unit * LAYOUT.supersampling
        self._surface = pygame.Surface([side * LAYOUT.supersampling for side in size], 0, 32)
        self._labels: list[Label] = []
        self._fonts = {}
        self._surface.fill(PALETTE.background)
        self.region = Region(0.0, 0.0, size[0] / self._unit, size[1] / self._unit)

    def polygon(self, points: ArrayLike, color: Color) -> None:
        """Fill a polygon, ``(k, 2)``."""
        self._pygame.draw.polygon(self._surface, color, snap(np.asarray(points) * self._scale).tolist())

    def box(self, left: float, top: float, width: float, height: float, color: Color) -> None:
        """Fill a rectangle."""
        right, bottom = left + width, top + height
        self.polygon([(left, top), (right, top), (right, bottom), (left, bottom)], color)

    def fill(self, region: Region, color: Color) -> None:
        """Fill a region."""
        self.box(*region, color)

    def disc(self, center: ArrayLike, radius: float, color: Color) -> None:
        """Fill a disc."""
        middle = snap(np.asarray(center) * self._scale).tolist()
        self._pygame.draw.circle(self._surface, color, middle, max(int(snap(radius * self._scale)), 1))

    def polygons(self, corners: np.ndarray, colors: Iterable[Color]) -> None:
        """Fill polygons of as many corners each, ``(k, c, 2)``."""
        for points, color in zip(snap(corners * self._scale).tolist(), colors, strict=False):
            self._pygame.draw.polygon(self._surface, color, points)

    def segments(self, starts: np.ndarray, ends: np.ndarray, width: float, color: Color) -> None:
        """Draw straight lines with square ends, ``(k, 2)`` each."""
        along = ends - starts
        lengths = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)[:, None]
        side = 0.5 * width * np.column_stack([-along[:, 1], along[:, 0]]) / lengths
        self.polygons(np.stack([starts + side, ends + side, ends - side, starts - side], axis=1), repeat(color))

    def line(self, points: ArrayLike, width: float, color: Color) -> None:
        """Draw a polyline with round joints and ends, ``(k, 2)``."""
        path = np.asarray(points, dtype=float)
        self.segments(path[:-1], path[1:], width, color)
        radius = max(int(snap(0.5 * width * self._scale)), 1)
        for middle in snap(path * self._scale).tolist():
            self._pygame.draw.circle(self._surface, color, middle, radius)

    def dashes(self, points: ArrayLike, width: float, color: Color, dash: float = 5.0) -> None:
        """Draw a dashed polyline, ``(k, 2)``."""
        path = np.asarray(points, dtype=float)
        lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
        starts = np.arange(0.0, lengths[-1] - 0.1 * dash, 2 * dash)
        first, last = (
            np.column_stack([np.interp(at, lengths, path[:, axis]) for axis in (0, 1)])
            for at in (starts, starts + dash)
        )
        self.segments(first, last, width, color)

    def label(
        self,
        text: str,
        at: ArrayLike,
        color: Color,
        align: float = 0.0,
        size: float = LAYOUT.font,
        within: Region | None = None,
    ) -> None:
        """Write a line of text, shifted so that it is not cut.

        Args:
            text: The text.
            at: Its place, at half its height.
            color: Its colour.
            align: 0 for a place at its left, 0.5 in the middle, 1 at its right.
            size: Size of the font.
            within: Region that holds the text, ``None`` for the canvas; text within a region has a light rim.
        """
        x, y = np.asarray(at, dtype=float).tolist()
        self._labels.append(Label(text, (x, y), color, align, size, within or self.region))

    def text_width(self, text: str, size: float = LAYOUT.font) -> float:
        """Return the width of a line of text."""
        return float(self._font(size).size(text)[0]) / self._unit

    def finish(self) -> "pygame.Surface":
        """Return the picture at its final resolution."""
        picture = self._pygame.transform.smoothscale(self._surface, self._size)
        for label in self._labels:
            self._write(picture, label)
        return picture  # type: ignore[no-any-return]

    def _write(self, picture: "pygame.Surface", label: Label) -> None:
        font, (x, y) = self._font(label.size), label.at
        width, height = font.size(label.text)
        region, edge = label.within, 2.0
        left = x * self._unit - label.align * width
        top = y * self._unit - height / 2
        left = max(min(left, (region.right - edge) * self._unit - width), (region.left + edge) * self._unit)
        top = max(min(top, region.bottom * self._unit - height), region.top * self._unit)
        column, row = snap(np.array([left, top])).tolist()
        if region is not self.region:
            rim = font.render(label.text, True, PALETTE.background)
            picture.blits([(rim, (column + across, row + down)) for across, down in AROUND])
        picture.blit(font.render(label.text, True, label.color), (column, row))

    def _font(self, size: float) -> "pygame.font.Font":
        if size not in self._fonts:
            self._fonts[size] = self._pygame.font.Font(None, max(round(size * self._unit), 1))
        return self._fonts[size]
