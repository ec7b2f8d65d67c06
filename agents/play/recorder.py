"""GIFs of the environment's own pictures."""

from pathlib import Path
from typing import Any

import imageio.v2 as imageio
import numpy as np

EVERY = 4  # ticks between pictures
FPS = 10
MOST = 300  # pictures of a file


class Recorder:
    """Writes pictures to a file as they come, so that a long recording takes no memory.

    Args:
        folder: Folder of the files, made when the first begins.

    Attributes:
        path: File of the recording under way, or None.
    """

    def __init__(self, folder: Path) -> None:
        self.path: Path | None = None
        self._folder, self._count, self._writer = folder, 0, None

    def start(self) -> None:
        """Begin a file that is not there yet."""
        self._folder.mkdir(parents=True, exist_ok=True)
        taken = {path.name for path in self._folder.glob("play-*.gif")}
        self.path = next(self._folder / name for i in range(10**6) if (name := f"play-{i:03d}.gif") not in taken)
        self._writer: Any = imageio.get_writer(self.path, mode="I", duration=1000 / FPS, loop=0)
        self._count = 0

    @property
    def full(self) -> bool:
        """Whether the file has as many pictures as it may have."""
        return self._count >= MOST

    def add(self, picture: np.ndarray) -> None:
        """Add a picture, ``(H, W, 3)`` uint8."""
        self._writer.append_data(picture)
        self._count += 1

    def stop(self) -> Path | None:
        """End the file and return its path, or None if there is no recording."""
        path, self.path = self.path, None
        if path is not None:
            self._writer.close()
        return path
