"""Comparison of what environments return."""

from collections.abc import Mapping

import numpy as np


def same(first, second):
    """Equal structure and bits."""
    if isinstance(first, Mapping):
        assert first.keys() == second.keys()
        for key in first:
            same(first[key], second[key])
    elif isinstance(first, tuple):
        for one, other in zip(first, second, strict=True):
            same(one, other)
    else:
        assert np.array_equal(first, second)
