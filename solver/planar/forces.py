"""Contact force, read in two ways: by energy, and by the paper's virtual work (section 4, eq. 6–11).

Both are forces on the robot, in newton, in the base frame, one row per obstacle, zero where nothing touches. The
two are different quantities: the virtual-work estimate knows the tension and the free kinematics only, is free of
material constants, and is fitted to an experiment through μ; the energy force is that of the model itself.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from solver.common.operations import NUMBERS, Operations
from solver.common.validation import LARGEST, array, finite, instance, pair, positive
from solver.planar.equilibrium import Equilibrium
from solver.planar.free import clearance, fitted_slopes, free_tension
from solver.planar.robot import Robot


def force_true(equilibrium: Equilibrium) -> np.ndarray:
    """Contact force by energy, ``F_j = EI / 2 l0 · λ_j ∇c_j``, ``(m, 2)`` [N]."""
    instance("equilibrium", equilibrium, Equilibrium, "take one of a solver of the plane")
    return equilibrium.forces.copy()


def virtual_work(x: Any, y: Any, load: Any, slopes: Any, offset_mm: float, operations: Operations) -> Any:
    """How many times a force does the virtual work on the tip that a cable load does: c of ``c F·x' = a P_l φ'``.

    Zero for a force that does no work against the motion. Of one robot, in numbers, or of many, in arrays ``(N,)``.

    Args:
        x: Force along x [N].
        y: Force along y [N].
        load: Cable load P_l [N].
        slopes: Slopes of the free tip's x, y and angle [mm, mm, rad per mm].
        offset_mm: Distance a of the cable from the backbone [mm].
        operations: Those of numbers or those of arrays.
    """
    in_x, in_y, turn = slopes
    work = x * in_x + y * in_y
    return offset_mm * load * turn / operations.where(work < 0, work, -math.inf)


@dataclass(frozen=True, slots=True)
class VirtualWork:
    """The paper's estimator: ``Σ N_j (n_j + μ t_j)·x' = a P_l φ'`` with the slopes x', φ' of the free tip.

    ``n`` is the outward normal, ``t`` the same turned by +90°, ``P_l`` the tension since the onset of the contact. For
    a wall with normal (−1, 0) this is eq. 11. Several obstacles share one unknown in proportion to their multipliers.

    No constant of the material enters: the estimate is in the unit of the tension.

    Attributes:
        friction: Ratio μ of tangential to normal force, found from one experiment (:meth:`calibrated`).
        fit_range_mm: Range of cable displacement that straight lines are fitted over for the slopes, as in Fig. 7;
            ``None`` for the exact slopes where the robot is.

    Raises:
        ValueError: If a value is not finite, or the range does not grow from a displacement that is not negative.
    """

    friction: float = 0.0
    fit_range_mm: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "friction", finite("friction", self.friction))
        if self.fit_range_mm is not None:
            low, high = pair("fit_range_mm", self.fit_range_mm)
            if not 0 <= low < high:
                raise ValueError(f"fit_range_mm is {self.fit_range_mm}; it must grow from 0 or more")
            object.__setattr__(self, "fit_range_mm", (low, high))

    def estimate(self, equilibrium: Equilibrium) -> np.ndarray:
        """Estimated contact force, ``(m, 2)`` [N].

        Raises:
            ValueError: If ``fit_range_mm`` is outside the robot's range.
            TypeError: If ``equilibrium`` is something else.
        """
        instance("equilibrium", equilibrium, Equilibrium, "take one of a solver of the plane")
        slopes = equilibrium.tip_slopes
        if self.fit_range_mm:
            slopes = fitted_slopes(equilibrium.robot.at(equilibrium.length_mm), *self.fit_range_mm)
        load, offset = equilibrium.tension - equilibrium.onset_tension, equilibrium.robot.offset_mm
        directions = equilibrium.forces @ self.turn
        x, y = directions.sum(axis=0).tolist()
        return np.asarray(virtual_work(x, y, load, slopes.tolist(), offset, NUMBERS) * directions)

    @property
    def turn(self) -> np.ndarray:
        """Matrix that a row of normal forces is multiplied with, to have friction beside it, ``(2, 2)``."""
        return np.array([[1.0, self.friction], [-self.friction, 1.0]])

    @classmethod
    def calibrated(cls, force: float, load: float, slopes: np.ndarray, offset_mm: float) -> "VirtualWork":
        """The estimator whose μ makes eq. 11 give a force measured on a wall across +x at a known cable load.

        Args:
            force: Measured magnitude of P_x, in the unit of ``load``.
            load: Cable load P_l since contact.
            slopes: Tip slopes (f'_x, f'_y, φ'), ``(3,)`` [mm/mm, mm/mm, rad/mm].
            offset_mm: Distance of the cable from the backbone [mm].

        Raises:
            ValueError: If a number is not finite, force, load or offset is not positive, or the tip does not move in y,
                so that friction does no work.
        """
        force, load, offset = positive("force", force), positive("load", load), positive("offset_mm", offset_mm)
        x, y, turn = array("slopes", slopes, (3,), -LARGEST, LARGEST, "finite").tolist()
        if y == 0:
            raise ValueError(
                f"slopes is {slopes}; the tip must move in y for friction to do work: pull the cable first"
            )
        return cls(friction=(-offset * load * turn / force - x) / y)


def onset_tension(before: Equilibrium, now: Equilibrium) -> float:
    """Tension where the present contact began, after a step: kept during a contact, zero while nothing touches [N].

    A contact that begins inside a step does so on the free robot; the tension there is that of the free robot where it
    first touches.
    """
    if not now.multipliers.any():
        return 0.0
    if before.multipliers.any():
        return before.onset_tension

    def on_the_way(part: float) -> tuple[Robot, float]:
        length = before.length_mm + part * (now.length_mm - before.length_mm)
        return now.robot.at(length), before.cable_mm + part * (now.cable_mm - before.cable_mm)

    def clear_of_all(part: float) -> bool:
        robot, cable = on_the_way(part)
        return clearance(robot, now.scene, cable) > 0

    clear, touching = 0.0, 1.0
    if not clear_of_all(touching):
        for _ in range(20):
            middle = (clear + touching) / 2
            clear, touching = (middle, touching) if clear_of_all(middle) else (clear, middle)
    return free_tension(*on_the_way(touching))
