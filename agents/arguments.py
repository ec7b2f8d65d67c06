"""Checks of arguments, whose errors name the argument, its value and what it must be."""

import numpy as np

LARGEST = 1e9  # of numbers that have no other bound, in size


def check_whole(name: str, value: object, low: int, high: float) -> int:
    """Return a whole number within bounds.

    Raises:
        ValueError: Naming the value and the bounds.
    """
    if isinstance(value, bool | np.timedelta64) or not isinstance(value, int | np.integer) or not low <= value <= high:
        raise ValueError(f"{name} is {_shown(value)}; it must be a whole number from {low} to {high}")
    return int(value)


def check_real(name: str, value: object, low: float, high: float = LARGEST) -> float:
    """Return a number within bounds as a float.

    Raises:
        ValueError: Naming the value and the bounds.
    """
    real = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool | np.timedelta64)
    if not real or not low <= value <= high:  # type: ignore[operator] # of a number
        raise ValueError(f"{name} is {_shown(value)}; it must be a number from {low} to {high}")
    return float(value)  # type: ignore[arg-type] # a number


def check_kind(name: str, value: object, kind: type | tuple[type, ...], remedy: str) -> None:
    """Refuse an object of another class.

    Raises:
        TypeError: Naming the value and the remedy.
    """
    if not isinstance(value, kind):
        raise TypeError(f"{name} is {_shown(value)}; {remedy}")


def _shown(value: object) -> str:
    try:
        return f"{value!r:.80}"
    except ValueError:  # an integer of thousands of digits
        return f"a {type(value).__name__}"
