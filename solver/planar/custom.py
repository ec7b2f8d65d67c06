"""Obstacles of any smooth shape, given as a CasADi expression."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar, NamedTuple, Self

import casadi as ca
import numpy as np

from solver._kernel import SHAPE_SIZE
from solver.common.gap_laws import GapLaw, gap_function
from solver.common.obstacle import SHARPEST, Extent, Obstacle
from solver.common.validation import Pair, Point, finite, instance, sequence, shown, unit, whole
from solver.planar.obstacles import directions

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
RAY_SAMPLES = 32  # of the function and of the largest disc inside, from the centre to the outline, and on to the reach
NUDGE = 1e-6  # to either side of the outline, over the reach
SLOPE_TOLERANCE, RATE_TOLERANCE = 1e-6, 1e-3  # of the gap's slope on the outline, and of its change across it
SMOOTH = "give a function that is smooth there, such as a distance, with a slope that is not zero on its surface"


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
            ValueError: If ``sizes`` is out of range, or the function does not return one expression made of elementary
                operations.
            TypeError: If ``function`` is none.
        """
        if not callable(function):
            raise TypeError(f"function is {shown(function)}; give a function (point, sizes) → F of CasADi symbols")
        sizes = whole("sizes", sizes, 0, SHAPE_SIZE - PLACE_SIZE)
        point, values = ca.SX.sym("point", 2), ca.SX.sym("sizes", sizes)
        try:
            returned = function(point, values)
        except (RuntimeError, NotImplementedError) as error:  # of CasADi
            raise ValueError(f"function is not one of CasADi symbols of a point and {sizes} sizes: {error}") from error
        if not (isinstance(returned, ca.SX) and returned.is_scalar() and returned.nnz() == 1):
            raise ValueError(f"function returned {shown(returned)}; it must return one CasADi expression of the point")
        traced = ca.Function("family", [point, values], [returned])
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
            centre, or not positive all along the rim of the disc; or if on its outline, as far as it is sampled, the
            gap is no distance, because the function has a step, a kink or no slope.
    """

    lengths: ClassVar[tuple[str, ...]] = ("reach",)

    family: Family
    sizes: tuple[float, ...] = ()
    center: Pair
    axis: Pair = (1.0, 0.0)
    reach: float

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        instance("family", self.family, Family, "trace a function with Family.trace")
        sizes = sequence("sizes", self.sizes, "a tuple of numbers")
        object.__setattr__(self, "sizes", tuple(finite("a number of sizes", size) for size in sizes))
        object.__setattr__(self, "axis", unit("axis", self.axis, "of the shape's x axis"))
        expected, most = self.family.function.numel_in(1), SHAPE_SIZE - PLACE_SIZE
        if len(self.sizes) != expected or expected > most:
            raise ValueError(f"sizes is {self.sizes}; its family takes {expected} numbers, of at most {most}")
        if not self._values(np.zeros((1, 2))) < 0:
            raise ValueError(f"the function of a shape at {self.center} is not negative at its centre; turn its sign")
        if not np.all(self._values(self.reach * directions()) > 0):
            raise ValueError(f"reach is {self.reach}; the shape does not end within it, give a larger one")
        flaw = _flaw(self.family, self.sizes, self.reach)
        if flaw is not None:
            x, y = self._turned(np.array(flaw.point)).tolist()
            raise ValueError(f"{flaw.what} at the point ({x:.6g}, {y:.6g}) of the shape's outline; {flaw.remedy}")

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
        """The disc of the reach; the largest disc inside and the curvature as measured on the outline."""
        return _extent(self)

    @property
    def surface(self) -> np.ndarray:
        """Points of its surface, ``(k, 2)`` [mm]."""
        return self.outline()

    def outline(self) -> np.ndarray:
        """Points of its surface, ``(k, 2)`` [mm]."""
        return self._turned(_outline(self.family, self.sizes, self.reach))

    def _turned(self, points: np.ndarray) -> np.ndarray:
        """Points of the family, at the centre and turned from x to the axis."""
        x, y = self.axis
        return np.asarray(self.center + points @ np.array([[x, y], [-y, x]]))

    def _radii(self) -> list[tuple[str, float]]:
        return [("reach", self.reach), ("the sharpest radius", self.extent.min_curvature_radius)]

    def _values(self, points: np.ndarray) -> np.ndarray:
        """The family's function at points from the centre, ``(k, 2) → (k,)``."""
        return _values(self.family, self.sizes, points)

    def measure(self, points: np.ndarray) -> np.ndarray:
        """Gap and gradient at points that need no check, ``(..., 3)``."""
        return self._derivatives(points)[..., :3]

    def _derivatives(self, points: np.ndarray) -> np.ndarray:
        """Gap, its slopes and its second derivatives xx, xy, yy at points ``(..., 2)``, ``(..., 6)``."""
        values = gap_function(self.law)(points.reshape(-1, 2).T, self.parameters)
        return np.asarray(values).T.reshape(*points.shape[:-1], 6)


