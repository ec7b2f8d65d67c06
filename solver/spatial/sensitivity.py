"""Derivatives of an equilibrium in space in the cable displacements, the robot's length and its obstacles.

They follow from the implicit function theorem at the active set of eq. 13 or of the rod's problem, as in the plane:
from the kernel, and for comparison from the dense optimality conditions in node coordinates.
"""

from dataclasses import dataclass

import numpy as np

from solver import _kernel
from solver.common.implicit import ParameterRows, respond
from solver.common.scene import Scene
from solver.common.slopes import KernelSlopes
from solver.common.validation import check_instance
from solver.spatial.equilibrium import SpatialEquilibrium, spatial_layout
from solver.spatial.formulation import kkt_derivatives
from solver.spatial.obstacle_terms import MOTIONS
from solver.spatial.robot import SpatialRobot, sides
from solver.spatial.rod_formulation import rod_inequality_count
from solver.spatial.solve import kernel_robot, kernel_scene


@dataclass(frozen=True, slots=True)
class SpatialSensitivity:
    """Derivatives of an equilibrium, with the parameters along the first axis.

    The parameters are the displacement of each cable, in the paper's model of both pairs of cables [mm], the length of
    the backbone [mm], then for every obstacle its shift in x, y and z [mm], its turns about the axes x, y and z through
    its centre [rad] and the growth of its radius [mm]; q = c + 1 + 7m in all, see :meth:`rows`. Where a contact is
    about to open or close, a cable to slacken, or a displacement of the paper's model is zero, the derivatives are
    one-sided: those for an unchanged active set and the same pulled cables.

    Attributes:
        nodes: Slopes of the backbone points, ``(q, n+1, 3)``.
        turns: Rotations of the disks, as turns about the axes of the base frame, ``(q, n+1, 3)`` [rad per unit].
        multipliers: Slopes of the multipliers, ``(q, m, p, k)`` [rad²/mm per unit]; zero where nothing touches.
        tensions: Slopes of the cable tensions, ``(q, c)`` [N per unit]; zero for a slack cable.
        forces: Slopes of the force of each obstacle on the robot, ``(q, m, 3)`` [N per unit].
        displacements: Slopes of the displacement of each obstacle on a spring, ``(q, m, 3)`` [mm per unit].
    """

    nodes: np.ndarray
    turns: np.ndarray
    multipliers: np.ndarray
    tensions: np.ndarray
    forces: np.ndarray
    displacements: np.ndarray

    @staticmethod
    def rows(robot: SpatialRobot) -> ParameterRows:
        """Return where each parameter of a robot stands along the first axis."""
        check_instance("robot", robot, SpatialRobot, "for one of the plane call solver.Sensitivity.rows")
        return ParameterRows(len(robot.cables), MOTIONS)


def spatial_sensitivity(equilibrium: SpatialEquilibrium, active: np.ndarray | None = None) -> SpatialSensitivity:
    """Differentiate an equilibrium with respect to every parameter.

    Args:
        equilibrium: A stable equilibrium, in the paper's model with a pulled cable, as the shear of a slack robot is
            undetermined.
        active: Which contacts stay closed, ``(m, p, k)`` bool; ``None`` for those with a positive multiplier, as in
            the plane.

    Raises:
        ValueError: If no cable of the paper's model is pulled, or ``active`` has the wrong shape, or contacts that
            cannot all be closed at once.
        TypeError: If ``equilibrium`` is not one in space.
    """
    check_instance("equilibrium", equilibrium, SpatialEquilibrium, "take one of a solver in space")
    if equilibrium.robot.model == "paper" and not equilibrium.cables_mm.any():
        raise ValueError("cables_mm is (0, 0); one must be pulled, for the shear to be determined")
    slopes = _kernel_slopes(equilibrium, active)
    return dense_spatial_sensitivity(equilibrium, active) if slopes is None else SpatialSensitivity(*slopes)


