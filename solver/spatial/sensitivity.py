"""Derivatives of an equilibrium in space in the cable displacements, the robot's length and its obstacles.

They follow from the implicit function theorem at the active set of eq. 13, as in the plane.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solver.common.implicit import respond
from solver.common.scene import MAX_OBSTACLES
from solver.common.validation import check_instance, check_whole
from solver.spatial.equilibrium import SpatialEquilibrium
from solver.spatial.formulation import kkt_derivatives
from solver.spatial.obstacle_terms import MOTIONS
from solver.spatial.robot import sides


@dataclass(frozen=True, slots=True)
class SpatialSensitivity:
    """Derivatives of an equilibrium, with the parameters along the first axis.

    The parameters are the displacements of both pairs of cables [mm], the length of the backbone [mm], then for every
    obstacle its shift in x, y and z [mm], its turns about the axes x, y and z through its centre [rad] and the growth
    of its radius [mm]; q = 3 + 7m in all. Where a contact is about to open or close, or a displacement is zero, the
    derivatives are one-sided: those for an unchanged active set and the same pulled cables.

    Attributes:
        nodes: Slopes of the backbone points, ``(q, n+1, 3)``.
        turns: Rotations of the disks, as turns about the axes of the base frame, ``(q, n+1, 3)`` [rad per unit].
        multipliers: Slopes of the multipliers, ``(q, m, p, k)`` [rad²/mm per unit]; zero where nothing touches.
        tensions: Slopes of the cable tensions, ``(q, 2)`` [N per unit].
        forces: Slopes of the force of each obstacle on the robot, ``(q, m, 3)`` [N per unit].
        displacements: Slopes of the displacement of each obstacle on a spring, ``(q, m, 3)`` [mm per unit].
    """

    CABLES: ClassVar[slice] = slice(0, 2)
    LENGTH: ClassVar[int] = 2

    nodes: np.ndarray
    turns: np.ndarray
    multipliers: np.ndarray
    tensions: np.ndarray
    forces: np.ndarray
    displacements: np.ndarray

    @staticmethod
    def obstacle_rows(obstacle: int) -> slice:
        """Return the rows of an obstacle: three shifts, three turns, radius.

        Raises:
            ValueError: If it is not the index of an obstacle.
        """
        obstacle = check_whole("obstacle", obstacle, 0, MAX_OBSTACLES - 1)
        return slice(3 + MOTIONS * obstacle, 3 + MOTIONS * (obstacle + 1))


def spatial_sensitivity(equilibrium: SpatialEquilibrium, active: np.ndarray | None = None) -> SpatialSensitivity:
    """Differentiate an equilibrium with respect to every parameter.

    Args:
        equilibrium: A stable equilibrium with a pulled cable, as the shear of a slack robot is undetermined.
        active: Which contacts stay closed, ``(m, p, k)`` bool; ``None`` for those with a positive multiplier.

    Raises:
        ValueError: If no cable is pulled, or ``active`` has the wrong shape, or contacts that cannot all be closed at
            once.
        TypeError: If ``equilibrium`` is not one in space.
    """
    check_instance("equilibrium", equilibrium, SpatialEquilibrium, "take one of a solver in space")
    robot, scene = equilibrium.robot, equilibrium.scene
    if not equilibrium.cables_mm.any():
        raise ValueError("cables_mm is (0, 0); one must be pulled, for the shear to be determined")
    change = respond(equilibrium, kkt_derivatives(robot, scene.laws, scene.mounted), active, [])
    loads = change.loads
    loads[SpatialSensitivity.LENGTH] -= change.load / equilibrium.length_mm  # of the energy scale, EI·n / 2 L0
    _turn_about_centres(equilibrium, change.unknowns, change.multipliers, loads)
    forces = loads[:, 3:].reshape(len(loads), len(scene), MOTIONS)[:, :, :3]
    displacements = np.zeros_like(forces)
    lines, mounts = np.split(change.unknowns, [9 * robot.segments], axis=1)
    displacements[:, list(scene.mounted)] = mounts.reshape(len(loads), -1, 3)
    nodes = np.zeros((3, len(loads), robot.segments + 1, 3))  # of backbone and holes
    nodes[:, :, 1:] = np.swapaxes(lines.reshape(len(loads), 3, robot.segments, 3), 0, 1)
    pulled = sides(equilibrium.cables_mm)
    return SpatialSensitivity(
        nodes=nodes[0],
        turns=_turns(equilibrium, nodes[1:] - nodes[0], pulled),
        multipliers=change.multipliers,
        tensions=equilibrium.energy_scale * pulled * loads[:, SpatialSensitivity.CABLES],
        forces=equilibrium.energy_scale * forces,
        displacements=displacements,
    )


def _turn_about_centres(equilibrium: SpatialEquilibrium, *slopes: np.ndarray) -> None:
    """Convert turns about the origin to turns about each obstacle's centre, in place: they differ by a shift."""
    for rows in slopes:
        for j, obstacle in enumerate(equilibrium.scene):
            shifts, turns = np.split(rows[SpatialSensitivity.obstacle_rows(j)][:6], 2)
            turns += np.tensordot(-np.cross(np.eye(3), obstacle.extent.center), shifts, axes=1)


def _turns(equilibrium: SpatialEquilibrium, disks: np.ndarray, pulled: np.ndarray) -> np.ndarray:
    """Return the turns of the disks from the motion of their holes, ``(q, n+1, 3)``: half the sum of e × δe."""
    holes = pulled[:, None] * equilibrium.robot.holes[:, :2]
    first, second = np.tensordot(np.linalg.inv(holes), disks, axes=1)
    x, y, z = np.moveaxis(equilibrium.frames, 2, 0)
    third = np.cross(first, y) + np.cross(x, second)
    return np.asarray((np.cross(x, first) + np.cross(y, second) + np.cross(z, third)) / 2)
