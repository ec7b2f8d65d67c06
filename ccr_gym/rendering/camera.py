"""The map from the world to the canvas."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ccr_gym.rendering.palette import LAYOUT


class Camera(NamedTuple):
    """The map from the world, y up [mm], to the canvas, y down.

    Attributes:
        scale: Canvas units per millimetre.
        x: Canvas x of the world's origin.
        y: Canvas y of the world's origin.
    """

    scale: float
    x: float
    y: float

    @property
    def center(self) -> np.ndarray:
        """Centre of the view, ``(2,)`` [mm]."""
        return 0.5 * np.array([LAYOUT.left_mm + LAYOUT.right_mm, LAYOUT.bottom_mm + LAYOUT.top_mm])

    @classmethod
    def fit(cls, width: float, height: float) -> "Camera":
        """Fit the view of ``LAYOUT`` into a canvas region at the top left, centred and with equal aspect."""
        scale = min(width / (LAYOUT.right_mm - LAYOUT.left_mm), height / (LAYOUT.top_mm - LAYOUT.bottom_mm))
        middle_x, middle_y = 0.5 * (LAYOUT.left_mm + LAYOUT.right_mm), 0.5 * (LAYOUT.bottom_mm + LAYOUT.top_mm)
        return cls(scale, 0.5 * width - scale * middle_x, 0.5 * height + scale * middle_y)

    def __call__(self, points: ArrayLike) -> np.ndarray:
        """Return canvas positions of world points, ``(…, 2)`` [mm]."""
        return np.asarray(points, dtype=float) * (self.scale, -self.scale) + (self.x, self.y)
