"""GIFs of the environment's own pictures."""

from collections.abc import Generator
from pathlib import Path

import imageio_ffmpeg
import numpy as np

EVERY = 4  # ticks between pictures
FPS = 10
MOST = 300  # pictures of a file
OWN_PALETTES = "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1:dither=none"  # one a picture

Stream = Generator[None, np.ndarray | None, None]


class Recorder:
    """Writes pictures to a file as they come: a process of its own encodes them, which takes no memory or time here.

    Args:
        folder: Folder of the files, made when the first begins.

    Attributes:
        path: File of the recording under way, or None.
    """

    def __init__(self, folder: Path) -> None:
        self.path: Path | None = None
        self._folder, self._count = folder, 0
        self._stream: Stream | None = None

    def start(self) -> None:
        """Begin a file that is not there yet.

        Raises:
            OSError: If the folder cannot be made.
        """
        self._folder.mkdir(parents=True, exist_ok=True)
        taken = {path.name for path in self._folder.glob("play-*.gif")}
        self.path = next(self._folder / name for i in range(10**6) if (name := f"play-{i:03d}.gif") not in taken)

    @property
    def full(self) -> bool:
        """Whether the file has as many pictures as it may have."""
        return self._count >= MOST

    def add(self, picture: np.ndarray) -> None:
        """Add a picture, ``(H, W, 3)`` uint8, all of which have the same size.

        Raises:
            OSError: If the file cannot be written.
        """
        if self.path is None:
            return
        if self._stream is None:
            self._stream = _stream(self.path, picture.shape[1], picture.shape[0])
        self._stream.send(np.ascontiguousarray(picture))
        self._count += 1

    def stop(self) -> Path | None:
        """End the file and return its path, or None if there is no recording or no picture in it."""
        path, self.path, self._count = self.path, None, 0
        stream, self._stream = self._stream, None
        if stream is None:
            return None
        stream.close()
        return path


def _stream(path: Path, width: int, height: int) -> Stream:
    """Return what takes pictures and encodes them."""
    stream: Stream = imageio_ffmpeg.write_frames(
        str(path), (width, height), fps=FPS, codec="gif", pix_fmt_out="pal8", quality=None, macro_block_size=1,
        ffmpeg_log_level="error", output_params=["-filter_complex", OWN_PALETTES],
    )  # fmt: skip
    stream.send(None)
    return stream