def _make_kernel(robot: SpatialRobot, scene: Scene) -> _kernel.SpatialKernel:
    return _kernel.SpatialKernel(kernel_robot(robot), kernel_scene(robot, scene))


_kernel_slopes = KernelSlopes(_make_kernel, spatial_layout)


def dense_spatial_sensitivity(equilibrium: SpatialEquilibrium, active: np.ndarray | None = None) -> SpatialSensitivity:
    """Differentiate as :func:`spatial_sensitivity`, by the dense optimality conditions in node coordinates.

    They have no contacts of the clamped base, which matters where an obstacle on a spring rests on it.

    Raises:
        ValueError: If ``active`` has the wrong shape, or contacts that cannot all be closed at once.
    """
    robot, scene = equilibrium.robot, equilibrium.scene
    rows, closed = SpatialSensitivity.rows(robot), equilibrium.inequality_multipliers[: rod_inequality_count(robot)] > 0
    change = respond(equilibrium, kkt_derivatives(robot, scene.laws, scene.mounted), active, closed.tolist())
    loads = change.loads
    loads[rows.length] -= change.load / equilibrium.length_mm  # of the energy scale, EI·n / 2 L0
    _turn_about_centres(equilibrium, rows, change.unknowns, change.multipliers, loads)
    forces = loads[:, rows.length + 1 :].reshape(len(loads), len(scene), MOTIONS)[:, :, :3]
    displacements = np.zeros_like(forces)
    mounts = change.unknowns[:, change.unknowns.shape[1] - 3 * sum(scene.mounted) :]
    displacements[:, list(scene.mounted)] = mounts.reshape(len(loads), -1, 3)
    nodes = np.zeros((3, len(loads), robot.segments + 1, 3))  # of backbone and two points of each disk
    lines = change.unknowns[:, : 9 * robot.segments].reshape(len(loads), 3, robot.segments, 3)
    nodes[:, :, 1:] = np.swapaxes(lines, 0, 1)
    pulled = sides(equilibrium.cables_mm) if robot.model == "paper" else np.ones(len(robot.cables))
    return SpatialSensitivity(
        nodes=nodes[0],
        turns=_turns(equilibrium, nodes[1:] - nodes[0]),
        multipliers=change.multipliers,
        tensions=equilibrium.energy_scale * pulled * loads[:, rows.cables],
        forces=equilibrium.energy_scale * forces,
        displacements=displacements,
    )


def _turn_about_centres(equilibrium: SpatialEquilibrium, parameters: ParameterRows, *slopes: np.ndarray) -> None:
    """Convert turns about the origin to turns about each obstacle's centre, in place: they differ by a shift."""
    for rows in slopes:
        for j, obstacle in enumerate(equilibrium.scene):
            shifts, turns = np.split(rows[parameters.obstacle(j)][:6], 2)
            turns += np.tensordot(-np.cross(np.eye(3), obstacle.extent.center), shifts, axes=1)


def _turns(equilibrium: SpatialEquilibrium, disks: np.ndarray) -> np.ndarray:
    """Return the turns of the disks from the motion of two of their points, ``(q, n+1, 3)``: half the sum of e × δe."""
    first, second = np.tensordot(np.linalg.inv(_disk_points(equilibrium)), disks, axes=1)
    x, y, z = np.moveaxis(equilibrium.frames, 2, 0)
    third = np.cross(first, y) + np.cross(x, second)
    return np.asarray((np.cross(x, first) + np.cross(y, second) + np.cross(z, third)) / 2)


def _disk_points(equilibrium: SpatialEquilibrium) -> np.ndarray:
    """Return the points of a disk whose motion is an unknown, ``(2, 2)`` [mm]: pulled holes, or edges of a rod."""
    robot = equilibrium.robot
    if robot.model == "rod":
        return np.asarray(robot.offset_mm * np.eye(2))
    return np.asarray(sides(equilibrium.cables_mm)[:, None] * robot.holes[:, :2])
