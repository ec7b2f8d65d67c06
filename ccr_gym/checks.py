"""Refusals at the boundary: every message names the field, its value and what it must be.

A value that a field cannot have is a ValueError, whatever its type; an object of another class, or a name that there is
not, is a TypeError.

A dataclass declares the check of a field beside its default, and runs all of them when it is made::

    @dataclass(frozen=True, slots=True)
    class MyTask(Task):
        radius_mm: tuple[float, float] = checked((10.0, 16.0), check_range, low=SMALLEST)
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Any

import numpy as np

from solver.common.validation import LARGEST, is_listed, is_real, is_whole, shown


def require(condition: bool, message: str) -> None:
    """Refuse what does not meet a condition.

    Raises:
        ValueError: With the message.
    """
    if not condition:
        raise ValueError(message)


def checked(default: Any, check: Callable[..., Any], /, **bounds: Any) -> Any:
    """Declare a dataclass field together with its check, which :func:`check_fields` runs.

    Args:
        default: The default value, or a function that makes it.
        check: One of the checks below, or any ``check(name, value, **bounds)`` that returns the value to keep.
        **bounds: Passed to the check.
    """
    metadata = {"check": partial(check, **bounds)}
    if callable(default):
        return field(default_factory=default, metadata=metadata)
    return field(default=default, metadata=metadata)


def nested(kind: type[Any], default: Callable[[], Any] | None = None) -> Any:
    """Declare a dataclass field that is a dataclass itself, or a mapping of its fields, or ``None`` for the default."""
    default = default or kind
    return checked(default, check_instance, kind=kind, default=default)


def check_fields(instance: Any) -> None:
    """Check the fields of a dataclass that were declared with :func:`checked`, and keep what the checks return.

    Raises:
        TypeError: If a value should be an object of another class.
        ValueError: If a value is out of its bounds.
    """
    for declared in fields(instance):
        if check := declared.metadata.get("check"):
            object.__setattr__(instance, declared.name, check(declared.name, getattr(instance, declared.name)))


@dataclass(frozen=True, slots=True)
class Bounds:
    """Where a number may lie; never at infinity.

    Attributes:
        low: Smallest value.
        high: Largest value.
        below: Value that it must stay under, instead of ``high``.
        reason: Where the bounds come from, for the message.
    """

    low: float = -LARGEST
    high: float = LARGEST
    below: float | None = None
    reason: str = ""

    def __contains__(self, value: Any) -> bool:
        return self.low <= value <= self.high and (self.below is None or value < self.below)

    def __str__(self) -> str:
        most = f"{self.high:.10g}" if self.below is None else f"below {self.below:.10g}"
        return f"from {self.low:.10g} to {most}" + (f" ({self.reason})" if self.reason else "")


def check_number(name: str, value: Any, **bounds: Any) -> float:
    """Return a number as a float.

    Args:
        name: What it is called.
        value: Any kind of real number, but no bool.
        **bounds: As :class:`Bounds`.

    Raises:
        ValueError: If it is no number, out of bounds, or not finite.
    """
    limits = Bounds(**bounds)
    if not (is_real(value) and value in limits):
        raise refusal(name, value, f"a number {limits}")
    return float(value)


def check_whole(name: str, value: Any, **bounds: Any) -> int:
    """Return a whole number as an int; bounds and errors as :func:`check_number`."""
    limits = Bounds(**bounds)
    if not (is_whole(value) and value in limits):
        raise refusal(name, value, f"a whole number {limits}")
    return int(value)


def check_range(name: str, value: Any, *, whole: bool = False, **bounds: Any) -> tuple[Any, Any]:
    """Return the ends of a range as a tuple of two numbers that do not descend; both may be equal.

    Args:
        name: What it is called.
        value: Two numbers in a tuple, list or array.
        whole: Whether both must be whole.
        **bounds: As :class:`Bounds`.

    Raises:
        ValueError: If it is anything else, an end is out of bounds or not finite, or the first exceeds the second.
    """
    limits, numbers = Bounds(**bounds), "whole numbers" if whole else "numbers"
    known = is_whole if whole else is_real
    paired = is_listed(value) and len(value) == 2 and all(map(known, value))
    if not (paired and all(end in limits for end in value) and value[0] <= value[1]):
        raise refusal(name, value, f"two {numbers} {limits}, the smaller one first")
    low, high = map(int if whole else float, value)
    return low, high


def check_ranges(name: str, value: Any, *, bounds: Sequence[Mapping[str, Any]]) -> tuple[tuple[Any, Any], ...]:
    """Return several ranges as a tuple, each checked against bounds of its own."""
    if not (is_listed(value) and len(value) == len(bounds)):
        raise refusal(name, value, f"{len(bounds)} ranges of two numbers each")
    return tuple(check_range(f"{name}[{k}]", ends, **bounds[k]) for k, ends in enumerate(value))


def check_flag(name: str, value: Any) -> bool:
    """Return a truth value as a bool.

    Raises:
        ValueError: If it is anything else.
    """
    if not isinstance(value, bool | np.bool_):
        raise refusal(name, value, "True or False")
    return bool(value)


def check_choice(name: str, value: Any, *, choices: Sequence[str]) -> str:
    """Return a word that is one of some.

    Raises:
        ValueError: If it is none of them.
    """
    if not (isinstance(value, str) and value in choices):
        raise refusal(name, value, " or ".join(map(repr, choices)))
    return str(value)


def check_type(name: str, value: Any, kind: Any, what: str = "") -> None:
    """Refuse what is of another type.

    Args:
        name: What it is called.
        value: Anything.
        kind: The type, or a union of types.
        what: What the message says that it must be, if not the type's name.

    Raises:
        TypeError: If it is anything else.
    """
    if not isinstance(value, kind):
        raise refusal(name, value, what or f"a {kind.__name__}", TypeError)


def check_instance(name: str, value: Any, *, kind: type[Any], default: Callable[[], Any] | None = None) -> Any:
    """Return a dataclass from one, from a mapping of its fields, or the default from ``None`` or an empty mapping.

    Raises:
        TypeError: If it is anything else, or the mapping names a field that does not exist.
        ValueError: As the dataclass.
    """
    if default is not None and (value is None or (isinstance(value, Mapping) and not value)):
        return default()
    if isinstance(value, Mapping):
        check_names(name, value, [declared.name for declared in fields(kind) if declared.init])
        return kind(**value)
    check_type(name, value, kind, f"a {kind.__name__} or a mapping of its fields")
    return value


def check_names(name: str, given: Mapping[Any, Any], valid: Sequence[str]) -> None:
    """Refuse a name that is none of the valid ones.

    Raises:
        TypeError: Naming it and the valid ones.
    """
    unknown = [shown(key) for key in given if not (isinstance(key, str) and key in valid)]
    if unknown:
        raise TypeError(f"{name} does not take {', '.join(unknown)}; it takes {', '.join(valid)}")


def check_array(name: str, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return finite numbers as an array of floats.

    Raises:
        ValueError: If they are not real numbers (booleans, complex numbers, strings and objects are not), the shape is
            another, or one of them is not finite.
    """
    array = as_array(value)
    numeric = array.dtype.kind in "fiu" and array.dtype.itemsize <= 8
    if not (numeric and array.shape == shape and _all_finite(array)):
        raise refusal(name, value, f"finite numbers of shape {shape}")
    return array.astype(float)


def check_seed(name: str, value: Any) -> int | None:
    """Return a seed as an int; ``None`` stays ``None``.

    Raises:
        ValueError: If it is no whole number, or negative.
    """
    if value is None:
        return None
    if not (is_whole(value) and value >= 0):
        raise refusal(name, value, "None or a whole number from 0 on")
    return int(value)


def refusal(name: str, value: Any, bound: str, kind: type[Exception] = ValueError) -> Exception:
    """Return the exception that says what a value is, and what it must be."""
    return kind(f"{name} is {shown(value)}; it must be {bound}")


def as_array(value: Any) -> np.ndarray:
    """Return an array of what has numbers, and one of objects from anything else."""
    try:
        return np.asarray(value)
    except Exception:  # whatever an object raises when it is asked for its numbers
        return np.empty(0, object)


def _all_finite(array: np.ndarray) -> bool:
    if array.size < 16:  # faster than the loop of numpy, whose start costs more
        return all(map(math.isfinite, array.ravel().tolist()))
    return bool(np.isfinite(array).all())
