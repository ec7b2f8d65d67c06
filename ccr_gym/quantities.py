"""Quantities that are a number for one environment and an array for many."""

from typing import Any

import numpy as np

EnvIndex = int | slice | list[int]  # one environment, a range of them, or some
Quantity = Any  # a number for one environment, (N,) for many; a union of both would need a cast at every use


def norm(vectors: np.ndarray) -> np.ndarray:
    """Return the lengths of vectors ``(..., d)``, computed so that the bits do not depend on their number."""
    if vectors.shape[-1] == 2:
        return np.asarray(np.hypot(vectors[..., 0], vectors[..., 1]))
    return np.asarray(np.sqrt(vectors[..., 0] ** 2 + vectors[..., 1] ** 2 + vectors[..., 2] ** 2))
