"""How an equilibrium changes with the cable, the length of the robot and its obstacles.

The implicit function theorem at the active set: one factorisation of the optimality conditions of eq. 5, whose
derivatives :mod:`solver.planar.formulation` gives, and one back-substitution a parameter.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solver.common.implicit import respond
from solver.common.scene import MAX_OBSTACLES
from solver.common.validation import instance, whole
from solver.planar.equilibrium import Equilibrium
from solver.planar.formulation import kkt_derivatives, limits


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """Derivatives of an equilibrium, the parameters along the first axis.

    The parameters are the cable displacement [mm], the length of the backbone [mm], then of every obstacle its shift in
    x and y [mm], its turn about its centre [rad] and the growth of its radius [mm]; q = 2 + 4m in all. The length
    stretches all segments alike. Where a contact is about to open or close, the derivatives are those of the side on
    which the active set stays as it is.

    Attributes:
        nodes: Of the node poses, ``(q, n+1, 3)``.
        multipliers: Of the multipliers, ``(q, m, p, k)`` [rad²/mm per unit]; zero where nothing touches.
        tension: Of the cable tension, ``(q,)`` [N per unit].
        forces: Of the force of each obstacle on the robot, ``(q, m, 2)`` [N per unit].
        displacements: Of how far each obstacle has been pushed, ``(q, m, 2)`` [mm per unit].
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
        """Return the rows that belong to an obstacle: x, y, turn, radius.

        Raises:
            ValueError: If it is not the index of an obstacle.
        """
        obstacle = whole("obstacle", obstacle, 0, MAX_OBSTACLES - 1)
        return slice(2 + 4 * obstacle, 6 + 4 * obstacle)


def sensitivity(equilibrium: Equilibrium, active: np.ndarray | None = None) -> Sensitivity:
    """Differentiate an equilibrium with respect to every parameter.

    Args:
        equilibrium: A stable equilibrium; with a uniform cable, some of it pulled, as a slack robot's shear is not
            determined.
        active: Which contacts stay closed, ``(m, p, k)`` bool; ``None`` for those with a positive multiplier. Adding
            one that only just touches gives the derivative on the side where it is pressed.

    Raises:
        ValueError: If a uniform cable is not pulled, or ``active`` has the wrong shape, or contacts that cannot all be
            closed at once.
        TypeError: If ``equilibrium`` is something else.
    """
    instance("equilibrium", equilibrium, Equilibrium, "take one of a solver of the plane")
    robot, scene = equilibrium.robot, equilibrium.scene
    sliding = robot.model == "rod"
    if not sliding and not equilibrium.cable_mm > 0:
        raise ValueError(f"cable_mm is {equilibrium.cable_mm}; it must be positive, for the shear to be determined")
    kkt = kkt_derivatives(robot, scene.laws, scene.mounted)
    held = equilibrium.inequality_multipliers[: limits(robot)] > 0  # a taut cable, and disks that meet
    change = respond(equilibrium, kkt, active, held.tolist())
    load_changes = change.loads
    load_changes[Sensitivity.LENGTH] -= change.load / equilibrium.length_mm  # of the energy scale, EI·n / 2 L0
    for rows in (change.unknowns, change.multipliers, load_changes):
        _turn_about_centres(equilibrium, rows)
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


def _turn_about_centres(equilibrium: Equilibrium, slopes: np.ndarray) -> None:
    """Make turns about the origin turns about each obstacle's centre, in place: they differ by a shift."""
    for j, obstacle in enumerate(equilibrium.scene):
        x, y = obstacle.extent.center
        shift_x, shift_y, turn, _ = slopes[Sensitivity.obstacle_rows(j)]
        turn += y * shift_x - x * shift_y


def _node_slopes(equilibrium: Equilibrium, change: np.ndarray) -> np.ndarray:
    """Slopes of the node poses from those of backbone and cable points, ``(q, n+1, 3)``."""
    robot = equilibrium.robot
    points = change.reshape(len(change), 2, robot.segments, 2)
    disk = (equilibrium.cable_nodes - equilibrium.nodes[:, :2])[1:]
    disk_change = points[:, 1] - points[:, 0]
    nodes = np.zeros((len(change), robot.segments + 1, 3))
    nodes[:, 1:, :2] = points[:, 0]
    nodes[:, 1:, 2] = (disk[:, 0] * disk_change[:, :, 1] - disk[:, 1] * disk_change[:, :, 0]) / robot.offset_mm**2
    return nodes
