"""Worker processes."""

import multiprocessing
import os
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.connection import wait
from threading import Thread

from agents.errors import UserError


@contextmanager
def worker_pool(count: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool of single-threaded processes, which are killed if the block fails or is interrupted.

    One thread each is fastest for small matrices, and by far where every core has a process of its own. The workers
    ignore interrupts; this process handles them. If it is killed, they end as well.

    Raises:
        UserError: If they cannot be started, or one of them dies.
    """
    for library in ("OPENBLAS", "MKL", "OMP"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")  # read when the libraries are loaded, in new processes
    context = multiprocessing.get_context("spawn")  # torch does not survive a fork
    others = multiprocessing.active_children()
    try:  # what they share are files in memory
        pool = ProcessPoolExecutor(count, mp_context=context, initializer=_end_with_parent)
    except OSError as error:
        raise UserError(
            f"worker processes cannot be started: {error.strerror or error}; they need room in shared memory "
            "(/dev/shm), and limits (ulimit) that allow files and semaphores"
        ) from error
    try:
        _start(pool, count)
        yield pool
    except BaseException as error:
        for process in set(multiprocessing.active_children()) - set(others):
            process.kill()
        if isinstance(error, BrokenProcessPool):
            raise UserError("a worker process was killed, perhaps for lack of memory; try fewer --jobs") from error
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _start(pool: ProcessPoolExecutor, count: int) -> None:
    """Start all processes now, while SIGINT is blocked: they inherit the mask of the thread that starts them."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    for _ in range(count):
        pool.submit(int)
    signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with_parent() -> None:
    """End this process as soon as its parent has died, which nobody else would tell it."""
    parent = multiprocessing.parent_process()
    assert parent is not None, "workers have a parent"
    Thread(target=lambda: (wait([parent.sentinel]), os._exit(1)), daemon=True).start()
