"""Families of shapes, given as CasADi expressions."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import casadi as ca

from solver._kernel import SHAPE_SIZE
from solver.common.signals import held_signals
from solver.common.validation import check_instance, check_whole, shown

UNARY = (
    *("NEG", "EXP", "LOG", "SQRT", "SQ", "TWICE", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "NOT", "FLOOR", "CEIL"),
    *("FABS", "SIGN", "ERF", "INV", "SINH", "COSH", "TANH", "ASINH", "ACOSH", "ATANH", "ERFINV", "LOG1P", "EXPM1"),
)
BINARY = (
    *("ADD", "SUB", "MUL", "DIV", "POW", "CONSTPOW", "LT", "LE", "EQ", "NE", "AND", "OR", "FMOD", "COPYSIGN"),
    *("IF_ELSE_ZERO", "FMIN", "FMAX", "ATAN2", "HYPOT", "REMAINDER"),
)
OPERATIONS = {name: getattr(ca, f"OP_{name}") for name in (*UNARY, *BINARY, "CONST", "INPUT", "OUTPUT")}
NAMES = {operation: name for name, operation in OPERATIONS.items()}
POSE_SIZE = 5  # parameters of a shape before its sizes: centre, axis, growth


@dataclass(frozen=True, slots=True)
class Family:
    """Family of shapes ``F(point, sizes) < 0``, traced once; families of the same expression are equal.

    The text lists elementary operations and nothing else, unlike CasADi's own serialisation, which loads the libraries
    it names: a family from an untrusted source cannot run code.

    Attributes:
        text: The number of sizes and the operations, as :meth:`trace` writes them.

    Raises:
        ValueError: If the text is no such list.
        TypeError: If it is no text.
    """

    text: str

    def __post_init__(self) -> None:
        check_instance("text", self.text, str, "make families by Family.trace")
        _rebuild(self.text)

    @classmethod
    def trace(cls, function: Callable[[ca.SX, ca.SX], ca.SX], sizes: int = 0) -> Self:
        """Trace a Python function of CasADi symbols.

        Args:
            function: ``(point, sizes) → F``, smooth, negative inside and positive outside, with a non-zero slope on the
                surface; the point (2) is relative to the centre of the shape [mm].
            sizes: Number of parameters that distinguish shapes of the family.

        Raises:
            ValueError: If ``sizes`` is out of range, or the function does not return one expression made of elementary
                operations.
            TypeError: If ``function`` cannot be called.
        """
        if not callable(function):
            raise TypeError(
                f"function is {shown(function)}; it must be a function (point, sizes) → F of CasADi symbols"
            )
        sizes = check_whole("sizes", sizes, 0, SHAPE_SIZE - POSE_SIZE)
        point, values = ca.SX.sym("point", 2), ca.SX.sym("sizes", sizes)
        try:
            returned = function(point, values)
        except (RuntimeError, NotImplementedError, TypeError) as error:  # of CasADi
            raise ValueError(f"function fails on CasADi symbols of a point and {sizes} sizes: {error}") from error
        if not (isinstance(returned, ca.SX) and returned.is_scalar() and returned.nnz() == 1):
            raise ValueError(f"function returned {shown(returned)}; it must return one CasADi expression of the point")
        with held_signals():
            traced = ca.Function("family", [point, values], [returned])
            steps = [_step(traced, k) for k in range(traced.n_instructions())]
        return cls(json.dumps({"sizes": sizes, "steps": steps}))

    @property
    def function(self) -> ca.Function:
        """CasADi function ``(point, sizes) → F``."""
        return _rebuild(self.text)

    def __call__(self, point: ca.SX, shape: ca.SX) -> ca.SX:
        """Return the gap to ``shape = (x, y, ux, uy, growth, *sizes)``, turned from x to u: ``F / |∇F|`` − growth."""
        local, axis = point - shape[:2], shape[2:4]
        along, across = ca.dot(local, axis), local[1] * axis[0] - local[0] * axis[1]
        value = self.function(ca.vertcat(along, across), shape[POSE_SIZE:])
        return value / ca.norm_2(ca.gradient(value, point)) - shape[4]


def _step(function: ca.Function, k: int) -> list[str | int | float]:
    """Return an instruction as ``[name, result, *arguments]``, also an input, a constant or the output."""
    name = NAMES.get(function.instruction_id(k))
    if name is None:
        raise ValueError(
            "the function of a family calls another function; write it with CasADi's elementary operations alone"
        )
    if name == "CONST":
        return [name, *function.instruction_output(k), function.instruction_constant(k)]
    if name == "OUTPUT":
        return [name, *function.instruction_input(k)]
    return [name, *function.instruction_output(k), *function.instruction_input(k)]


@lru_cache(maxsize=64)
@held_signals()
def _rebuild(text: str) -> ca.Function:
    """Return the function of a family's text, which may hold elementary operations only."""
    try:
        read = json.loads(text)
        if not 0 <= read["sizes"] <= SHAPE_SIZE - POSE_SIZE:
            raise ValueError("it has too many sizes")
        inputs = ca.SX.sym("point", 2), ca.SX.sym("sizes", read["sizes"])
        work: dict[int, ca.SX] = {}
        for name, result, *arguments in read["steps"]:
            if name == "INPUT":
                number, index = arguments
                work[result] = inputs[number][index]
            elif name == "CONST":
                work[result] = ca.SX(*map(float, arguments))
            elif name in UNARY:
                work[result] = ca.SX.unary(OPERATIONS[name], *(work[k] for k in arguments))
            elif name in BINARY:
                work[result] = ca.SX.binary(OPERATIONS[name], *(work[k] for k in arguments))
            elif name == "OUTPUT":
                return ca.Function("family", [*inputs], [work[result]])
        raise ValueError("it has no output")
    except (ValueError, TypeError, LookupError, AttributeError, NotImplementedError, RuntimeError) as error:
        raise ValueError(
            f"text is {text!r:.40}…; it must be a list of operations: make families by Family.trace"
        ) from error
