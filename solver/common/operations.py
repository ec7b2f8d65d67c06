"""Operations that formulas are written in: for numbers, for arrays, and for expressions; and dot products of arrays."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

Value = float | np.ndarray
Number = Any  # a value, or an expression


class Operations(NamedTuple):
    """Operations that are written differently for floats, where they are several times faster, and for arrays.

    Attributes:
        minimum: Smaller of two values.
        maximum: Larger of two values.
        where: First value where a condition holds, else the second.
        exp: Exponential.
        sqrt: Square root.
    """

    minimum: Callable[[Number, Number], Number]
    maximum: Callable[[Number, Number], Number]
    where: Callable[[Number, Number, Number], Number]
    exp: Callable[[Number], Number]
    sqrt: Callable[[Number], Number]


ARRAYS = Operations(np.minimum, np.maximum, np.where, np.exp, np.sqrt)
NUMBERS = Operations(min, max, lambda condition, yes, no: yes if condition else no, math.exp, math.sqrt)
SYMBOLS = Operations(ca.fmin, ca.fmax, ca.if_else, ca.exp, ca.sqrt)  # of CasADi


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return dot products along the last axis, added term by term: the bits do not depend on their number."""
    total = a[..., 0] * b[..., 0]
    for k in range(1, a.shape[-1]):
        total = total + a[..., k] * b[..., k]
    return np.asarray(total)
