"""Compiled functions, kept between runs: the part of the solver's cache that lives on disk."""

import contextlib
import functools
import hashlib
import os
import stat
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import platformdirs

PRIVATE = 0o700
OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


class StoreStatistics(NamedTuple):
    """Artefacts found sound, missing and built, damaged and rebuilt, and the size of all there are [bytes]."""

    hits: int
    builds: int
    rebuilds: int
    bytes: int


class ArtefactStore:
    """Files that take long to build, shared by runs and processes.

    An entry is named ``key.digest.suffix`` after the SHA-256 of its content and appears by one rename. So a damaged
    entry is never trusted, and processes that build the same one do not disturb each other. Entries are loaded as code:
    folder and entries must be the user's own, and nobody else may write to them or to a folder above.

    Args:
        folder: Where to keep them; ``None`` stands for ``$CCR_GYM_CACHE`` or else the user's cache folder. Where it
            cannot be written, or others may write to it, a temporary folder takes its place, with a warning.
        capacity: Bound on their size [bytes]; the least recently used go first.
    """

    def __init__(self, folder: Path | None = None, capacity: int = 64 * 2**20) -> None:
        chosen = folder or os.environ.get("CCR_GYM_CACHE") or platformdirs.user_cache_path("ccr-gym")
        self._folder, self._capacity = Path(chosen).expanduser(), capacity
        self._hits = self._builds = self._rebuilds = 0

    def path(self, key: str, build: Callable[[Path], None], suffix: str) -> Path:
        """A sound artefact, built if it is missing or damaged.

        Args:
            key: Names all that the artefact depends on, see :func:`artefact_key`.
            build: Writes the artefact to the path it is given.
            suffix: File suffix with its dot.
        """
        self._leave_if_open_to_others()
        found = list(self._folder.glob(f"{key}.*{suffix}"))
        sound = next(filter(_is_sound, found), None)
        if sound:
            self._hits += 1
            with contextlib.suppress(OSError):
                os.utime(sound)
            return sound
        for damaged in found:
            _remove(damaged)
        self._rebuilds += bool(found)
        self._builds += not found
        entry = self._publish(key, build, suffix)
        self._trim(entry)
        return entry

    @property
    def statistics(self) -> StoreStatistics:
        """Use by this object, and the present size of the store."""
        return StoreStatistics(self._hits, self._builds, self._rebuilds, sum(size for _, size, _ in self._entries()))

    def _publish(self, key: str, build: Callable[[Path], None], suffix: str) -> Path:
        try:
            _make_private(self._folder)
            workspace = tempfile.TemporaryDirectory(dir=self._folder, prefix=".building-")
        except OSError as error:
            self._leave(f"cannot be written ({error.strerror})", "a writable folder")
            workspace = tempfile.TemporaryDirectory(dir=self._folder, prefix=".building-")
        with workspace as folder:
            fresh = Path(folder, f"fresh{suffix}")
            build(fresh)
            fresh.chmod(PRIVATE)
            entry = self._folder / f"{key}.{_digest(fresh)}{suffix}"
            os.replace(fresh, entry)
        return entry

    def _leave_if_open_to_others(self) -> None:
        place = self._folder.resolve()
        if place.exists() and not _is_private(place):
            self._leave(f"is not the user's alone (owner {place.stat().st_uid})", "a folder that is, with mode 700")
        elif shared := [str(above) for above in place.parents if above.exists() and not _is_safe_above(above)]:
            self._leave(f"is below {shared[0]}, which others may write to", "another folder")

    def _leave(self, why: str, instead: str) -> None:
        warnings.warn(
            f"{self._folder} {why}: what is built is lost with this process; set CCR_GYM_CACHE to {instead}",
            stacklevel=5,
        )
        self._folder = _process_folder()

    def _entries(self) -> list[tuple[Path, int, int]]:
        """(path, size, time of last use) of each."""
        entries = []
        for path in self._folder.glob("[!.]*"):
            with contextlib.suppress(OSError):
                entries.append((path, path.stat().st_size, path.stat().st_mtime_ns))
        return entries

    def _trim(self, kept: Path) -> None:
        entries = sorted(self._entries(), key=lambda entry: entry[2])
        excess = sum(size for _, size, _ in entries) - self._capacity
        for path, size, _ in entries:
            if excess > 0 and path != kept:
                _remove(path)
                excess -= size


def artefact_key(*parts: str) -> str:
    """A key that differs as soon as one of some texts does: formulation, version of CasADi, version of the compiler."""
    return hashlib.sha256("\0".join(f"{len(part)}:{part}" for part in parts).encode()).hexdigest()


@functools.cache
def _process_folder() -> Path:
    """A folder that goes with the process."""
    folder = tempfile.TemporaryDirectory(prefix="ccr-gym-")
    _TEMPORARY.append(folder)
    return Path(folder.name)


_TEMPORARY: list[tempfile.TemporaryDirectory[str]] = []  # keeps it until then


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _is_sound(entry: Path) -> bool:
    try:
        return _is_private(entry) and _digest(entry) == entry.name.split(".")[1]
    except OSError:
        return False


def _make_private(folder: Path) -> None:
    """Make a folder and what is missing above it, whatever the umask allows others."""
    for missing in reversed([path for path in (folder, *folder.parents) if not path.exists()]):
        missing.mkdir(PRIVATE, exist_ok=True)


def _is_private(path: Path) -> bool:
    """Whether a file or a folder is the user's, and nobody else may write to it."""
    found = path.lstat()
    return found.st_uid == os.geteuid() and not found.st_mode & OTHERS_WRITE and not stat.S_ISLNK(found.st_mode)


def _is_safe_above(folder: Path) -> bool:
    """Whether nobody but the user and the owner of the machine can put something else in the place of what it holds."""
    found = folder.stat()
    sticky = found.st_mode & stat.S_ISVTX
    return found.st_uid in (os.geteuid(), os.stat("/").st_uid) and bool(sticky or not found.st_mode & OTHERS_WRITE)


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):
        path.unlink()
