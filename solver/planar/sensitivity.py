"""Derivatives of an equilibrium in the cable displacements, the robot's length and its obstacles.

They follow from the implicit function theorem at the active set: one factorisation of the optimality conditions, and
one back-substitution for each parameter. The kernel does so in its own coordinates. :func:`dense_sensitivity` does so
with the conditions of eq. 5 in node coordinates, whose derivatives are those of :mod:`solver.planar.formulation`: it
shares nothing with the kernel and checks it.
"""

from dataclasses import dataclass

import numpy as np

from solver import _kernel
from solver.common.implicit import ParameterRows, respond
from solver.common.scene import Scene
from solver.common.slopes import KernelSlopes
from solver.common.validation import check_instance
from solver.planar.equilibrium import Equilibrium
from solver.planar.formulation import MOTIONS, kkt_derivatives, robot_inequality_count
from solver.planar.layout import layout
from solver.planar.robot import Robot
from solver.planar.solve import kernel_robot, kernel_scene


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """Derivatives of an equilibrium, with the parameters along the first axis.

    The parameters are the displacement of each cable [mm], the length of the backbone [mm], then for every obstacle its
    shift in x and y [mm], its turn about its centre [rad] and the growth of its radius [mm]; q = c + 1 + 4m in all,
    see :meth:`rows`. The length stretches all segments alike, whose weight grows with it. Where a contact is about to
    open or close, or a cable to slacken, the derivatives are one-sided: those for an unchanged active set.

    Attributes:
        nodes: Slopes of the node poses, ``(q, n+1, 3)``.
        multipliers: Slopes of the multipliers, ``(q, m, p, k)`` [rad²/mm per unit]; zero where nothing touches.
        tensions: Slopes of the cable tensions, ``(q, c)`` [N per unit]; zero for a slack cable.
        forces: Slopes of the force of each obstacle on the robot, ``(q, m, 2)`` [N per unit].
        displacements: Slopes of the displacement of each obstacle on a spring, ``(q, m, 2)`` [mm per unit].
    """

    nodes: np.ndarray
    multipliers: np.ndarray
    tensions: np.ndarray
    forces: np.ndarray
    displacements: np.ndarray

    @property
    def tension(self) -> np.ndarray:
        """Slopes of the tension of the first cable, ``(q,)`` [N per unit]."""
        return np.asarray(self.tensions[:, 0])

    @staticmethod
    def rows(robot: Robot) -> ParameterRows:
        """Return where each parameter of a robot stands along the first axis."""
        check_instance("robot", robot, Robot, "for one in space call SpatialSensitivity.rows")
        return ParameterRows(len(robot.cables), MOTIONS)


def sensitivity(equilibrium: Equilibrium, active: np.ndarray | None = None) -> Sensitivity:
    """Differentiate an equilibrium with respect to every parameter.

    Args:
        equilibrium: A stable equilibrium. In the paper's model the cable must be pulled, as the shear of a slack robot
            is undetermined.
        active: Which contacts stay closed, ``(m, p, k)`` bool; ``None`` for those with a positive multiplier. Adding
            one that only just touches gives the derivative on the side where it is pressed. Of contacts by default that
            depend on each other, such as three of a link that lies flush on a side, those that the others imply keep
            their multipliers.

    Raises:
        ValueError: If the cable of the paper's model is not pulled, or ``active`` has the wrong shape, or contacts that
            cannot all be closed at once.
        TypeError: If ``equilibrium`` is not one of the plane.
    """
    check_instance("equilibrium", equilibrium, Equilibrium, "for one in space call solver.spatial.spatial_sensitivity")
    if equilibrium.robot.model == "paper" and not equilibrium.cable_mm > 0:
        raise ValueError(f"cable_mm is {equilibrium.cable_mm}; it must be positive, for the shear to be determined")
    slopes = _kernel_slopes(equilibrium, active)
    return dense_sensitivity(equilibrium, active) if slopes is None else Sensitivity(*slopes)


def _make_kernel(robot: Robot, scene: Scene) -> _kernel.Kernel:
    return _kernel.Kernel(kernel_robot(robot), kernel_scene(robot, scene))


_kernel_slopes = KernelSlopes(_make_kernel, layout)


def dense_sensitivity(equilibrium: Equilibrium, active: np.ndarray | None = None) -> Sensitivity:
    """Differentiate as :func:`sensitivity`, by the dense optimality conditions in node coordinates.

    They have no contacts of the clamped base, which matters where an obstacle on a spring rests on it.

    Raises:
        ValueError: If ``active`` has the wrong shape, or contacts that cannot all be closed at once.
    """
    robot, scene = equilibrium.robot, equilibrium.scene
    rows, kkt = Sensitivity.rows(robot), kkt_derivatives(robot, scene.laws, scene.mounted)
    closed = equilibrium.inequality_multipliers[: robot_inequality_count(robot)] > 0  # taut cables, disks that meet
    change = respond(equilibrium, kkt, active, closed.tolist())
    load_changes = change.loads
    load_changes[rows.length] -= change.load / equilibrium.length_mm  # of the energy scale, EI·n / 2 L0
    _turn_about_centres(equilibrium, rows, change.unknowns, change.multipliers, load_changes)
    forces = load_changes[:, rows.length + 1 :].reshape(len(load_changes), len(scene), MOTIONS)[:, :, :2]
    displacements = np.zeros_like(forces)
    mounts = change.unknowns[:, 4 * robot.segments :]
    displacements[:, list(scene.mounted)] = mounts.reshape(len(mounts), -1, 2)
    return Sensitivity(
        nodes=_node_slopes(equilibrium, change.unknowns[:, : 4 * robot.segments]),
        multipliers=change.multipliers,
        tensions=equilibrium.energy_scale * load_changes[:, rows.cables],
        forces=equilibrium.energy_scale * forces,
        displacements=displacements,
    )


def _turn_about_centres(equilibrium: Equilibrium, parameters: ParameterRows, *slopes: np.ndarray) -> None:
    """Convert turns about the origin to turns about each obstacle's centre, in place: they differ by a shift."""
    for rows in slopes:
        for j, obstacle in enumerate(equilibrium.scene):
            x, y = obstacle.extent.center
            shift_x, shift_y, turn, _ = rows[parameters.obstacle(j)]
            turn += y * shift_x - x * shift_y


def _node_slopes(equilibrium: Equilibrium, change: np.ndarray) -> np.ndarray:
    """Return the slopes of the node poses from those of backbone and cable points, ``(q, n+1, 3)``."""
    robot = equilibrium.robot
    points = change.reshape(len(change), 2, robot.segments, 2)
    angles = equilibrium.nodes[1:, 2]
    disk_change = points[:, 1] - points[:, 0]
    nodes = np.zeros((len(change), robot.segments + 1, 3))
    nodes[:, 1:, :2] = points[:, 0]
    turned = np.cos(angles) * disk_change[:, :, 1] - np.sin(angles) * disk_change[:, :, 0]
    nodes[:, 1:, 2] = turned / robot.offset_mm
    return nodes
