"""Validation of user input: every error names the field, its value, the bound and, where there is one, the remedy.

A value out of bounds is a ValueError, whatever its type; an object of the wrong class is a TypeError. The bounds on
lengths here are those of floating-point numbers, far beyond any robot. Whether a size is sensible beside a robot is
checked where both are known, in proportion to the robot.
"""

import math
from collections.abc import Sequence
from types import EllipsisType
from typing import TypeGuard

import numpy as np

SMALLEST, LARGEST = 1e-30, 1e30  # of lengths [mm]: products of several of them stay normal numbers
REAL = (int, float, np.integer, np.floating)
UNIT_ROUNDING = 2**-50  # of the length of a unit vector, and of the scalar product of two that are perpendicular
DEFINITE = 1e-9  # least ratio of the eigenvalues of a spring matrix
SHOWN = 200  # characters of a value in a message

Real = int | float | np.integer | np.floating
Point = tuple[float, ...]
Pair = tuple[float, float]
Matrix = tuple[Point, ...]
Shape = tuple[int | EllipsisType, ...]
Bounds = float | np.ndarray


def refusal(name: str, value: object, bound: str) -> ValueError:
    """Return the error that names a field, its value and what it must be."""
    return ValueError(f"{name} is {shown(value)}; it must be {bound}")


def check_number(name: str, value: object, low: float, high: float, bound: str) -> float:
    """Return a real number within bounds as a float.

    Args:
        name: Name of the field.
        value: A Python or numpy number, but no bool, string or array.
        low: Least value.
        high: Largest value.
        bound: What it must be, in words.

    Raises:
        ValueError: Naming the value and the bound.
    """
    converted = _as_float(value)
    if not low <= converted <= high:
        raise refusal(name, value, bound)
    return converted + 0.0  # a zero without a sign


def check_positive(name: str, value: object, low: float = SMALLEST, high: float = LARGEST) -> float:
    """Return a positive number as a float.

    Raises:
        ValueError: Naming the value and the bound.
    """
    if type(value) is float and low <= value <= high:
        return value
    return check_number(name, value, low, high, f"positive and finite, from {low:.6g} to {high:.6g}")


def check_finite(name: str, value: object, high: float = LARGEST) -> float:
    """Return a number of either sign as a float.

    Raises:
        ValueError: Naming the value and the bound.
    """
    return check_number(name, value, -high, high, f"finite, at most {high:.6g} in size")


def check_whole(name: str, value: object, low: int, high: int, remedy: str = "") -> int:
    """Return a whole number within bounds as an int.

    Raises:
        ValueError: Naming the value and the bounds.
    """
    if not is_whole(value) or not low <= int(value) <= high:
        number = int(value) if is_whole(value) else value
        raise refusal(name, number, f"a whole number from {low} to {high}{remedy and '; '}{remedy}")
    return int(value)


def check_instance(name: str, value: object, kind: type, remedy: str) -> None:
    """Raise an error for an object of another class.

    Raises:
        TypeError: Naming the value and the class.
    """
    if not isinstance(value, kind):
        raise TypeError(f"{name} is {shown(value)}; it must be {_with_article(kind.__name__)}: {remedy}")


def check_sequence(name: str, value: object, bound: str) -> list[object]:
    """Return the entries of a sequence or an array.

    Raises:
        ValueError: Naming the value and what it must be.
    """
    if not is_listed(value):
        raise refusal(name, value, bound)
    return list(value)


def check_point(name: str, value: object, space: int = 2) -> Point:
    """Return a point of the plane or of space as a tuple of floats.

    Raises:
        ValueError: Naming the value and what it must be.
    """
    if type(value) is tuple and len(value) == space and all(type(v) is float and abs(v) <= LARGEST for v in value):
        return value
    bound = ("a pair (x, y)" if space == 2 else "three coordinates (x, y, z)") + " of numbers"
    entries = check_sequence(name, value, bound)
    if len(entries) != space or not all(map(is_real, entries)):
        raise refusal(name, value, bound)
    numbers = tuple(map(_as_float, entries))
    if not all(abs(v) <= LARGEST for v in numbers):
        raise refusal(name, value, f"finite, at most {LARGEST:.6g} in size")
    return numbers


def check_pair(name: str, value: object) -> Pair:
    """Return two finite numbers.

    Raises:
        ValueError: Naming the value and what it must be.
    """
    x, y = check_point(name, value)
    return x, y


def check_direction(name: str, value: object, meaning: str, space: int = 2) -> Point:
    """Return a direction of the plane or of space as a unit vector; one that is a unit vector but for rounding stays.

    Raises:
        ValueError: If the vector vanishes, naming what it is for.
    """
    numbers = check_point(name, value, space)
    size = math.hypot(*numbers)
    if size < SMALLEST:
        raise ValueError(f"{name} is ({', '.join(f'{v:g}' for v in numbers)}); give the direction {meaning}")
    if abs(size - 1) <= UNIT_ROUNDING:  # or copies would differ in the last bit
        return numbers
    return tuple(v / size for v in numbers)


def check_planar_direction(name: str, value: object, meaning: str) -> Pair:
    """Return a direction of the plane as a unit vector.

    Raises:
        ValueError: If the vector vanishes, naming what it is for.
    """
    x, y = check_direction(name, value, meaning)
    return x, y


