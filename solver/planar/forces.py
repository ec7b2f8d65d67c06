"""Contact force by energy, and by the paper's virtual-work estimate (section 4, eq. 6–11).

Both are forces on the robot, in newtons, in the base frame, one row for each obstacle, zero where nothing touches. They
are different quantities. The energy force is that of the model itself. The virtual-work estimate uses only the tension
and the free kinematics, contains no material constant, and is calibrated by an experiment through μ.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from solver.common.operations import NUMBERS, Operations, Value
from solver.common.transition_laws import planar_work
from solver.common.validation import (
    LARGEST,
    check_alike,
    check_array,
    check_finite,
    check_instance,
    check_numbers,
    check_pair,
    check_positive,
    check_sequence,
    is_real,
    refusal,
)
from solver.planar.equilibrium import Equilibrium
from solver.planar.free import clearance, fitted_slopes, free_tension
from solver.planar.robot import Robot

VIRTUAL_WORK = ("x", "y", "load", "slopes", "slopes", "slopes", "offset_mm")  # names of the numbers it takes


def force_true(equilibrium: Equilibrium) -> np.ndarray:
    """Return the contact force by energy, ``F_j = EI / 2 l0 · λ_j ∇c_j``, ``(m, 2)`` [N]."""
    check_instance("equilibrium", equilibrium, Equilibrium, "take one of a solver of the plane")
    return equilibrium.forces.copy()


def virtual_work(
    x: Value, y: Value, load: Value, slopes: Iterable[Value], offset_mm: float, operations: Operations
) -> Value:
    """Return the factor c for which a force does the virtual work of a cable load: ``c F·x' = a P_l φ'``.

    It is zero for a force that does no work against the motion. Works on floats, for one robot, and on arrays ``(N,)``,
    for many.

    Args:
        x: Force along x [N].
        y: Force along y [N].
        load: Cable load P_l [N].
        slopes: Slopes of the free tip's x, y and angle [mm, mm, rad per mm].
        offset_mm: Distance a of the cable from the backbone [mm].
        operations: :data:`~solver.common.operations.NUMBERS` or :data:`~solver.common.operations.ARRAYS`.

    Raises:
        ValueError: If a value is no number, nor an array of them where these are expected.
        TypeError: If ``operations`` is of another class.
    """
    check_instance("operations", operations, Operations, "take NUMBERS or ARRAYS of solver.common.operations")
    given = check_sequence("slopes", slopes, "three slopes (x', y', φ')")
    if len(given) != 3:
        raise refusal("slopes", slopes, "three slopes (x', y', φ')")
    x, y, load, in_x, in_y, turn, offset = (
        _check_value(name, value, operations)
        for name, value in zip(VIRTUAL_WORK, (x, y, load, *given, offset_mm), strict=True)
    )
    check_alike(**{name: np.shape(value) for name, value in (("x", x), ("y", y), ("load", load), ("slopes", in_x))})
    factor: Value = planar_work((x, y), offset * load, (in_x, in_y, turn), operations)
    return factor


def _check_value(name: str, value: object, operations: Operations) -> Value:
    """Return a number, or where operations are those of arrays, one or an array of numbers of any size."""
    if operations is NUMBERS or is_real(value):
        return check_finite(name, value)
    return check_numbers(name, value, (...,))


@dataclass(frozen=True, slots=True)
class VirtualWork:
    """The paper's estimator: ``Σ N_j (n_j + μ t_j)·x' = a P_l φ'`` with the slopes x', φ' of the free tip.

    ``n`` is the outward normal, ``t`` the normal turned by +90°, ``P_l`` the tension gained since the onset of contact.
    For a wall with normal (−1, 0) this is eq. 11. Several obstacles share one unknown, in proportion to their
    multipliers. No material constant enters: the estimate is in the unit of the tension.

    Attributes:
        friction: Ratio μ of tangential to normal force, calibrated by one experiment (:meth:`calibrated`).
        fit_range_mm: Range of cable displacement over which straight lines are fitted for the slopes, as in Fig. 7;
            ``None`` for the exact slopes at the present displacement.

    Raises:
        ValueError: If a value is not finite, or the range is empty or begins below zero.
    """

    friction: float = 0.0
    fit_range_mm: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "friction", check_finite("friction", self.friction))
        if self.fit_range_mm is not None:
            low, high = check_pair("fit_range_mm", self.fit_range_mm)
            if not 0 <= low < high:
                raise ValueError(f"fit_range_mm is {self.fit_range_mm}; it must grow, from 0 or more")
            object.__setattr__(self, "fit_range_mm", (low, high))

    def estimate(self, equilibrium: Equilibrium) -> np.ndarray:
        """Return the estimated contact force, ``(m, 2)`` [N].

        Raises:
            ValueError: If ``fit_range_mm`` is outside the robot's range, or the robot does not bend evenly.
            TypeError: If ``equilibrium`` is not one of the plane.
        """
        check_instance("equilibrium", equilibrium, Equilibrium, "take one of a solver of the plane")
        if not equilibrium.robot.bends_evenly:
            raise ValueError(
                "the slopes of eq. 7 are those of a robot that one cable to its tip bends evenly; contact_estimate and "
                "shape_estimate take any robot"
            )
        slopes = equilibrium.tip_slopes
        if self.fit_range_mm:
            slopes = fitted_slopes(equilibrium.robot.at(equilibrium.length_mm), *self.fit_range_mm)
        load, offset = equilibrium.tension - equilibrium.onset_tension, equilibrium.robot.offset_mm
        directions = equilibrium.forces @ self.turn
        x, y = directions.sum(axis=0).tolist()
        return np.asarray(virtual_work(x, y, load, slopes.tolist(), offset, NUMBERS) * directions)

    @property
    def turn(self) -> np.ndarray:
        """Matrix that adds friction to a row of normal forces from the right, ``(2, 2)``."""
        return np.array([[1.0, self.friction], [-self.friction, 1.0]])

    @classmethod
    def calibrated(cls, force: float, load: float, slopes: np.ndarray, offset_mm: float) -> "VirtualWork":
        """Return the estimator whose μ makes eq. 11 give the force measured on a wall across +x at a known cable load.

        Args:
            force: Measured magnitude of P_x, in the unit of ``load``.
            load: Cable load P_l gained since contact.
            slopes: Tip slopes (f'_x, f'_y, φ'), ``(3,)`` [mm/mm, mm/mm, rad/mm].
            offset_mm: Distance of the cable from the backbone [mm].

        Raises:
            ValueError: If a number is not finite, if force, load or offset is not positive, or if the tip does not
                move in y, so that friction does no work.
        """
        force, load = check_positive("force", force), check_positive("load", load)
        offset = check_positive("offset_mm", offset_mm)
        x, y, turn = check_array("slopes", slopes, (3,), -LARGEST, LARGEST, "finite").tolist()
        if y == 0:
            raise ValueError(
                f"slopes is {slopes}; the tip must move in y for friction to do work: pull the cable first"
            )
        return cls(friction=(-offset * load * turn / force - x) / y)


def onset_tension(before: Equilibrium, now: Equilibrium) -> float:
    """Return the tension at the onset of the present contact, zero while nothing touches [N].

    It is kept for the duration of a contact. A contact that begins within the step begins on the free robot, with the
    tension of the free robot where it first touches.

    Args:
        before: Equilibrium before the step.
        now: Equilibrium after the step.

    Raises:
        ValueError: If they are of different robots.
        TypeError: If they are not equilibria of the plane.
    """
    for name, given in (("before", before), ("now", now)):
        check_instance(name, given, Equilibrium, "take one of a solver of the plane")
    if before.robot != now.robot:
        raise ValueError("before and now are equilibria of different robots; take those of one step")
    if not now.multipliers.any():
        return 0.0
    if before.multipliers.any():
        return before.onset_tension

    def free_at(part: float) -> tuple[Robot, float]:
        length = before.length_mm + part * (now.length_mm - before.length_mm)
        return now.robot.at(length), before.cable_mm + part * (now.cable_mm - before.cable_mm)

    def is_clear(part: float) -> bool:
        robot, cable = free_at(part)
        return clearance(robot, now.scene, cable) > 0

    clear, touching = 0.0, 1.0
    if not is_clear(touching):
        for _ in range(20):
            middle = (clear + touching) / 2
            clear, touching = (middle, touching) if is_clear(middle) else (clear, middle)
    return free_tension(*free_at(touching))
