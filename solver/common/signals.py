"""Signals that arrive while CasADi works, whose bindings swallow most of what handlers raise.

Ctrl-C amid a call would be lost, or end as another error, since handlers run wherever the bindings enter Python.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

HELD = (signal.SIGINT, signal.SIGTERM, signal.SIGALRM, signal.SIGHUP, signal.SIGUSR1, signal.SIGUSR2)


@contextmanager
def held_signals() -> Iterator[None]:
    """Keep signals until the end of a block, also of a decorated function, and hand them to their handlers then.

    Those are the signals of :data:`HELD` with a handler in Python. Handlers run in the main thread only, so that in
    another nothing is held.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    recorder = _Recorder()
    try:
        for number in recorder.handlers:
            signal.signal(number, recorder)
        yield
    finally:
        recorder.end()


class _Recorder:
    """A handler that keeps signals until its end, and hands on what arrives after.

    What a handler raises may cut short the change back to the handlers before: it is repeated, and a recorder that is
    left in place nonetheless hands on.
    """

    def __init__(self) -> None:
        self.handlers = {int(number): handler for number in HELD if callable(handler := signal.getsignal(number))}
        self.arrived: dict[int, FrameType | None] = {}
        self.keeps = True

    def __call__(self, number: int, frame: FrameType | None) -> None:
        if self.keeps:
            self.arrived[number] = frame
        else:
            self.handlers[number](number, frame)

    def end(self) -> None:
        self.keeps = False
        try:
            self._put_back()
        finally:
            try:
                self._put_back()
            finally:
                for number, frame in self.arrived.items():
                    self.handlers[number](number, frame)

    def _put_back(self) -> None:
        for number, handler in self.handlers.items():
            signal.signal(number, handler)
