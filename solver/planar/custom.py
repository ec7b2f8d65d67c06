"""Obstacles of any smooth shape, given as CasADi expressions."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, NamedTuple, Self

import casadi as ca
import numpy as np

from solver._kernel import SHAPE_SIZE
from solver.common.gap_laws import GapLaw, gap_function
from solver.common.obstacle import SHARPEST, Extent, Obstacle
from solver.common.validation import (
    Pair,
    Point,
    check_finite,
    check_instance,
    check_planar_direction,
    check_sequence,
    check_whole,
    shown,
)
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
POSE_SIZE = 5  # parameters of a shape before its sizes: centre, axis, growth
BISECTIONS = 60
RAY_SAMPLES = 32  # along a ray from the centre to the outline, and from there to the reach
NUDGE = 1e-6  # step to either side of the outline, over the reach
SLOPE_TOLERANCE, RATE_TOLERANCE = 1e-6, 1e-3  # of the gap's slope on the outline, and of its change across it
SMOOTH = "give a function that is smooth there, such as a distance, with a non-zero slope on its surface"


@dataclass(frozen=True, slots=True)
class Family:
    """Family of shapes ``F(point, sizes) < 0``, traced once; families of the same expression are equal.

    The text lists elementary operations and nothing else, unlike CasADi's own serialisation, which loads the libraries
    it names: a family from an untrusted source cannot run code.

    Attributes:
        text: The number of sizes and the operations, as :meth:`trace` writes them.

    Raises:
        ValueError: If the text is no such list.
    """

    text: str

    def __post_init__(self) -> None:
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
        except (RuntimeError, NotImplementedError) as error:  # of CasADi
            raise ValueError(f"function fails on CasADi symbols of a point and {sizes} sizes: {error}") from error
        if not (isinstance(returned, ca.SX) and returned.is_scalar() and returned.nnz() == 1):
            raise ValueError(f"function returned {shown(returned)}; it must return one CasADi expression of the point")
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Custom(Obstacle):
    """Any smooth shape that is star-shaped: its whole surface can be seen from its centre.

    The solver compiles the gap with the machine's C compiler, once for each family; ``ReferenceSolver`` needs none.

    Attributes:
        family: Family of the shape.
        sizes: Parameters of the shape within its family.
        center: Position of the family's point (0, 0) [mm].
        axis: Direction of the family's x axis; normalised on construction.
        reach: Radius of a disc about the centre that encloses the shape [mm].

    Raises:
        ValueError: If a value is not finite, the number of sizes is wrong, the function is not negative at the centre
            or not positive all along the rim of the disc, or if at a sampled point of the outline the gap is no
            distance, because the function has a step, a kink or no slope.
    """

    size_fields: ClassVar[tuple[str, ...]] = ("reach",)

    family: Family
    sizes: tuple[float, ...] = ()
    center: Pair
    axis: Pair = (1.0, 0.0)
    reach: float

    def __post_init__(self) -> None:
        Obstacle.__post_init__(self)
        check_instance("family", self.family, Family, "trace a function with Family.trace")
        sizes = check_sequence("sizes", self.sizes, "a tuple of numbers")
        object.__setattr__(self, "sizes", tuple(check_finite("a number of sizes", size) for size in sizes))
        object.__setattr__(self, "axis", check_planar_direction("axis", self.axis, "of the shape's x axis"))
        expected, most = self.family.function.numel_in(1), SHAPE_SIZE - POSE_SIZE
        if len(self.sizes) != expected or expected > most:
            raise ValueError(f"sizes is {self.sizes}; its family takes {expected} numbers, of at most {most}")
        if not self._values(np.zeros((1, 2))) < 0:
            raise ValueError(f"the function of a shape at {self.center} is not negative at its centre; change its sign")
        if not np.all(self._values(self.reach * directions()) > 0):
            raise ValueError(f"reach is {self.reach}; the shape extends beyond it, give a larger one")
        flaw = _flaw(self.family, self.sizes, self.reach)
        if flaw is not None:
            x, y = self._placed(np.array(flaw.point)).tolist()
            raise ValueError(f"{flaw.problem} at the point ({x:.6g}, {y:.6g}) of the shape's outline; {flaw.remedy}")

    @property
    def law(self) -> GapLaw:
        """Gap law of the family."""
        return GapLaw("custom", self.family, POSE_SIZE + len(self.sizes), (4,))

    @property
    def parameters(self) -> tuple[float, ...]:
        """Parameters (x, y, ux, uy, 0, *sizes) of the gap law."""
        return (*self.center, *self.axis, 0.0, *self.sizes)

    @property
    def extent(self) -> Extent:
        """Disc of the reach; inner radius and curvature are measured on the outline."""
        return _extent(self)

    @property
    def surface(self) -> np.ndarray:
        """Points of the surface, ``(k, 2)`` [mm]."""
        return self.outline()

    def outline(self) -> np.ndarray:
        """Return points of the surface, ``(k, 2)`` [mm]."""
        return self._placed(_outline(self.family, self.sizes, self.reach))

    def _placed(self, points: np.ndarray) -> np.ndarray:
        """Return points of the family, moved to the centre and turned from x to the axis."""
        x, y = self.axis
        return np.asarray(self.center + points @ np.array([[x, y], [-y, x]]))

    def _radii(self) -> list[tuple[str, float]]:
        return [("reach", self.reach), ("the sharpest radius", self.extent.min_curvature_radius)]

    def _values(self, points: np.ndarray) -> np.ndarray:
        """Return the family's function at points relative to the centre, ``(k, 2) → (k,)``."""
        return _values(self.family, self.sizes, points)

    def measure(self, points: np.ndarray) -> np.ndarray:
        """Return gap and gradient at points, which are not checked, ``(..., 3)``."""
        return self._derivatives(points)[..., :3]

    def _derivatives(self, points: np.ndarray) -> np.ndarray:
        """Return the gap, its slopes and its second derivatives xx, xy, yy at points ``(..., 2)``, ``(..., 6)``."""
        values = gap_function(self.law)(points.reshape(-1, 2).T, self.parameters)
        return np.asarray(values).T.reshape(*points.shape[:-1], 6)


