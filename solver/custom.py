"""Obstacles of any smooth shape, given as a CasADi expression."""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Self

import casadi as ca
import numpy as np

from solver._kernel import SHAPE_SIZE
from solver.formulation import GapLaw, gap_function
from solver.obstacles import Extent, Obstacle, Pair, directions, pair, plus, unit
from solver.robot import require_positive

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
PLACE_SIZE = 5  # numbers of a shape before its sizes: centre, axis, growth
BISECTIONS = 60


@dataclass(frozen=True, slots=True)
class Family:
    """Shapes ``F(point, sizes) < 0``, traced once; families of the same expression are equal.

    The text lists elementary operations and nothing else, unlike CasADi's own serialisation, which loads the libraries
    it names: a family that comes from elsewhere cannot run code.

    Attributes:
        text: The number of sizes and the operations, as :meth:`trace` writes them.

    Raises:
        ValueError: If the text is something else.
    """

    text: str

    def __post_init__(self) -> None:
        _rebuilt(self.text)

    @classmethod
    def trace(cls, function: Callable[[ca.SX, ca.SX], ca.SX], sizes: int = 0) -> Self:
        """Trace a Python function of CasADi symbols.

        Args:
            function: ``(point, sizes) → F``, smooth, negative inside and positive outside, its slope not zero on the
                surface; the point (2) is counted from the centre of the shape [mm].
            sizes: How many numbers tell a shape of the family from the others.

        Raises:
            ValueError: If there are too many sizes, or the function is not one number made of elementary operations.
        """
        point, values = ca.SX.sym("point", 2), ca.SX.sym("sizes", sizes)
        traced = ca.Function("family", [point, values], [function(point, values)])
        if not traced.nnz_out() == traced.numel_out() == 1:
            raise ValueError(f"the function of a family gives {traced.size_out(0)} numbers; it must give one")
        steps = [_step(traced, k) for k in range(traced.n_instructions())]
        return cls(json.dumps({"sizes": sizes, "steps": steps}))

    @property
    def function(self) -> ca.Function:
        """``(point, sizes) → F``."""
        return _rebuilt(self.text)

    def __call__(self, point: ca.SX, shape: ca.SX) -> ca.SX:
        """Gap to ``shape = (x, y, ux, uy, growth, *sizes)``, turned from x to u: ``F / |∇F|`` less the growth."""
        local, axis = point - shape[:2], shape[2:4]
        along, across = ca.dot(local, axis), local[1] * axis[0] - local[0] * axis[1]
        value = self.function(ca.vertcat(along, across), shape[PLACE_SIZE:])
        return value / ca.norm_2(ca.gradient(value, point)) - shape[4]


def _step(function: ca.Function, k: int) -> list[Any]:
    """An instruction as ``[name, result, *arguments]``; places of an input, a constant and the output take its form."""
    name = NAMES.get(function.instruction_id(k))
    if name is None:
        raise ValueError(
            "the function of a family calls another one; it must be made of CasADi's elementary operations"
        )
    if name == "CONST":
        return [name, *function.instruction_output(k), function.instruction_constant(k)]
    if name == "OUTPUT":
        return [name, *function.instruction_input(k)]
    return [name, *function.instruction_output(k), *function.instruction_input(k)]


@lru_cache(maxsize=64)
def _rebuilt(text: str) -> ca.Function:
    """The function of a family's text; nothing but elementary operations is ever made of it."""
    try:
        read = json.loads(text)
        if not 0 <= read["sizes"] <= SHAPE_SIZE - PLACE_SIZE:
            raise ValueError("it has too many sizes")
        inputs = ca.SX.sym("point", 2), ca.SX.sym("sizes", read["sizes"])
        work: dict[int, ca.SX] = {}
        for name, place, *arguments in read["steps"]:
            if name == "INPUT":
                which, index = arguments
                work[place] = inputs[which][index]
            elif name == "CONST":
                work[place] = ca.SX(*map(float, arguments))
            elif name in UNARY:
                work[place] = ca.SX.unary(OPERATIONS[name], *(work[k] for k in arguments))
            elif name in BINARY:
                work[place] = ca.SX.binary(OPERATIONS[name], *(work[k] for k in arguments))
            elif name == "OUTPUT":
                return ca.Function("family", [*inputs], [work[place]])
        raise ValueError("it has no output")
    except (ValueError, TypeError, LookupError, AttributeError, NotImplementedError, RuntimeError) as error:
        raise ValueError(f"text is {text!r:.40}…, no list of operations; families are made by Family.trace") from error


