"""Processes that work side by side."""

import multiprocessing
import os
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager

from agents.errors import UserError


@contextmanager
def workers(count: int) -> Iterator[ProcessPoolExecutor]:
    """Processes of one thread each: small matrices are solved faster so, and far faster where all cores are taken.

    An interrupt is left to this process, which then ends them, whatever they are at.

    Raises:
        UserError: If one of them dies.
    """
    for library in ("OPENBLAS", "MKL", "OMP"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")  # read when the libraries are loaded, in new processes
    context = multiprocessing.get_context("spawn")  # torch does not bear being forked
    others = multiprocessing.active_children()
    pool = ProcessPoolExecutor(count, mp_context=context)
    try:
        _start(pool, count)
        yield pool
    except BaseException as error:
        for process in set(multiprocessing.active_children()) - set(others):
            process.kill()
        if isinstance(error, BrokenProcessPool):
            raise UserError("a worker process was killed, as where memory runs out; try fewer --jobs") from error
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _start(pool: ProcessPoolExecutor, count: int) -> None:
    """Start all processes now, as a process keeps the blocked signals of the thread that starts it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    for _ in range(count):
        pool.submit(int)
    signal.pthread_sigmask(signal.SIG_SETMASK, before)
