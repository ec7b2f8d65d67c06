"""Files that are either written completely or not at all, and locks on folders."""

import contextlib
import errno
import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from agents.errors import UserError

JsonObject = dict[str, Any]  # its reader checks what it needs of the values
PARTIAL = ".partial-"  # prefix of a file while it is being written
LOCK = ".lock"


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Report every fault of the disk as one of a file that cannot be written."""
    try:
        yield
    except OSError as error:
        raise UserError(f"{path} cannot be written: {error.strerror or error}") from error


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path with the same suffix, whose file replaces ``path`` once it is on the disk.

    Raises:
        UserError: If the file cannot be written; ``path`` is then unchanged.
    """
    partial = path.with_name(PARTIAL + path.name)
    try:
        with _writing(path):
            yield partial
            with partial.open("rb") as written:
                os.fsync(written.fileno())
            partial.replace(path)
    finally:
        with contextlib.suppress(OSError):  # it is not there, also on a disk that cannot be written
            partial.unlink()


def check_writable(*paths: Path) -> None:
    """Refuse files that cannot be written, before the work whose results they are to take; make their folders.

    Raises:
        UserError: If one of them cannot be written.
        OSError: If a folder cannot be made.
    """
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        with _writing(path):
            if path.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            partial = path.with_name(PARTIAL + path.name)
            partial.touch()
            partial.unlink()


def write_text(path: Path, text: str) -> None:
    """Write a text file, either completely or not at all.

    Raises:
        UserError: If it cannot be written.
    """
    with replacing(path) as partial:
        partial.write_text(text)


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other processes out of a folder; the lock is released when the process ends, even if it is killed.

    Raises:
        UserError: If another process holds the lock.
    """
    with (folder / LOCK).open("a") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise UserError(
                f"another process is training in {folder}; wait until it ends, or choose another folder"
            ) from error
        yield