@dataclass(frozen=True, slots=True, kw_only=True)
class Custom(Obstacle):
    """Any smooth shape whose whole surface can be seen from its centre.

    The solver compiles the gap with the machine's C compiler, once for a family; ``ReferenceSolver`` needs none.

    Attributes:
        family: The shapes it is one of.
        sizes: The numbers that tell it from the others.
        center: Where the family's point (0, 0) is [mm].
        axis: Direction of the family's x axis; normalised on construction.
        reach: Radius of a disc about the centre that holds it [mm].

    Raises:
        ValueError: If a value is not finite, there are too few or too many sizes, the function is not negative at the
            centre, or not positive all along the rim of the disc.
    """

    family: Family
    sizes: tuple[float, ...] = ()
    center: Pair
    axis: Pair = (1.0, 0.0)
    reach: float

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        object.__setattr__(self, "sizes", tuple(float(value) for value in self.sizes))
        object.__setattr__(self, "center", pair("center", self.center))
        object.__setattr__(self, "axis", unit("axis", self.axis, "of the shape's x axis"))
        require_positive("reach", self.reach)
        expected, most = self.family.function.numel_in(1), SHAPE_SIZE - PLACE_SIZE
        if len(self.sizes) != expected or expected > most:
            raise ValueError(f"sizes is {self.sizes}; its family takes {expected} numbers, of at most {most}")
        if not self._values(np.zeros((1, 2))) < 0:
            raise ValueError(f"the function of {self!r} is not negative at its centre")
        if not np.all(self._values(self.reach * directions()) > 0):
            raise ValueError(f"reach is {self.reach}; the shape does not end within it, give a larger one")

    @property
    def law(self) -> GapLaw:
        """The gap law of the family."""
        return GapLaw("custom", self.family, PLACE_SIZE + len(self.sizes), (4,))

    @property
    def parameters(self) -> tuple[float, ...]:
        """(x, y, ux, uy, 0, *sizes)."""
        return (*self.center, *self.axis, 0.0, *self.sizes)

    @property
    def extent(self) -> Extent:
        """The disc of the reach; width and curvature as measured on the outline."""
        return _extent(self)

    def shifted(self, by: Iterable[float]) -> Self:
        """The same shape elsewhere."""
        return replace(self, center=plus(self.center, by))

    def outline(self) -> np.ndarray:
        """Points of its surface, ``(k, 2)`` [mm]."""
        rays = directions()
        near, far = np.zeros(len(rays)), np.full(len(rays), self.reach)
        for _ in range(BISECTIONS):
            middle = (near + far) / 2
            outside = self._values(middle[:, None] * rays) > 0
            near, far = np.where(outside, near, middle), np.where(outside, middle, far)
        x, y = self.axis
        return np.asarray(self.center + far[:, None] * rays @ np.array([[x, y], [-y, x]]))

    def _values(self, points: np.ndarray) -> np.ndarray:
        """The family's function at points from the centre, ``(k, 2) → (k,)``."""
        return np.asarray(self.family.function(points.T, self.sizes)).ravel()

    def _law(self, points: np.ndarray) -> np.ndarray:
        return self._derivatives(points)[..., :3]

    def _derivatives(self, points: np.ndarray) -> np.ndarray:
        """Gap, its slopes and its second derivatives xx, xy, yy at points ``(..., 2)``, ``(..., 6)``."""
        points = np.asarray(points, dtype=float)
        values = gap_function(self.law)(points.reshape(-1, 2).T, self.parameters)
        return np.asarray(values).T.reshape(*points.shape[:-1], 6)


@lru_cache(maxsize=256)
def _extent(shape: Custom) -> Extent:
    outline = shape.outline()
    width = np.ptp(outline @ directions().T, axis=0).min()
    _, x, y, xx, xy, yy = shape._derivatives(outline).T
    curvature = np.abs(xx * y**2 - 2 * xy * x * y + yy * x**2).max()
    return Extent(shape.center, shape.reach, float(width), float(min(1 / curvature, shape.reach)))
