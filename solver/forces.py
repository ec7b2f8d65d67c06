"""Contact force, read in two ways: by energy, and by the paper's virtual work (section 4, eq. 6–11).

Both are forces on the robot, in newton, in the base frame, one row per obstacle, zero where nothing touches. The
two are different quantities: the virtual-work estimate knows the tension and the free kinematics only, is free of
material constants, and is fitted to an experiment through μ; the energy force is that of the model itself.
"""

from dataclasses import dataclass

import numpy as np

from solver.equilibrium import Equilibrium
from solver.geometry import touchable_points, touching_points
from solver.robot import Robot
from solver.scene import Scene


def force_true(equilibrium: Equilibrium) -> np.ndarray:
    """Contact force by energy, ``F_j = EI / 2 l0 · λ_j ∇c_j``, ``(m, 2)`` [N]."""
    forces = np.zeros((len(equilibrium.scene), 2))
    for obstacle, multiplier, normal in _contacts(equilibrium):
        forces[obstacle] += equilibrium.robot.stiffness * multiplier * normal
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

        A contact that begins inside a step does so on the free robot; the tension there is that of the free robot at
        the cable displacement where it first touches.
        """
        if not now.multipliers.any():
            return Onset()
        if self.tension is not None:
            return self
        if before.multipliers.any():
            return Onset(before.tension)
        return Onset(free_tension(now.robot, _first_touch(now.robot, now.scene, before.cable_mm, now.cable_mm)))


@dataclass(frozen=True, slots=True)
class VirtualWork:
    """The paper's estimator: ``Σ N_j (n_j + μ t_j)·x' = a P_l φ'`` with the slopes x', φ' of the free tip.

    ``n`` is the outward normal, ``t`` the same turned by +90°, ``P_l`` the tension since the onset of the contact. For
    a wall with normal (−1, 0) this is eq. 11. Several obstacles share one unknown in proportion to their multipliers.

    Attributes:
        friction: Ratio μ of tangential to normal force, found from one experiment (:meth:`calibrated`).
    """

    friction: float = 0.0

    def estimate(self, equilibrium: Equilibrium, onset: Onset) -> np.ndarray:
        """Estimated contact force, ``(m, 2)`` [N]."""
        directions = np.zeros((len(equilibrium.scene), 2))
        if onset.tension is None:
            return directions
        for obstacle, multiplier, normal in _contacts(equilibrium):
            directions[obstacle] += multiplier * (normal + self.friction * np.array([-normal[1], normal[0]]))
        slopes = tip_slopes(equilibrium.robot, equilibrium.cable_mm)
        work = float((directions @ slopes[:2]).sum())
        load = equilibrium.robot.offset_mm * (equilibrium.tension - onset.tension) * slopes[2]
        return directions * (load / work) if work < 0 else np.zeros_like(directions)

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


def tip_slopes(robot: Robot, cable_mm: float) -> np.ndarray:
    """Exact slopes of the free tip pose (x, y, φ) in the cable displacement (eq. 7), ``(3,)`` [mm, mm, rad per mm]."""
    angle = free_angle(robot, cable_mm)
    turn = _turn(robot, cable_mm)
    middles = np.arange(robot.segments) + 0.5
    along = robot.segment_mm * middles * turn
    return np.array(
        [
            (along * np.cos(middles * angle)).sum(),
            -(along * np.sin(middles * angle)).sum(),
            -robot.segments * turn,
        ]
    )


def fitted_slopes(robot: Robot, low_mm: float, high_mm: float) -> np.ndarray:
    """Slopes of straight lines fitted to the free tip pose over a range of cable displacement (Fig. 7), as above.

    Raises:
        ValueError: If the range is empty or outside the robot's.
    """
    if not 0 <= low_mm < high_mm <= robot.cable_limit_mm:
        raise ValueError(f"range is {low_mm} to {high_mm}; it must grow within 0 to {robot.cable_limit_mm:.6g} mm")
    cables = np.linspace(low_mm, high_mm, 101)
    tips = np.array([free_nodes(robot, cable)[-1] for cable in cables])
    return np.asarray(np.polyfit(cables, tips, 1)[0])


def free_angle(robot: Robot, cable_mm: float) -> float:
    """Angle between consecutive disks of the free robot, whose shear vanishes [rad]."""
    return float(2 * np.arcsin(cable_mm / (2 * robot.segments * robot.offset_mm)))


def free_nodes(robot: Robot, cable_mm: float) -> np.ndarray:
    """Node poses of the free robot, ``(n+1, 3)`` [mm, mm, rad]."""
    angle = free_angle(robot, cable_mm)
    nodes = np.zeros((robot.segments + 1, 3))
    middles = (np.arange(robot.segments) + 0.5) * angle
    nodes[1:, 0] = robot.segment_mm * np.cumsum(np.sin(middles))
    nodes[1:, 1] = robot.segment_mm * np.cumsum(np.cos(middles))
    nodes[:, 2] = -angle * np.arange(robot.segments + 1)
    return nodes


def free_tension(robot: Robot, cable_mm: float) -> float:
    """Cable tension of the free robot, ``B dJ/dl`` [N]."""
    return 2 * robot.stiffness * robot.segments * free_angle(robot, cable_mm) * _turn(robot, cable_mm)


def clearance(robot: Robot, scene: Scene, cable_mm: float) -> float:
    """Smallest gap of the free robot at a cable displacement [mm]; negative where it would be in contact."""
    nodes = free_nodes(robot, cable_mm)
    points = touching_points(robot, nodes)
    touchable = touchable_points(robot, scene)
    gaps = [obstacle.gap(points)[touched].min() for obstacle, touched in zip(scene, touchable, strict=True)]
    return float(min(gaps, default=np.inf))


def _turn(robot: Robot, cable_mm: float) -> float:
    """Slope of :func:`free_angle` in the cable displacement [rad/mm]."""
    return float(1 / np.sqrt((robot.segments * robot.offset_mm) ** 2 - cable_mm**2 / 4))


def _first_touch(robot: Robot, scene: Scene, clear: float, touching: float) -> float:
    """Cable displacement where the free robot first touches, between a clear one and one in contact [mm]."""
    if clearance(robot, scene, touching) >= 0:
        return touching
    for _ in range(20):
        middle = (clear + touching) / 2
        clear, touching = (middle, touching) if clearance(robot, scene, middle) > 0 else (clear, middle)
    return touching


def _contacts(equilibrium: Equilibrium) -> list[tuple[int, float, np.ndarray]]:
    """(obstacle, multiplier, outward normal) of every contact."""
    multipliers = equilibrium.multipliers
    found = multipliers.nonzero()
    if not found[0].size:
        return []
    points, obstacles = equilibrium.points, equilibrium.scene.obstacles
    return [
        (j, float(multipliers[j, line, position]), obstacles[j].normal_at(points[line, position]))
        for j, line, position in zip(*(index.tolist() for index in found), strict=True)
    ]
