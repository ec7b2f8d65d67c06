"""Quantities that are a Python number for one environment and an array for many."""

from typing import Any

import numpy as np

from solver.common.operations import ARRAYS, NUMBERS, Operations

EnvIndex = int | slice | list[int]  # one environment, a range of them, or some
Quantity = Any  # a float for one environment, (N,) for many; a union of both would need a cast at every use


def operations(index: EnvIndex) -> Operations:
    """Return the operations for such quantities: those of Python numbers for one environment, of arrays for many."""
    return NUMBERS if isinstance(index, int) else ARRAYS


def as_scalar(value: np.ndarray | np.generic, index: EnvIndex) -> Quantity:
    """Return a Python number for one environment, a copy of the array for many."""
    return value.item() if isinstance(index, int) else value.copy()


def norm(vectors: np.ndarray) -> np.ndarray:
    """Return the lengths of vectors ``(..., d)``, computed so that the bits do not depend on their number."""
    if vectors.shape[-1] == 2:
        return np.asarray(np.hypot(vectors[..., 0], vectors[..., 1]))
    return np.asarray(np.sqrt(vectors[..., 0] ** 2 + vectors[..., 1] ** 2 + vectors[..., 2] ** 2))
