"""Pictures of the robot, its obstacles and its contact force, drawn off-screen with pygame."""

from typing import TYPE_CHECKING

import numpy as np

from ccr_gym.rendering.canvas import Canvas, import_pygame
from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.gauge import draw_footer, draw_gauge
from ccr_gym.rendering.planar import draw_plane
from ccr_gym.rendering.spatial import draw_space
from solver.spatial import SpatialEquilibrium

if TYPE_CHECKING:
    import pygame


class Renderer:
    """Draws frames as arrays or in a window.

    Args:
        fps: Frame rate of :meth:`show` [1/s].
        size: Width and height of the picture [px].

    Raises:
        DependencyNotInstalled: If pygame is missing.
    """

    def __init__(self, fps: int, size: tuple[int, int] = (640, 640)) -> None:
        self._pygame = import_pygame()
        self._fps = fps
        self._size = size
        self._window: pygame.Surface | None = None
        self._clock: pygame.time.Clock | None = None

    def draw(self, frame: Frame) -> np.ndarray:
        """Return the picture of a frame, ``(height, width, 3)`` uint8; needs no display."""
        pixels = self._pygame.surfarray.array3d(self._picture(frame))
        return np.ascontiguousarray(pixels.transpose(1, 0, 2))

    def show(self, frame: Frame) -> None:
        """Show a frame in the window, which the first call opens, and wait until the next frame is due."""
        if self._window is None or self._pygame.display.get_surface() is not self._window:
            self._open()
        assert self._window is not None
        assert self._clock is not None
        self._pygame.event.pump()
        self._window.blit(self._picture(frame), (0, 0))
        self._pygame.display.flip()
        self._clock.tick(self._fps)

    def close(self) -> None:
        """Close the window, if it is open."""
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
        draw_world = draw_space if isinstance(frame.equilibrium, SpatialEquilibrium) else draw_plane
        draw_world(canvas, frame)
        draw_gauge(canvas, frame)
        draw_footer(canvas, frame.equilibrium)
        return canvas.finish()
