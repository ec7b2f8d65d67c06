"""Obstacles of any smooth shape, given as CasADi expressions."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solver._kernel import SHAPE_SIZE
from solver.common.gap_laws import GapLaw, gap_function
from solver.common.obstacle import Extent, Obstacle
from solver.common.signals import held_signals
from solver.common.validation import (
    Pair,
    check_finite,
    check_instance,
    check_planar_direction,
    check_sequence,
)
from solver.planar.family import POSE_SIZE, Family
from solver.planar.obstacles import directions
from solver.planar.outline import Flaw, Form, find_distant_flaw, find_flaw, measure_outline, trace_outline

ROBOT_REACH = 1.5  # farthest point of a robot from its base, over its longest length, with room for its offset


@dataclass(frozen=True, slots=True, kw_only=True)
class Custom(Obstacle):
    """Any smooth shape that is star-shaped: its whole surface can be seen from its centre.

    The solver compiles the gap with the machine's C compiler, once for each family; ``ReferenceSolver`` needs none. It
    refuses a shape whose gap is no number, or of the wrong sign, somewhere that points of its robot can be.

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
    moving_fields: ClassVar[tuple[str, ...] | None] = ("center",)

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
        if not self._form.values(np.zeros((1, 2))) < 0:
            raise ValueError(f"the function of a shape at {self.center} is not negative at its centre; change its sign")
        if not np.all(self._form.values(self.reach * directions()) > 0):
            raise ValueError(f"reach is {self.reach}; the shape extends beyond it, give a larger one")
        self._refuse(find_flaw(self._form))

    @property
    def _form(self) -> Form:
        """The shape about the origin."""
        return Form(self.family, self.sizes, self.reach)

    @property
    def law(self) -> GapLaw:
        """Gap law of the family."""
        return self._form.law

    @property
    def parameters(self) -> tuple[float, ...]:
        """Parameters (x, y, ux, uy, 0, *sizes) of the gap law."""
        return (*self.center, *self.axis, 0.0, *self.sizes)

    @property
    def extent(self) -> Extent:
        """Disc of the reach; inner radius and curvature are measured on the outline."""
        return Extent(self.center, self.reach, *measure_outline(self._form))

    @property
    def surface(self) -> np.ndarray:
        """Points of the surface, ``(k, 2)`` [mm]."""
        return self.outline()

    def outline(self) -> np.ndarray:
        """Return points of the surface, ``(k, 2)`` [mm]."""
        return self._placed(trace_outline(self._form))

    def check_proportion(self, length_mm: float) -> None:
        """Check also that the gap is of use wherever points of a robot of some length can be.

        Raises:
            ValueError: Naming the value and the bound, or the point and the remedy.
        """
        Obstacle.check_proportion(self, length_mm)
        farthest = math.hypot(*self.center) + ROBOT_REACH * length_mm
        self._refuse(find_distant_flaw(self._form, farthest, length_mm / 2), ", where points of the robot can be")

    def _refuse(self, flaw: Flaw | None, where: str = " of the shape's outline") -> None:
        """Raise an error that names what is wrong at a point, if anything is."""
        if flaw is not None:
            x, y = self._placed(np.array(flaw.point)).tolist()
            raise ValueError(f"{flaw.problem} at the point ({x:.6g}, {y:.6g}){where}; {flaw.remedy}")

    def _placed(self, points: np.ndarray) -> np.ndarray:
        """Return points of the family, moved to the centre and turned from x to the axis."""
        x, y = self.axis
        return np.asarray(self.center + points @ np.array([[x, y], [-y, x]]))

    def _radii(self) -> list[tuple[str, float]]:
        return [("reach", self.reach), ("the sharpest radius", self.extent.min_curvature_radius)]

    @held_signals()
    def measure(self, points: np.ndarray) -> np.ndarray:
        """Return gap and gradient at points, which are not checked, ``(..., 3)``."""
        values = np.asarray(gap_function(self.law)(points.reshape(-1, 2).T, self.parameters))
        return values[:3].T.reshape(*points.shape[:-1], 3)
