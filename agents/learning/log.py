"""The TensorBoard log of a run, and the record of which of its files are the run's own."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from agents.errors import UserError
from agents.files import write_text

LOG = "log_1"
OWN = ".log.json"  # the record, beside the log
EVENTS = "events.out.tfevents."  # prefix of its files


@contextmanager
def recording(run: Path) -> Iterator[Path]:
    """Yield the log folder of a run, and record the event files that are made meanwhile as its own.

    A run that is killed before they are recorded leaves them for good: what is not recorded is never deleted.

    Raises:
        UserError: If the record is damaged or cannot be written.
    """
    before = _event_files(run)
    yield run / LOG
    write_text(run / OWN, json.dumps(sorted({*_recorded(run), *_event_files(run) - before})) + "\n")


def own_files(run: Path) -> list[str]:
    """Return the event files that a run wrote, and their record, as paths in its folder.

    Raises:
        UserError: If the record is damaged.
    """
    return [*(f"{LOG}/{name}" for name in _recorded(run)), OWN]


def _event_files(run: Path) -> set[str]:
    return {path.name for path in (run / LOG).glob(f"{EVENTS}*")}


def _recorded(run: Path) -> list[str]:
    """Return the names of the event files that a run has recorded.

    Raises:
        UserError: If the record is damaged.
    """
    path = run / OWN
    if not path.exists():
        return []
    try:
        names = json.loads(path.read_text())
        if not isinstance(names, list) or not all(_is_event_file(name) for name in names):
            raise ValueError("it holds other things than names of event files")
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path} is damaged ({error!r}); delete it, and {LOG} too if all of it is the run's") from error
    return names


def _is_event_file(name: object) -> bool:
    return isinstance(name, str) and name.startswith(EVENTS) and "/" not in name and "\0" not in name
