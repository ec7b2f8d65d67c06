"""Operations whose bits do not depend on how many are done at once: scalar and array versions, and dot products."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

Value = float | np.ndarray


class Operations(NamedTuple):
    """Operations that are written differently for floats, where they are several times faster, and for arrays.

    Attributes:
        minimum: Smaller of two values.
        maximum: Larger of two values.
        where: First value where a condition holds, else the second.
    """

    minimum: Callable[[Value, Value], Value]
    maximum: Callable[[Value, Value], Value]
    where: Callable[[bool | np.ndarray, Value, Value], Value]


ARRAYS = Operations(np.minimum, np.maximum, np.where)
NUMBERS = Operations(min, max, lambda condition, yes, no: yes if condition else no)


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return dot products along the last axis, added term by term: the bits do not depend on their number."""
    total = a[..., 0] * b[..., 0]
    for k in range(1, a.shape[-1]):
        total = total + a[..., k] * b[..., k]
    return np.asarray(total)
