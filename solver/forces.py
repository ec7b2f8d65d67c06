"""Contact force, read in two ways: by energy, and by the paper's virtual work (section 4, eq. 6–11).

Both are forces on the robot, in newton, in the base frame, one row per obstacle, zero where nothing touches. The
two are different quantities: the virtual-work estimate knows the tension and the free kinematics only, is free of
material constants, and is fitted to an experiment through μ; the energy force is that of the model itself.
"""

from dataclasses import dataclass

import numpy as np

from solver.equilibrium import Equilibrium
from solver.free import clearance, fitted_slopes, free_tension, tip_slopes
from solver.robot import Robot


def force_true(equilibrium: Equilibrium) -> np.ndarray:
    """Contact force by energy, ``F_j = EI / 2 l0 · λ_j ∇c_j``, ``(m, 2)`` [N]."""
    forces = np.zeros((len(equilibrium.scene), 2))
    for obstacle, multiplier, normal in _contacts(equilibrium):
        forces[obstacle] += equilibrium.stiffness * multiplier * normal
    return forces


@dataclass(frozen=True, slots=True)
class Onset:
    """Where the present contact began, which the estimate counts the cable load from.

    Attributes:
        tension: Cable tension at the onset [N]; ``None`` while nothing touches.
    """

    tension: float | None = None

    def after(self, before: Equilibrium, now: Equilibrium) -> "Onset":
        """The onset after a step: kept during a contact, forgotten when it ends, found when one begins.

        A contact that begins inside a step does so on the free robot; the tension there is that of the free robot
        where it first touches.
        """
        if not now.multipliers.any():
            return Onset()
        if self.tension is not None:
            return self
        if before.multipliers.any():
            return Onset(before.tension)
        return Onset(_first_tension(before, now))


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
    """

    friction: float = 0.0
    fit_range_mm: tuple[float, float] | None = None

    def estimate(self, equilibrium: Equilibrium, onset: Onset) -> np.ndarray:
        """Estimated contact force, ``(m, 2)`` [N]."""
        directions = np.zeros((len(equilibrium.scene), 2))
        if onset.tension is None:
            return directions
        for obstacle, multiplier, normal in _contacts(equilibrium):
            directions[obstacle] += multiplier * (normal + self.friction * np.array([-normal[1], normal[0]]))
        slopes = self.slopes(equilibrium.robot.at(equilibrium.length_mm), equilibrium.cable_mm)
        work = float((directions @ slopes[:2]).sum())
        load = equilibrium.robot.offset_mm * (equilibrium.tension - onset.tension) * slopes[2]
        return directions * (load / work) if work < 0 else np.zeros_like(directions)

    def slopes(self, robot: Robot, cable_mm: float) -> np.ndarray:
        """Slopes of the tip pose that the estimate is made with, ``(3,)`` [mm, mm, rad per mm]."""
        return fitted_slopes(robot, *self.fit_range_mm) if self.fit_range_mm else tip_slopes(robot, cable_mm)

    @classmethod
    def calibrated(cls, force: float, load: float, slopes: np.ndarray, offset_mm: float) -> "VirtualWork":
        """The estimator whose μ makes eq. 11 give a force measured on a wall across +x at a known cable load.

        Args:
            force: Measured magnitude of P_x, in the unit of ``load``.
            load: Cable load P_l since contact.
            slopes: Tip slopes (f'_x, f'_y, φ'), ``(3,)`` [mm/mm, mm/mm, rad/mm].
            offset_mm: Distance of the cable from the backbone [mm].

        Raises:
            ValueError: If force or load is not positive.
        """
        if not (force > 0 and load > 0):
            raise ValueError(f"force is {force}, load is {load}; both must be positive")
        return cls(friction=float((-offset_mm * load * slopes[2] / force - slopes[0]) / slopes[1]))


def _first_tension(before: Equilibrium, now: Equilibrium) -> float:
    """Tension of the free robot where it first touches, between one that is clear and one in contact [N]."""

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


def _contacts(equilibrium: Equilibrium) -> list[tuple[int, float, np.ndarray]]:
    """(obstacle, multiplier, outward normal) of every contact."""
    multipliers = equilibrium.multipliers
    found = multipliers.nonzero()
    if not found[0].size:
        return []
    points, obstacles = equilibrium.points, equilibrium.scene.obstacles
    displacements = equilibrium.displacements
    return [
        (j, float(multipliers[j, line, position]), obstacles[j].normal_at(points[line, position] - displacements[j]))
        for j, line, position in zip(*(index.tolist() for index in found), strict=True)
    ]
