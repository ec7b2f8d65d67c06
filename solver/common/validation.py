"""Validation of what users pass: every refusal names the field, its value, the bound, and a remedy where there is one.

A value out of bounds is a ValueError, of whatever type it is; an object of the wrong class is a TypeError. Bounds of
lengths here are those of what floating-point numbers represent well, far beyond any robot; whether a size makes sense
beside a robot is checked where both are known, in proportion to the robot.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

SMALLEST, LARGEST = 1e-30, 1e30  # of lengths [mm]: products of several of them stay normal numbers
REAL = (int, float, np.integer, np.floating)
DEFINITE = 1e-9  # least ratio of the eigenvalues of a spring
SHOWN = 200  # characters of a value in a message

Point = tuple[float, ...]
Pair = tuple[float, float]
Matrix = tuple[Point, ...]
Shape = tuple[Any, ...]


def number(name: str, value: Any, low: float, high: float, bound: str) -> float:
    """Return a real number within bounds as a float.

    Args:
        name: What it is.
        value: A Python or numpy number; a bool, a string or an array is none.
        low: Least value.
        high: Largest value.
        bound: What it must be, in words.

    Raises:
        ValueError: Naming the value and the bound.
    """
    converted = _as_float(value)
    if not low <= converted <= high:
        raise ValueError(f"{name} is {shown(value)}; it must be {bound}")
    return converted + 0.0  # a zero without a sign


def positive(name: str, value: Any, low: float = SMALLEST, high: float = LARGEST) -> float:
    """Return a positive number as a float.

    Raises:
        ValueError: Naming the value and the bound.
    """
    if type(value) is float and low <= value <= high:
        return value
    return number(name, value, low, high, f"positive and finite, from {low:.6g} to {high:.6g}")


def finite(name: str, value: Any, high: float = LARGEST) -> float:
    """Return a number of either sign as a float.

    Raises:
        ValueError: Naming the value and the bound.
    """
    return number(name, value, -high, high, f"finite, at most {high:.6g} in size")


def whole(name: str, value: Any, low: int, high: int, remedy: str = "") -> int:
    """Return a whole number within bounds as an int.

    Raises:
        ValueError: Naming the value and the bounds.
    """
    if not is_whole(value):
        raise ValueError(f"{name} is {shown(value)}; it must be a whole number from {low} to {high}{remedy}")
    if not low <= int(value) <= high:
        raise ValueError(f"{name} is {int(value)}; it must be a whole number from {low} to {high}{remedy}")
    return int(value)


def instance(name: str, value: Any, kind: type | tuple[type, ...], remedy: str) -> None:
    """Refuse an object of another class.

    Raises:
        TypeError: Naming the value and the class.
    """
    if not isinstance(value, kind):
        names = " or ".join(k.__name__ for k in (kind if isinstance(kind, tuple) else (kind,)))
        raise TypeError(f"{name} is {shown(value)}; it must be a {names}: {remedy}")


def sequence(name: str, value: Any, wanted: str) -> list[Any]:
    """Return the entries of a sequence or an array.

    Raises:
        ValueError: Naming the value and what is wanted.
    """
    if not is_listed(value):
        raise ValueError(f"{name} is {shown(value)}; it must be {wanted}")
    return list(value)


def point(name: str, value: Any, space: int = 2) -> Point:
    """Return as many finite numbers as the space has dimensions.

    Raises:
        ValueError: Naming what they are.
    """
    if type(value) is tuple and len(value) == space and all(type(v) is float and abs(v) <= LARGEST for v in value):
        return value
    wanted = ("a pair (x, y)" if space == 2 else "three coordinates (x, y, z)") + " of numbers"
    entries = sequence(name, value, wanted)
    if len(entries) != space or not all(map(is_real, entries)):
        raise ValueError(f"{name} is {shown(value)}; it must be {wanted}")
    numbers = tuple(map(_as_float, entries))
    if not all(abs(v) <= LARGEST for v in numbers):
        raise ValueError(f"{name} is {shown(value)}; it must be finite, at most {LARGEST:.6g} in size")
    return numbers


def pair(name: str, value: Any) -> Pair:
    """Return two finite numbers.

    Raises:
        ValueError: Naming what they are.
    """
    x, y = point(name, value)
    return x, y


def direction(name: str, value: Any, meaning: str, space: int = 2) -> Point:
    """Return a direction of the plane or of space, normalised.

    Raises:
        ValueError: If it has none, naming what it is for.
    """
    numbers = point(name, value, space)
    size = math.hypot(*numbers)
    if size < SMALLEST:
        raise ValueError(f"{name} is ({', '.join(f'{v:g}' for v in numbers)}); give the direction {meaning}")
    return tuple(v / size for v in numbers)


def unit(name: str, value: Any, meaning: str) -> Pair:
    """Return a direction of the plane, normalised.

    Raises:
        ValueError: If it has none, naming what it is for.
    """
    x, y = direction(name, value, meaning)
    return x, y


def spring(name: str, value: Any, space: int) -> Matrix:
    """Return the matrix of a spring, given as one number or as a symmetric matrix.

    Raises:
        ValueError: Naming the value and what it must be.
    """
    matrix = np.diag([positive(name, value)] * space) if is_real(value) else _matrix(name, value, space)
    size, bound = np.abs(matrix).max(), f"finite, symmetric and positive definite, at most {LARGEST:.6g}"
    if not (SMALLEST <= size <= LARGEST and (matrix == matrix.T).all() and np.linalg.eigvalsh(matrix)[0] > 0):
        raise ValueError(f"{name} is {shown(value)}; it must be {bound}")
    least, *_, most = np.linalg.eigvalsh(matrix)
    if least < DEFINITE * most:
        raise ValueError(
            f"{name} is {shown(value)}; its softest direction must have at least {DEFINITE} of the stiffness of its "
            "stiffest: make it stiffer, or the obstacle fixed"
        )
    return tuple(map(tuple, matrix.tolist()))


def _matrix(name: str, value: Any, space: int) -> np.ndarray:
    form = "((kxx, kxy), (kxy, kyy))" if space == 2 else "of three rows"
    wanted = f"a number or a matrix {form}"
    rows = [sequence(name, row, wanted) for row in sequence(name, value, wanted)]
    if len(rows) != space or not all(len(row) == space and all(map(is_real, row)) for row in rows):
        raise ValueError(f"{name} is {shown(value)}; it must be {wanted}")
    return np.array([list(map(_as_float, row)) for row in rows])


def array(name: str, value: Any, shape: Shape, low: Any, high: Any, bound: str) -> np.ndarray:
    """Return real numbers within bounds as an array of floats.

    Args:
        name: What they are.
        value: An array, or a nested sequence.
        shape: The shape it must have, not (); −1 for any length of an axis, ``...`` first for any axes before.
        low: Least values, one or one of each column.
        high: Largest values, likewise.
        bound: What the numbers must be, in words.

    Raises:
        ValueError: Naming the value, its shape and the bound.
    """
    try:
        numbers = np.asarray(value)
    except ValueError as error:  # rows of different lengths
        raise ValueError(f"{name} is {shown(value)}; it must be numbers of shape {shape}") from error
    if not (numbers.dtype.kind in "iuf" and _fits(numbers.shape, shape)):
        raise ValueError(
            f"{name} is {shown(value)}; it must be numbers of shape {shape}, not {numbers.dtype} of {numbers.shape}"
        )
    numbers = np.ascontiguousarray(numbers, float)
    if not ((numbers >= low) & (numbers <= high)).all():
        raise ValueError(f"{name} is {shown(value)}; all must be {bound}")
    return numbers


def check_points(value: Any, space: int) -> np.ndarray:
    """Return points of the plane or of space as an array of floats, ``(..., d)``.

    Raises:
        ValueError: Naming what they are.
    """
    return array("points", value, (..., space), -LARGEST, LARGEST, f"finite, at most {LARGEST:.6g} in size")


def is_real(value: Any) -> bool:
    """Whether a value is a Python or numpy number, neither a bool, nor complex, nor an array."""
    return isinstance(value, REAL) and not isinstance(value, bool | np.timedelta64)


def is_whole(value: Any) -> bool:
    """Whether a value is a Python or numpy integer, and no bool."""
    return is_real(value) and isinstance(value, int | np.integer)


def is_listed(value: Any) -> bool:
    """Whether a value is a sequence, such as a tuple, a list or an array with a first axis, but no text."""
    if isinstance(value, np.ndarray):
        return value.ndim > 0
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def shown(value: Any) -> str:
    """A value as a message shows it, on one line and cut to a readable length."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # an integer of thousands of digits, or an object that cannot be shown
        return f"a {type(value).__name__}"
    return text if len(text) <= SHOWN else text[:SHOWN] + "…"


def _fits(shape: tuple[int, ...], wanted: Shape) -> bool:
    if wanted[0] is ...:
        shape, wanted = shape[1 - len(wanted) :], wanted[1:]
    return len(shape) == len(wanted) and all(w in (-1, n) for n, w in zip(shape, wanted, strict=True))


def _as_float(value: Any) -> float:
    """The value as a float, NaN for what is no real number or too large for one."""
    try:
        return float(value) if is_real(value) else math.nan
    except OverflowError:
        return math.nan
