"""Signals that arrive while CasADi works, whose bindings swallow most of what handlers raise.

Ctrl-C amid a call would be lost, or end as another error, since handlers run wherever the bindings enter Python.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from types import FrameType

HELD = (signal.SIGINT, signal.SIGTERM, signal.SIGALRM, signal.SIGHUP, signal.SIGUSR1, signal.SIGUSR2)


@contextmanager
def held_signals() -> Iterator[None]:
    """Keep signals until the end of a block, also of a decorated function, and hand them to their handlers then.

    Those are the signals of :data:`HELD` with a handler in Python. Handlers run in the main thread only, so that in
    another nothing is held.
    """
    with ExitStack() as stack:
        if threading.current_thread() is threading.main_thread():
            _record(stack)
        yield


def _record(stack: ExitStack) -> None:
    """Record signals until a stack ends, which hands them to their handlers once all of these are back in place."""
    arrived: list[tuple[int, FrameType | None]] = []
    handlers = {int(number): handler for number in HELD if callable(handler := signal.getsignal(number))}

    def deliver() -> None:
        for number, frame in dict(arrived).items():
            handlers[number](number, frame)

    stack.callback(deliver)
    for number, handler in handlers.items():
        stack.callback(signal.signal, number, handler)
        signal.signal(number, lambda *signalled: arrived.append(signalled))
