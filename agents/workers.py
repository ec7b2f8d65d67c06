"""Processes that work side by side."""

import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor


def workers(count: int) -> ProcessPoolExecutor:
    """Processes of one thread each: small matrices are solved faster so, and far faster where all cores are taken."""
    for library in ("OPENBLAS", "MKL", "OMP"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")  # read when the libraries are loaded, in new processes
    context = multiprocessing.get_context("spawn")  # torch does not bear being forked
    return ProcessPoolExecutor(count, mp_context=context)