class _Flaw(NamedTuple):
    """What is wrong with a shape, where, as the family counts points, and what to do about it."""

    what: str
    point: Point
    remedy: str


def _values(family: Family, sizes: tuple[float, ...], points: np.ndarray) -> np.ndarray:
    """A family's function at points from the centre, ``(k, 2) → (k,)``."""
    return np.asarray(family.function(points.T, sizes)).ravel()


@lru_cache(maxsize=256)
def _outline(family: Family, sizes: tuple[float, ...], reach: float) -> np.ndarray:
    """Where rays from the centre leave a shape of a family, ``(k, 2)``."""
    rays = directions()
    near, far = np.zeros(len(rays)), np.full(len(rays), reach)
    for _ in range(BISECTIONS):
        middle = (near + far) / 2
        outside = _values(family, sizes, middle[:, None] * rays) > 0
        near, far = np.where(outside, near, middle), np.where(outside, middle, far)
    return np.asarray(far[:, None] * rays)


@lru_cache(maxsize=256)
def _flaw(family: Family, sizes: tuple[float, ...], reach: float) -> _Flaw | None:
    """What keeps the gap of a shape from being a distance near its outline, ``None`` if nothing does."""
    outline = _outline(family, sizes, reach)
    law = gap_function(GapLaw("custom", family, PLACE_SIZE + len(sizes), (4,)))

    def derivatives(points: np.ndarray) -> np.ndarray:
        return np.asarray(law(points.T, (0.0, 0.0, 1.0, 0.0, 0.0, *sizes)))

    at = derivatives(outline)
    unbounded = ~np.isfinite(at).all(axis=0)
    if unbounded.any():
        return _Flaw("the gap or its slope is not finite", tuple(outline[int(unbounded.argmax())].tolist()), SMOOTH)
    normals, nudge = at[1:3], NUDGE * reach
    size = np.hypot(*normals)
    outer, inner = (derivatives(outline + side * nudge * normals.T)[0] for side in (1, -1))
    rate = (outer - inner) / (2 * nudge)
    parts = np.arange(1, RAY_SAMPLES) / RAY_SAMPLES
    within = np.stack([_values(family, sizes, part * outline) for part in parts])
    rim = reach * directions()
    beyond = np.stack([_values(family, sizes, outline + part * (rim - outline)) for part in parts])
    bend = np.abs(at[3] * normals[1] ** 2 - 2 * at[4] * normals[0] * normals[1] + at[5] * normals[0] ** 2)
    for flawed, what, remedy in (
        (np.abs(at[0]) > SLOPE_TOLERANCE * reach, "the function jumps", SMOOTH),
        (np.abs(size - 1) > SLOPE_TOLERANCE, "the gap does not grow as the distance does, its slope is not 1", SMOOTH),
        ((inner >= 0) | (outer <= 0), "the gap is not negative just inside and positive just outside", SMOOTH),
        (~(np.abs(rate - 1) <= RATE_TOLERANCE), "the gap does not change as its slope says", SMOOTH),
        (bend * SHARPEST * reach > 1, "the outline has a corner", "round it"),
        (
            (within >= 0).any(axis=0) | (beyond <= 0).any(axis=0),
            "the ray from the centre meets the outline more than once",
            "move the centre to where all of it can be seen, or make it of several shapes",
        ),
    ):
        if flawed.any():
            return _Flaw(what, tuple(outline[int(flawed.argmax())].tolist()), remedy)
    return None


@lru_cache(maxsize=256)
def _extent(shape: Custom) -> Extent:
    outline = shape.outline()
    shares = np.linspace(0, 1, RAY_SAMPLES)[:, None, None]
    inside = (shape.center + shares * (outline - shape.center)).reshape(-1, 2)
    inradius = np.linalg.norm(inside[:, None] - outline, axis=2).min(axis=1).max()
    _, x, y, xx, xy, yy = shape._derivatives(outline).T
    curvature = np.abs(xx * y**2 - 2 * xy * x * y + yy * x**2).max()
    return Extent(shape.center, shape.reach, float(inradius), float(min(1 / curvature, shape.reach)))
