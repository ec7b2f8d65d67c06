"""The surface that pictures are drawn on."""

import math
import os
from itertools import pairwise
from types import ModuleType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import ArrayLike

from ccr_gym.rendering.camera import Camera
from ccr_gym.rendering.palette import LAYOUT, PALETTE, Color

if TYPE_CHECKING:
    import pygame


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


class Label(NamedTuple):
    """A line of text, vertically centred on ``at``; ``align`` is the fraction of its width to the left of ``at``."""

    text: str
    at: tuple[float, float]
    color: Color
    align: float


class Canvas:
    """A drawing surface whose shorter side is ``LAYOUT.short_side`` units long; origin top left, y down.

    Shapes are drawn at ``LAYOUT.supersampling`` times the resolution and scaled down; text is added afterwards.

    Args:
        pygame: The pygame module.
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
        """Return the picture at its final resolution."""
        picture = self._pygame.transform.smoothscale(self._surface, self._size)
        font = self._pygame.font.Font(None, round(LAYOUT.font * self._unit))
        for text, (x, y), color, align in self._labels:
            words = font.render(text, True, color)
            picture.blit(words, (x * self._unit - align * words.get_width(), y * self._unit - words.get_height() / 2))
        return picture  # type: ignore[no-any-return]
