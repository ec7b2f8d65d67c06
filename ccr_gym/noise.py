"""Noise of sensors: white from step to step, or constant in an episode and correlated along the robot.

White noise is read from one table of standard normal numbers, from a place that every episode draws by the generator of
its environment: so the state of the noise of an episode is a single number, and any step of any episode has the same
noise however many are stepped together.
"""

import math
from collections.abc import Sequence
from functools import cache

import numpy as np

from solver.common.transition import correlate

TABLE_SIZE = 2**20  # a power of two, whose remainders are fast
CORRELATION = 0.8  # of neighbouring disks, as of errors that add up along a fibre


def draw_start(generator: np.random.Generator) -> int:
    """Return where the white noise of an episode begins in the table."""
    return int(generator.integers(TABLE_SIZE))


def correlated(generators: Sequence[np.random.Generator], count: int, size: int) -> np.ndarray:
    """Return stationary noise of unit variance along robots, correlated from disk to disk, ``(k, count, size)``.

    An autoregressive process of first order: ``e_k = ρ e_{k−1} + √(1 − ρ²) w_k``.
    """
    noise = np.array([generator.standard_normal((count, size)) for generator in generators])
    correlate(noise, CORRELATION, math.sqrt(1 - CORRELATION**2))
    return noise


@cache
def noise_table() -> np.ndarray:
    """Return the table that the kernel reads white noise of unit variance from."""
    table = np.random.default_rng(0).standard_normal(TABLE_SIZE)
    table.setflags(write=False)
    return table
