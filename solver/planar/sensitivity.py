"""Derivatives of an equilibrium in the cable displacement, the robot's length and its obstacles.

They follow from the implicit function theorem at the active set: one factorisation of the optimality conditions of
eq. 5, whose derivatives are those of :mod:`solver.planar.formulation`, and one back-substitution for each parameter.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solver.common.implicit import respond
from solver.common.scene import MAX_OBSTACLES
from solver.common.validation import check_instance, check_whole
from solver.planar.equilibrium import Equilibrium
from solver.planar.formulation import kkt_derivatives, robot_inequality_count


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """Derivatives of an equilibrium, with the parameters along the first axis.

    The parameters are the cable displacement [mm], the length of the backbone [mm], then for every obstacle its shift
    in x and y [mm], its turn about its centre [rad] and the growth of its radius [mm]; q = 2 + 4m in all. The length
    stretches all segments alike. Where a contact is about to open or close, the derivatives are one-sided: those for
    an unchanged active set.

    Attributes:
        nodes: Slopes of the node poses, ``(q, n+1, 3)``.
        multipliers: Slopes of the multipliers, ``(q, m, p, k)`` [rad²/mm per unit]; zero where nothing touches.
        tension: Slopes of the cable tension, ``(q,)`` [N per unit].
        forces: Slopes of the force of each obstacle on the robot, ``(q, m, 2)`` [N per unit].
        displacements: Slopes of the displacement of each obstacle on a spring, ``(q, m, 2)`` [mm per unit].
    """

    CABLE: ClassVar[int] = 0
    LENGTH: ClassVar[int] = 1

    nodes: np.ndarray
    multipliers: np.ndarray
    tension: np.ndarray
    forces: np.ndarray
    displacements: np.ndarray

    @staticmethod
    def obstacle_rows(obstacle: int) -> slice:
        """Return the rows of an obstacle: x, y, turn, radius.

        Raises:
            ValueError: If it is not the index of an obstacle.
        """
        obstacle = check_whole("obstacle", obstacle, 0, MAX_OBSTACLES - 1)
        return slice(2 + 4 * obstacle, 6 + 4 * obstacle)


def sensitivity(equilibrium: Equilibrium, active: np.ndarray | None = None) -> Sensitivity:
    """Differentiate an equilibrium with respect to every parameter.

    Args:
        equilibrium: A stable equilibrium. In the paper's model the cable must be pulled, as the shear of a slack robot
            is undetermined.
        active: Which contacts stay closed, ``(m, p, k)`` bool; ``None`` for those with a positive multiplier. Adding
            one that only just touches gives the derivative on the side where it is pressed.

    Raises:
        ValueError: If the cable of the paper's model is not pulled, or ``active`` has the wrong shape, or contacts that
            cannot all be closed at once.
        TypeError: If ``equilibrium`` is not one of the plane.
    """
    check_instance("equilibrium", equilibrium, Equilibrium, "for one in space call solver.spatial.spatial_sensitivity")
    robot, scene = equilibrium.robot, equilibrium.scene
    if robot.model == "paper" and not equilibrium.cable_mm > 0:
        raise ValueError(f"cable_mm is {equilibrium.cable_mm}; it must be positive, for the shear to be determined")
    kkt = kkt_derivatives(robot, scene.laws, scene.mounted)
    closed = equilibrium.inequality_multipliers[: robot_inequality_count(robot)] > 0  # taut cable, disks that meet
    change = respond(equilibrium, kkt, active, closed.tolist())
    load_changes = change.loads
    load_changes[Sensitivity.LENGTH] -= change.load / equilibrium.length_mm  # of the energy scale, EI·n / 2 L0
    _turn_about_centres(equilibrium, change.unknowns, change.multipliers, load_changes)
    forces = load_changes[:, 2:].reshape(len(load_changes), len(scene), 4)[:, :, :2]
    displacements = np.zeros_like(forces)
    mounts = change.unknowns[:, 4 * robot.segments :]
    displacements[:, list(scene.mounted)] = mounts.reshape(len(mounts), -1, 2)
    return Sensitivity(
        nodes=_node_slopes(equilibrium, change.unknowns[:, : 4 * robot.segments]),
        multipliers=change.multipliers,
        tension=equilibrium.energy_scale * load_changes[:, Sensitivity.CABLE],
        forces=equilibrium.energy_scale * forces,
        displacements=displacements,
    )


def _turn_about_centres(equilibrium: Equilibrium, *slopes: np.ndarray) -> None:
    """Convert turns about the origin to turns about each obstacle's centre, in place: they differ by a shift."""
    for rows in slopes:
        for j, obstacle in enumerate(equilibrium.scene):
            x, y = obstacle.extent.center
            shift_x, shift_y, turn, _ = rows[Sensitivity.obstacle_rows(j)]
            turn += y * shift_x - x * shift_y


def _node_slopes(equilibrium: Equilibrium, change: np.ndarray) -> np.ndarray:
    """Return the slopes of the node poses from those of backbone and cable points, ``(q, n+1, 3)``."""
    robot = equilibrium.robot
    points = change.reshape(len(change), 2, robot.segments, 2)
    disk = (equilibrium.cable_nodes - equilibrium.nodes[:, :2])[1:]
    disk_change = points[:, 1] - points[:, 0]
    nodes = np.zeros((len(change), robot.segments + 1, 3))
    nodes[:, 1:, :2] = points[:, 0]
    nodes[:, 1:, 2] = (disk[:, 0] * disk_change[:, :, 1] - disk[:, 1] * disk_change[:, :, 0]) / robot.offset_mm**2
    return nodes
