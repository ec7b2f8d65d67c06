"""Pictures of the robot, its obstacles and its contact force, drawn off-screen with pygame."""

from typing import TYPE_CHECKING

import numpy as np

from ccr_gym.rendering.banners import draw_footer, draw_legend, draw_title
from ccr_gym.rendering.canvas import Canvas, import_pygame
from ccr_gym.rendering.chart import draw_chart
from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.gauge import draw_panel
from ccr_gym.rendering.page import Page
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
        self._dismissed = False

    def draw(self, frame: Frame) -> np.ndarray:
        """Return the picture of a frame, ``(height, width, 3)`` uint8; needs no display."""
        pixels = self._pygame.surfarray.array3d(self._picture(frame))
        return np.ascontiguousarray(pixels.transpose(1, 0, 2))

    def show(self, frame: Frame) -> None:
        """Show a frame in the window, which the first call opens, and wait until the next frame is due.

        Once the user has closed the window, nothing is shown until :meth:`close` is called.
        """
        if self._dismissed:
            return
        if self._window is None or self._pygame.display.get_surface() is not self._window:
            self._open()
        assert self._window is not None
        assert self._clock is not None
        if any(event.type == self._pygame.QUIT for event in self._pygame.event.get()):
            self.close()
            self._dismissed = True
            return
        self._window.blit(self._picture(frame), (0, 0))
        self._pygame.display.flip()
        self._clock.tick(self._fps)

    def close(self) -> None:
        """Close the window, if it is open; the next frame that is shown opens another."""
        if self._window is not None and self._pygame.display.get_surface() is self._window:
            self._pygame.display.quit()
        self._window = self._clock = None
        self._dismissed = False

    def _open(self) -> None:
        self._pygame.display.init()
        self._pygame.display.set_caption("ccr-gym")
        self._window = self._pygame.display.set_mode(self._size)
        self._clock = self._pygame.time.Clock()

    def _picture(self, frame: Frame) -> "pygame.Surface":
        canvas = Canvas(self._pygame, self._size)
        page = Page.divide(canvas.region.width, canvas.region.height, frame.has_title, frame.has_chart)
        draw_world = draw_space if isinstance(frame.equilibrium, SpatialEquilibrium) else draw_plane
        draw_world(canvas, frame, page.world)
        draw_chart(canvas, frame, page.chart)
        draw_panel(canvas, frame, page.panel)
        draw_title(canvas, frame, page.title)
        draw_legend(canvas, frame, page.legend)
        draw_footer(canvas, frame, page.footer)
        return canvas.finish()
