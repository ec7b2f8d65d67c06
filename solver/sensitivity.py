"""How an equilibrium changes with the cable, the length of the robot and its obstacles.

The implicit function theorem at the active set: one factorisation of the optimality conditions of eq. 5, whose
derivatives :mod:`solver.formulation` gives, and one back-substitution a parameter.
"""

from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np

from solver.equilibrium import BaseEquilibrium, Equilibrium
from solver.formulation import kkt_derivatives, limits
from solver.scene import MAX_OBSTACLES
from solver.validation import instance, shown, whole


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

    nodes: np.ndarray
    multipliers: np.ndarray
    tension: np.ndarray
    forces: np.ndarray
    displacements: np.ndarray


CABLE, LENGTH = 0, 1  # rows of a Sensitivity


def obstacle_rows(obstacle: int) -> slice:
    """Rows of a :class:`Sensitivity` that belong to an obstacle: x, y, turn, radius.

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
    load_changes[LENGTH] -= change.load / equilibrium.length_mm  # of the energy scale, EI·n / 2 L0
    for rows in (change.unknowns, change.multipliers, load_changes):
        _turn_about_centres(equilibrium, rows)
    forces = load_changes[:, 2:].reshape(len(load_changes), len(scene), 4)[:, :, :2]
    displacements = np.zeros_like(forces)
    mounts = change.unknowns[:, 4 * robot.segments :]
    displacements[:, list(scene.mounted)] = mounts.reshape(len(mounts), -1, 2)
    return Sensitivity(
        nodes=_node_slopes(equilibrium, change.unknowns[:, : 4 * robot.segments]),
        multipliers=change.multipliers,
        tension=equilibrium.energy_scale * load_changes[:, CABLE],
        forces=equilibrium.energy_scale * forces,
        displacements=displacements,
    )


class Response(NamedTuple):
    """How a solution of a node-coordinate problem changes with what it is told, along the first axis of each array.

    Attributes:
        unknowns: Slopes of the unknowns, ``(q, z)``.
        multipliers: Slopes of the multipliers of the contacts, ``(q, m, p, k)``.
        loads: Slopes of the loads ``L_v``, ``(q, q)``.
        load: The loads themselves, ``(q,)``.
    """

    unknowns: np.ndarray
    multipliers: np.ndarray
    loads: np.ndarray
    load: np.ndarray


def respond(equilibrium: BaseEquilibrium, kkt: ca.Function, active: np.ndarray | None, held: list[bool]) -> Response:
    """Solve the linearised optimality conditions for a change of everything that the problem is told.

    Args:
        equilibrium: Where.
        kkt: :func:`~solver.formulation.second_derivatives` of its node-coordinate problem.
        active: Which contacts stay closed, ``(m, p, k)`` bool; ``None`` for those with a positive multiplier.
        held: Which of the inequalities before the contacts stay closed.

    Raises:
        ValueError: If ``active`` has the wrong shape, or contacts that cannot all be closed at once.
    """
    active = equilibrium.contact if active is None else active
    if not (isinstance(active, np.ndarray) and active.dtype == bool and active.shape == equilibrium.contact.shape):
        has = f"has shape {active.shape} of {active.dtype}" if isinstance(active, np.ndarray) else f"is {shown(active)}"
        raise ValueError(
            f"active {has}; it must be an array of bool, shaped as the multipliers, {equilibrium.contact.shape}"
        )
    if (active & ~np.isfinite(equilibrium.gaps)).any():
        raise ValueError("active has contacts of points that cannot touch the obstacle; close others")
    touching = active[:, :, 1:].ravel()
    conditions, varied, loads, load_slopes = (value.full() for value in kkt(*equilibrium.node_solution()))
    unknowns = conditions.shape[1]
    equations = len(conditions) - len(held) - touching.size
    kept = np.concatenate([np.ones(equations, bool), held, touching]).astype(bool)
    slopes, varied = conditions[kept], varied[kept]
    count = len(slopes)
    matrix = np.zeros((count, count))
    matrix[:, :unknowns] = slopes
    matrix[:unknowns, unknowns:] = -slopes[unknowns:].T
    try:
        change = np.linalg.solve(matrix, -varied)
    except np.linalg.LinAlgError as error:
        raise ValueError(f"active has {touching.sum()} contacts that depend on each other; close fewer") from error
    # The loads are L_v, so their slopes in (z, ν, λ) are those of (L_z, −equalities, −gaps) in v.
    signed = varied.copy()
    signed[unknowns:] *= -1
    multipliers = np.zeros((change.shape[1], *active.shape))
    inner = np.zeros((change.shape[1], touching.size))
    inner[:, touching] = change[equations + sum(held) :].T
    multipliers[:, :, :, 1:] = inner.reshape(multipliers[:, :, :, 1:].shape)
    return Response(change[:unknowns].T.copy(), multipliers, (signed.T @ change + load_slopes).T, loads.ravel())


def _turn_about_centres(equilibrium: Equilibrium, slopes: np.ndarray) -> None:
    """Make turns about the origin turns about each obstacle's centre, in place: they differ by a shift."""
    for j, obstacle in enumerate(equilibrium.scene):
        x, y = obstacle.extent.center
        shift_x, shift_y, turn, _ = slopes[obstacle_rows(j)]
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