class _Flaw(NamedTuple):
    """What is wrong with a shape, at which point of the family's coordinates, and what to do about it."""

    problem: str
    point: Point
    remedy: str


def _values(family: Family, sizes: tuple[float, ...], points: np.ndarray) -> np.ndarray:
    """Return a family's function at points relative to the centre, ``(k, 2) → (k,)``."""
    return np.asarray(family.function(points.T, sizes)).ravel()


@lru_cache(maxsize=256)
def _outline(family: Family, sizes: tuple[float, ...], reach: float) -> np.ndarray:
    """Return where rays from the centre leave a shape of a family, ``(k, 2)``, by bisection."""
    rays = directions()
    near, far = np.zeros(len(rays)), np.full(len(rays), reach)
    for _ in range(BISECTIONS):
        middle = (near + far) / 2
        outside = _values(family, sizes, middle[:, None] * rays) > 0
        near, far = np.where(outside, near, middle), np.where(outside, middle, far)
    return np.asarray(far[:, None] * rays)


@lru_cache(maxsize=256)
def _flaw(family: Family, sizes: tuple[float, ...], reach: float) -> _Flaw | None:
    """Return what keeps the gap of a shape from being a distance near its outline, ``None`` if nothing does."""
    outline = _outline(family, sizes, reach)
    law = gap_function(GapLaw("custom", family, POSE_SIZE + len(sizes), (4,)))

    def derivatives(points: np.ndarray) -> np.ndarray:
        return np.asarray(law(points.T, (0.0, 0.0, 1.0, 0.0, 0.0, *sizes)))

    at = derivatives(outline)
    unbounded = ~np.isfinite(at).all(axis=0)
    if unbounded.any():
        return _flaw_at(outline, unbounded, "the gap or its slope is not finite", SMOOTH)
    normals, nudge = at[1:3], NUDGE * reach
    size = np.hypot(*normals)
    outer, inner = (derivatives(outline + side * nudge * normals.T)[0] for side in (1, -1))
    rate = (outer - inner) / (2 * nudge)
    bend = np.abs(at[3] * normals[1] ** 2 - 2 * at[4] * normals[0] * normals[1] + at[5] * normals[0] ** 2)
    for flawed, problem, remedy in (
        (np.abs(at[0]) > SLOPE_TOLERANCE * reach, "the function jumps", SMOOTH),
        (np.abs(size - 1) > SLOPE_TOLERANCE, "the gap does not grow as the distance does, its slope is not 1", SMOOTH),
        ((inner >= 0) | (outer <= 0), "the gap is not negative just inside and positive just outside", SMOOTH),
        (~(np.abs(rate - 1) <= RATE_TOLERANCE), "the gap does not change as its slope says", SMOOTH),
        (bend * SHARPEST * reach > 1, "the outline has a corner", "round it"),
        (
            _crossed_again(family, sizes, reach, outline),
            "the ray from the centre meets the outline more than once",
            "move the centre to where the whole outline can be seen, or compose the shape of several",
        ),
    ):
        if flawed.any():
            return _flaw_at(outline, flawed, problem, remedy)
    return None


def _flaw_at(outline: np.ndarray, flawed: np.ndarray, problem: str, remedy: str) -> _Flaw:
    """Return the flaw at the first flawed point of an outline."""
    return _Flaw(problem, tuple(outline[int(flawed.argmax())].tolist()), remedy)


def _crossed_again(family: Family, sizes: tuple[float, ...], reach: float, outline: np.ndarray) -> np.ndarray:
    """Return which rays from the centre cross the outline more than once, by samples inside and outside, ``(k,)``."""
    parts = np.arange(1, RAY_SAMPLES) / RAY_SAMPLES
    within = np.stack([_values(family, sizes, part * outline) for part in parts])
    rim = reach * directions()
    beyond = np.stack([_values(family, sizes, outline + part * (rim - outline)) for part in parts])
    return np.asarray((within >= 0).any(axis=0) | (beyond <= 0).any(axis=0))


@lru_cache(maxsize=256)
def _extent(shape: Custom) -> Extent:
    """Return the disc of the reach with inner radius and curvature measured on the outline."""
    outline = shape.outline()
    shares = np.linspace(0, 1, RAY_SAMPLES)[:, None, None]
    inside = (shape.center + shares * (outline - shape.center)).reshape(-1, 2)
    inradius = np.linalg.norm(inside[:, None] - outline, axis=2).min(axis=1).max()
    _, x, y, xx, xy, yy = shape._derivatives(outline).T
    curvature = np.abs(xx * y**2 - 2 * xy * x * y + yy * x**2).max()
    return Extent(shape.center, shape.reach, float(inradius), float(min(1 / curvature, shape.reach)))
