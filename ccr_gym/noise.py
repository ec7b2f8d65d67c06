"""Noise of sensors: white from step to step, or constant in an episode and correlated along the robot.

White noise is read from one table of standard normal numbers, from a place that every episode draws by the generator of
its environment: so the state of the noise of an episode is a single number, and any step of any episode has the same
noise however many are stepped together.
"""

import math
from functools import cache
from itertools import accumulate

import numpy as np

TABLE_SIZE = 2**20  # a power of two, whose remainders are fast
CORRELATION = 0.8  # of neighbouring disks, as of errors that add up along a fibre


def draw_start(generator: np.random.Generator) -> int:
    """Return where the white noise of an episode begins in the table."""
    return int(generator.integers(TABLE_SIZE))


def white(places: np.ndarray, size: int) -> np.ndarray:
    """Return white noise of unit variance from places in the table on, ``(..., size)`` for places ``(...)``."""
    return np.asarray(_table()[(places[..., None] + np.arange(size)) % TABLE_SIZE])


def correlated(generator: np.random.Generator, count: int, size: int) -> np.ndarray:
    """Return stationary noise of unit variance along a robot, correlated from disk to disk, ``(count, size)``.

    An autoregressive process of first order: ``e_k = ρ e_{k−1} + √(1 − ρ²) w_k``.
    """
    white, fresh = generator.standard_normal((count, size)), math.sqrt(1 - CORRELATION**2)
    columns = (accumulate(column, lambda e, w: CORRELATION * e + fresh * w) for column in white.T.tolist())
    return np.array(list(zip(*columns, strict=True)))  # numbers of Python, which are faster here than rows of numpy


@cache
def _table() -> np.ndarray:
    table = np.random.default_rng(0).standard_normal(TABLE_SIZE)
    table.setflags(write=False)
    return table
