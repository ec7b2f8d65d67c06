"""Several pictures as one."""

import math
from collections.abc import Sequence

import numpy as np

from ccr_gym.rendering.palette import PALETTE

MOST_TILES = 9
GAP = 2  # between pictures [px]


def tile(pictures: Sequence[np.ndarray]) -> np.ndarray:
    """Return the first pictures, at most nine, as one picture of a grid, ``(height, width, 3)`` uint8.

    Args:
        pictures: Pictures of one size, ``(h, w, 3)`` uint8 each.

    Raises:
        ValueError: If there is no picture, or they differ in size.
    """
    shown = list(pictures)[:MOST_TILES]
    sizes = {picture.shape for picture in shown}
    if len(sizes) != 1:
        raise ValueError(f"pictures have {len(sizes)} sizes, {sorted(sizes)}; give at least one picture, all of a size")
    height, width, _ = sizes.pop()
    columns = math.ceil(math.sqrt(len(shown)))
    rows = math.ceil(len(shown) / columns)
    size = rows * (height + GAP) - GAP, columns * (width + GAP) - GAP, 3
    grid = np.empty(size, np.uint8)
    grid[:] = PALETTE.border
    for index, picture in enumerate(shown):
        row, column = divmod(index, columns)
        top, left = row * (height + GAP), column * (width + GAP)
        grid[top : top + height, left : left + width] = picture
    return grid
