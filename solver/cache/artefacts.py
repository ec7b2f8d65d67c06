"""Store of build results on disk, shared by runs and processes."""

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
    """Use of an :class:`ArtefactStore`.

    Attributes:
        hits: Artefacts that were found intact.
        builds: Artefacts that were missing and built.
        rebuilds: Artefacts that were damaged and built again.
        bytes: Size of the store now.
    """

    hits: int
    builds: int
    rebuilds: int
    bytes: int


class ArtefactStore:
    """Folder of files that take long to build, shared by runs and processes.

    An entry is named ``key.digest.suffix`` after the SHA-256 of its content and is created by one rename. So a damaged
    entry is never trusted, and processes that build the same entry do not interfere. Entries are loaded as code: the
    user must own folder and entries, and nobody else may write to them or to a folder above.

    Args:
        folder: Folder of the store; ``None`` stands for ``$CCR_GYM_CACHE`` or else the user's cache folder. Where it
            cannot be written, or others may write to it, a temporary folder replaces it, with a warning.
        capacity: Largest size of the store [bytes]; the least recently used entries are removed first.
    """

    def __init__(self, folder: Path | None = None, capacity: int = 64 * 2**20) -> None:
        chosen = folder or os.environ.get("CCR_GYM_CACHE") or platformdirs.user_cache_path("ccr-gym")
        self._folder, self._capacity = Path(chosen).expanduser(), capacity
        self._hits = self._builds = self._rebuilds = 0

    def path(self, key: str, build: Callable[[Path], None], suffix: str) -> Path:
        """Return the path of an intact artefact, after building it where it is missing or damaged.

        Args:
            key: Key of all that the artefact depends on, see :func:`artefact_key`.
            build: Function that writes the artefact to a path.
            suffix: File suffix with its dot.
        """
        self._leave_if_open_to_others()
        found = list(self._folder.glob(f"{key}.*{suffix}"))
        intact = next(filter(_is_intact, found), None)
        if intact:
            self._hits += 1
            with contextlib.suppress(OSError):
                os.utime(intact)
            return intact
        for damaged in found:
            _remove(damaged)
        self._rebuilds += bool(found)
        self._builds += not found
        entry = self._publish(key, build, suffix)
        self._trim(entry)
        return entry

    @property
    def statistics(self) -> StoreStatistics:
        """Use of the store by this object, and its present size."""
        return StoreStatistics(self._hits, self._builds, self._rebuilds, sum(size for _, size, _ in self._entries()))

    def _publish(self, key: str, build: Callable[[Path], None], suffix: str) -> Path:
        """Build an entry, in a temporary folder where the store's cannot be written or is on a full disk."""
        try:
            _make_private(self._folder)
            return self._build(key, build, suffix)
        except OSError as error:
            self._leave(f"cannot be written ({error.strerror})", "a writable folder")
            return self._build(key, build, suffix)

    def _build(self, key: str, build: Callable[[Path], None], suffix: str) -> Path:
        """Build an entry in a folder of its own and move it into the store."""
        with tempfile.TemporaryDirectory(dir=self._folder, prefix=".building-") as folder:
            fresh = Path(folder, f"fresh{suffix}")
            build(fresh)
            fresh.chmod(PRIVATE)
            entry = self._folder / f"{key}.{_digest(fresh)}{suffix}"
            os.replace(fresh, entry)
        return entry

    def _leave_if_open_to_others(self) -> None:
        """Replace the folder where others may write to it or to a folder above."""
        folder = self._folder.resolve()
        if folder.exists() and not _is_private(folder):
            self._leave(f"is not the user's alone (owner {folder.stat().st_uid})", "a folder that is, with mode 700")
        elif shared := [str(above) for above in folder.parents if above.exists() and not _is_safe_above(above)]:
            self._leave(f"is below {shared[0]}, to which others may write", "another folder")

    def _leave(self, why: str, instead: str) -> None:
        """Replace the folder by a temporary one, with a warning."""
        warnings.warn(
            f"{self._folder} {why}; compiled functions are kept for this process only: set CCR_GYM_CACHE to {instead}",
            stacklevel=5,
        )
        self._folder = _process_folder()

    def _entries(self) -> list[tuple[Path, int, int]]:
        """Return path, size and time of last use of all entries."""
        entries = []
        for path in self._folder.glob("[!.]*"):
            with contextlib.suppress(OSError):
                entries.append((path, path.stat().st_size, path.stat().st_mtime_ns))
        return entries

    def _trim(self, kept: Path) -> None:
        """Remove the least recently used entries beyond the capacity, but keep one."""
        entries = sorted(self._entries(), key=lambda entry: entry[2])
        excess = sum(size for _, size, _ in entries) - self._capacity
        for path, size, _ in entries:
            if excess > 0 and path != kept:
                _remove(path)
                excess -= size


def artefact_key(*parts: str) -> str:
    """Return a key that differs if any of some texts does, such as source, CasADi version or compiler version."""
    return hashlib.sha256("\0".join(f"{len(part)}:{part}" for part in parts).encode()).hexdigest()


@functools.cache
def _process_folder() -> Path:
    """Return a folder that is removed when the process ends."""
    folder = tempfile.TemporaryDirectory(prefix="ccr-gym-")
    _TEMPORARY.append(folder)
    return Path(folder.name)


_TEMPORARY: list[tempfile.TemporaryDirectory[str]] = []  # keeps the folder until then


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _is_intact(entry: Path) -> bool:
    """Return whether an entry is the user's alone and has the content that its name promises."""
    try:
        return _is_private(entry) and _digest(entry) == entry.name.split(".")[1]
    except OSError:
        return False


def _make_private(folder: Path) -> None:
    """Create a folder and its missing parents, closed to others whatever the umask."""
    for missing in reversed([path for path in (folder, *folder.parents) if not path.exists()]):
        missing.mkdir(PRIVATE, exist_ok=True)


def _is_private(path: Path) -> bool:
    """Return whether a file or a folder is the user's, and nobody else may write to it."""
    found = path.lstat()
    return found.st_uid == os.geteuid() and not found.st_mode & OTHERS_WRITE and not stat.S_ISLNK(found.st_mode)


def _is_safe_above(folder: Path) -> bool:
    """Return whether only the user and the administrator can replace what a folder holds."""
    found = folder.stat()
    sticky = found.st_mode & stat.S_ISVTX
    return found.st_uid in (os.geteuid(), os.stat("/").st_uid) and bool(sticky or not found.st_mode & OTHERS_WRITE)


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):
        path.unlink()
