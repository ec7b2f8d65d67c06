"""Validation of what users pass to environments; every message names the field, its value and the bound.

An invalid value raises ValueError, whatever its type. An object of the wrong class, or an unknown name, raises
TypeError.

Dataclasses declare the check of a field beside its default and run all checks when they are made::

    @dataclass(frozen=True, slots=True)
    class MyTask(Task[Robot]):
        radius_mm: tuple[float, float] = checked((10.0, 16.0), check_range, low=SMALLEST)
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from types import UnionType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from solver.common import validation
from solver.common.validation import LARGEST, is_real, is_whole, shown

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

T = TypeVar("T")
DataclassT = TypeVar("DataclassT", bound="DataclassInstance")


def require(condition: bool, message: str) -> None:
    """Raise an error with this message unless the condition holds.

    Raises:
        ValueError: If it does not hold.
    """
    if not condition:
        raise ValueError(message)


def refusal(name: str, value: object, bound: str, kind: type[Exception] = ValueError) -> Exception:
    """Return the exception that states a value and what it must be."""
    return kind(f"{name} is {shown(value)}; it must be {bound}")


def checked(default: T, check: Callable[..., object], /, **bounds: object) -> T:
    """Declare a dataclass field with its check, which :func:`check_fields` runs.

    Args:
        default: The default value.
        check: One of the checks below, or any ``check(name, value, **bounds)`` that returns the value to keep.
        **bounds: Keyword arguments of the check.
    """
    return field(default=default, metadata={"check": partial(check, **bounds)})


def derived(check: Callable[..., object], /, **bounds: object) -> Any:
    """Declare a dataclass field that follows from others unless it is given; its owner fills in what is ``None``.

    Args:
        check: As of :func:`checked`, for a value that is given.
        **bounds: Keyword arguments of the check.
    """

    def check_given(name: str, value: object) -> object:
        return None if value is None else check(name, value, **bounds)

    return field(default=None, metadata={"check": check_given})


def nested(kind: type[DataclassT], default: Callable[[], DataclassT] | None = None, **usual: object) -> DataclassT:
    """Declare a dataclass field that holds a dataclass; a mapping of its fields, or None for the default, is accepted.

    Args:
        kind: The dataclass.
        default: Makes the default; ``None`` to call ``kind()``.
        **usual: Fields that a mapping need not name.
    """
    make = default or kind
    check = partial(check_instance, kind=kind, default=make, usual=usual)
    return field(default_factory=make, metadata={"check": check})


def check_fields(instance: "DataclassInstance") -> None:
    """Check the fields of a dataclass that were declared with :func:`checked`, and keep what the checks return.

    Raises:
        TypeError: If a value is an object of the wrong class.
        ValueError: If a value is out of bounds.
    """
    for declared in fields(instance):
        if check := declared.metadata.get("check"):
            object.__setattr__(instance, declared.name, check(declared.name, getattr(instance, declared.name)))


@dataclass(frozen=True, slots=True)
class Bounds:
    """Bounds of a number, always finite.

    Attributes:
        low: Smallest value.
        high: Largest value.
        below: Exclusive upper bound, instead of ``high``.
        reason: Where the bounds come from, for the message.
    """

    low: float = -LARGEST
    high: float = LARGEST
    below: float | None = None
    reason: str = ""

    @property
    def largest(self) -> float:
        """Largest value, whether ``high`` or ``below`` bounds it."""
        return self.high if self.below is None else math.nextafter(self.below, self.low)

    def __contains__(self, value: validation.Real) -> bool:
        return bool(self.low <= value <= self.largest)

    def __str__(self) -> str:
        high = f"{self.high:.10g}" if self.below is None else f"below {self.below:.10g}"
        return f"from {self.low:.10g} to {high}" + (f" ({self.reason})" if self.reason else "")


def check_number(name: str, value: object, *, low: float = -LARGEST, high: float = LARGEST, reason: str = "") -> float:
    """Return a real number within bounds as a float.

    Args:
        name: Name of the field.
        value: A Python or numpy number, not a bool.
        low: Smallest value.
        high: Largest value.
        reason: Where the bounds come from, for the message.

    Raises:
        ValueError: If it is not a number, or out of bounds.
    """
    if type(value) is float and low <= value <= high:
        return value + 0.0  # a zero without a sign
    return validation.check_number(name, value, low, high, f"a number {Bounds(low, high, None, reason)}")


def check_range(
    name: str,
    value: object,
    *,
    whole: bool = False,
    low: float = -LARGEST,
    high: float = LARGEST,
    below: float | None = None,
    reason: str = "",
) -> tuple[float, float]:
    """Return a range as a tuple of its lower and upper end, which may be equal.

    Args:
        name: Name of the field.
        value: Two numbers in a tuple, list or array.
        whole: Whether both must be whole numbers.
        low: Smallest value.
        high: Largest value.
        below: Exclusive upper bound, instead of ``high``.
        reason: Where the bounds come from, for the message.

    Raises:
        ValueError: If it is not two numbers, an end is out of bounds, or the first exceeds the second.
    """
    bounds, is_number = Bounds(low, high, below, reason), is_whole if whole else is_real
    wanted = f"two {'whole numbers' if whole else 'numbers'} {bounds}, the smaller one first"
    entries = validation.check_sequence(name, value, wanted)
    ends = [end for end in entries if is_number(end) and end in bounds]
    if not (len(ends) == len(entries) == 2 and ends[0] <= ends[1]):
        raise refusal(name, value, wanted)
    first, last = map(int if whole else float, ends)
    return first, last


def check_fractions(name: str, value: object, *, count: int) -> tuple[float, ...]:
    """Return some numbers from 0 to below 1 as a tuple of floats.

    Raises:
        ValueError: If they are not that.
    """
    bound = f"{count} numbers from 0 to below 1"
    entries = validation.check_sequence(name, value, bound)
    fractions = [float(entry) for entry in entries if is_real(entry) and 0 <= entry < 1]
    if not len(fractions) == len(entries) == count:
        raise refusal(name, value, bound)
    return tuple(fractions)


def check_ranges(name: str, value: object, *, bounds: Sequence[Mapping[str, float]]) -> tuple[tuple[float, float], ...]:
    """Return several ranges as a tuple, each checked against bounds of its own."""
    wanted = f"{len(bounds)} ranges of two numbers each"
    ranges = validation.check_sequence(name, value, wanted)
    if len(ranges) != len(bounds):
        raise refusal(name, value, wanted)
    return tuple(
        check_range(f"{name}[{k}]", ends, low=own.get("low", -LARGEST), high=own.get("high", LARGEST))
        for k, (ends, own) in enumerate(zip(ranges, bounds, strict=True))
    )


def check_flag(name: str, value: object) -> bool:
    """Return a Python or numpy bool as a bool.

    Raises:
        ValueError: If it is anything else.
    """
    if not isinstance(value, bool | np.bool_):
        raise refusal(name, value, "True or False")
    return bool(value)


def check_choice(name: str, value: object, *, choices: Sequence[str]) -> str:
    """Return a string that is one of the choices.

    Raises:
        ValueError: If it is none of them.
    """
    if not (isinstance(value, str) and value in choices):
        raise refusal(name, value, " or ".join(map(repr, choices)))
    return str(value)


def check_type(name: str, value: object, kind: type | UnionType, wanted: str = "") -> None:
    """Raise an error unless a value is of a type.

    Args:
        name: Name of the field.
        value: The value.
        kind: The type, or a union of types.
        wanted: What the message says it must be; by default the name of the type.

    Raises:
        TypeError: If it is of another type.
    """
    if not isinstance(value, kind):
        raise refusal(name, value, wanted or f"a {getattr(kind, '__name__', kind)}", TypeError)


def check_instance(
    name: str,
    value: object,
    *,
    kind: type[DataclassT],
    default: Callable[[], DataclassT] | None = None,
    usual: Mapping[str, object] | None = None,
) -> DataclassT:
    """Return a dataclass, given as one or as a mapping of its fields; None and ``{}`` stand for the default.

    Args:
        name: Name of the field.
        value: The dataclass or the mapping.
        kind: The class.
        default: Makes the default; ``None`` for none.
        usual: Fields that a mapping need not name.

    Raises:
        TypeError: If it is anything else, or the mapping has an unknown field.
        ValueError: If a field is out of bounds.
    """
    if default is not None and (value is None or (isinstance(value, Mapping) and not value)):
        return default()
    if isinstance(value, Mapping):
        check_names(name, value, [declared.name for declared in fields(kind) if declared.init])
        return kind(**{**(usual or {}), **value})
    check_type(name, value, kind, f"a {kind.__name__} or a mapping of its fields")
    assert isinstance(value, kind)
    return value


def check_names(name: str, given: Mapping[str, object], valid: Sequence[str], refused: str = "does not take") -> None:
    """Raise an error if a mapping has keys other than the valid names.

    Raises:
        TypeError: Naming the unknown keys and the valid names.
    """
    unknown = [shown(key) for key in given if not (isinstance(key, str) and key in valid)]
    if unknown:
        raise TypeError(f"{name} {refused} {', '.join(unknown)}; it takes {', '.join(valid)}")


def check_array(name: str, value: object, shape: tuple[int, ...]) -> np.ndarray:
    """Return finite real numbers as an array of floats.

    Raises:
        ValueError: If the shape differs, or an entry is not a finite real number (booleans, complex numbers, strings
            and objects are not).
    """
    array = as_array(value)
    numeric = array.dtype.kind in "fiu" and array.dtype.itemsize <= 8
    if not (numeric and array.shape == shape and _all_finite(array)):
        raise refusal(name, value, f"finite numbers of shape {shape}")
    return array.astype(float)


def check_seed(name: str, value: object) -> int | None:
    """Return a seed as an int, or None.

    Raises:
        ValueError: If it is neither None nor a whole number from 0 on.
    """
    if value is None:
        return None
    if not (isinstance(value, int | np.integer) and is_whole(value) and value >= 0):
        raise refusal(name, value, "None or a whole number from 0 on")
    return int(value)


def as_array(value: object) -> np.ndarray:
    """Return a value as an array, or an empty array of objects if it has no numbers."""
    try:
        return np.asarray(value)
    except Exception:  # an object's own conversion may raise anything
        return np.empty(0, object)


def _all_finite(array: np.ndarray) -> bool:
    if array.size < 16:  # a Python loop is faster than starting numpy's
        return all(map(math.isfinite, array.ravel().tolist()))
    return bool(np.isfinite(array).all())
