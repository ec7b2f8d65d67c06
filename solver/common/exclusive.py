"""Guard against use of one object by several threads at once."""

from threading import Lock


class ExclusiveUse:
    """Context manager that lets one thread at a time use a batch and refuses others, before they change anything."""

    def __init__(self) -> None:
        self._lock = Lock()

    def __enter__(self) -> None:
        if not self._lock.acquire(blocking=False):
            raise RuntimeError("the batch is in use by another thread; give each thread a batch of its own")

    def __exit__(self, *error: object) -> None:
        self._lock.release()