def check_spring(name: str, value: object, space: int) -> Matrix:
    """Return the stiffness matrix of a spring, given as one number or as a symmetric matrix.

    Raises:
        ValueError: Naming the value and what it must be.
    """
    if is_real(value):
        stiffness = check_positive(name, value)
        return tuple(tuple(stiffness if row == column else 0.0 for column in range(space)) for row in range(space))
    matrix = _check_matrix(name, value, space)
    size = np.abs(matrix).max()
    if not (SMALLEST <= size <= LARGEST and (matrix == matrix.T).all() and np.linalg.eigvalsh(matrix)[0] > 0):
        raise refusal(name, value, f"finite, symmetric and positive definite, at most {LARGEST:.6g}")
    least, *_, most = np.linalg.eigvalsh(matrix)
    if least < DEFINITE * most:
        raise ValueError(
            f"{name} is {shown(value)}; the stiffness of its softest direction must be at least {DEFINITE} of that of "
            "its stiffest: make it stiffer, or the obstacle fixed"
        )
    return tuple(map(tuple, matrix.tolist()))


def _check_matrix(name: str, value: object, space: int) -> np.ndarray:
    bound = f"a number or a matrix {'((kxx, kxy), (kxy, kyy))' if space == 2 else 'of three rows'}"
    rows = [check_sequence(name, row, bound) for row in check_sequence(name, value, bound)]
    if len(rows) != space or not all(len(row) == space and all(map(is_real, row)) for row in rows):
        raise refusal(name, value, bound)
    return np.array([list(map(_as_float, row)) for row in rows])


def check_array(name: str, value: object, shape: Shape, low: Bounds, high: Bounds, bound: str) -> np.ndarray:
    """Return real numbers within bounds as an array of floats.

    Args:
        name: Name of the field.
        value: An array, or a nested sequence.
        shape: Required shape, as :func:`check_numbers`.
        low: Least values, one in all or one for each column.
        high: Largest values, likewise.
        bound: What the numbers must be, in words.

    Raises:
        ValueError: Naming the value, its shape and the bound.
    """
    numbers = np.asarray(check_numbers(name, value, shape), float, order="C")
    if not ((numbers >= low) & (numbers <= high)).all():
        raise ValueError(f"{name} is {shown(value)}; all must be {bound}")
    return numbers


def check_numbers(name: str, value: object, shape: Shape) -> np.ndarray:
    """Return real numbers of any size as an array, which is the one given where that is an array.

    Args:
        name: Name of the field.
        value: An array, or a nested sequence.
        shape: Required shape; −1 stands for any length of an axis, ``...`` first for any leading axes.

    Raises:
        ValueError: Naming the value and its shape.
    """
    try:
        numbers = np.asarray(value)
    except ValueError as error:  # rows of different lengths
        raise refusal(name, value, _numbers_of(shape)) from error
    if not (numbers.dtype.kind in "iuf" and _fits(numbers.shape, shape)):
        raise refusal(name, value, f"{_numbers_of(shape)}, not {numbers.dtype} of {numbers.shape}")
    return numbers


def check_alike(**shapes: tuple[int, ...]) -> None:
    """Check that leading axes of arrays, given by name, are of the same robots: equal, or 1 or missing.

    Raises:
        ValueError: Naming the arrays and their axes.
    """
    try:
        np.broadcast_shapes(*shapes.values())
    except ValueError as error:
        given = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ValueError(f"the robots of {given} differ; give arrays of as many robots") from error


def check_points(value: object, space: int) -> np.ndarray:
    """Return points of the plane or of space as an array of floats, ``(..., d)``.

    Raises:
        ValueError: Naming the value and what it must be.
    """
    return check_array("points", value, (..., space), -LARGEST, LARGEST, f"finite, at most {LARGEST:.6g} in size")


def is_real(value: object) -> TypeGuard[Real]:
    """Return whether a value is a Python or numpy number, but no bool, complex number or array."""
    return isinstance(value, REAL) and not isinstance(value, bool | np.timedelta64)


def is_whole(value: object) -> TypeGuard[int | np.integer]:
    """Return whether a value is a Python or numpy integer, but no bool."""
    return is_real(value) and isinstance(value, int | np.integer)


def is_listed(value: object) -> TypeGuard[Sequence[object] | np.ndarray]:
    """Return whether a value is a sequence, such as a tuple, a list or an array with a first axis, but no text."""
    if isinstance(value, np.ndarray):
        return value.ndim > 0
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def shown(value: object) -> str:
    """Return a value as a message shows it, on one line and cut to a readable length."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # an integer of thousands of digits, or an object whose repr fails
        return f"a {type(value).__name__}"
    return text if len(text) <= SHOWN else text[:SHOWN] + "…"


def _with_article(noun: str) -> str:
    return f"{'an' if noun[0] in 'AEIOU' else 'a'} {noun}"


def _numbers_of(shape: Shape) -> str:
    return f"numbers of shape {shape}".replace("Ellipsis", "...") if shape != (...,) else "numbers of any shape"


def _fits(shape: tuple[int, ...], wanted: Shape) -> bool:
    """Return whether an array has a wanted shape, as described in :func:`check_numbers`."""
    if shape == wanted:
        return True
    if wanted[:1] == (...,):
        shape, wanted = shape[max(len(shape) - len(wanted) + 1, 0) :], wanted[1:]
    return len(shape) == len(wanted) and all(w in (-1, n) for n, w in zip(shape, wanted, strict=True))


def _as_float(value: object) -> float:
    """Return a value as a float, NaN for what is no real number or too large for one."""
    try:
        return float(value) if is_real(value) else math.nan
    except OverflowError:
        return math.nan
