"""How an equilibrium changes with the cable, the length of the robot and its obstacles.

The implicit function theorem at the active set: one factorisation of the optimality conditions of eq. 5, whose
derivatives :mod:`solver.formulation` gives, and one back-substitution a parameter.
"""

from dataclasses import dataclass

import numpy as np

from solver.equilibrium import Equilibrium
from solver.formulation import kkt_derivatives


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
    """Rows of a :class:`Sensitivity` that belong to an obstacle: x, y, turn, radius."""
    return slice(2 + 4 * obstacle, 6 + 4 * obstacle)


def sensitivity(equilibrium: Equilibrium, active: np.ndarray | None = None) -> Sensitivity:
    """Differentiate an equilibrium with respect to every parameter.

    Args:
        equilibrium: A stable equilibrium; with a uniform cable, some of it pulled, as a slack robot's shear is not
            determined.
        active: Which contacts stay closed, ``(m, p, k)`` bool; ``None`` for those with a positive multiplier. Adding
            one that only just touches gives the derivative on the side where it is pressed.

    Raises:
        ValueError: If a uniform cable is not pulled, or ``active`` has the wrong shape.
    """
    robot, scene = equilibrium.robot, equilibrium.scene
    sliding = robot.cable == "sliding"
    if not sliding and not equilibrium.cable_mm > 0:
        raise ValueError(f"cable_mm is {equilibrium.cable_mm}; it must be positive, for the shear to be determined")
    active = equilibrium.contact if active is None else active
    if active.shape != equilibrium.contact.shape:
        raise ValueError(
            f"active has shape {active.shape}; it must have that of the multipliers, {equilibrium.contact.shape}"
        )
    conditions, varied, loads, load_slopes = _derivatives(equilibrium)
    taut = [equilibrium.tension > 0] if sliding else []
    unknowns = conditions.shape[1]
    equations = unknowns + 3 * robot.segments
    kept = np.concatenate([np.ones(equations, bool), taut, active[:, :, 1:].ravel()]).astype(bool)
    slopes, varied = conditions[kept], varied[kept]
    count = len(slopes)
    kkt = np.zeros((count, count))
    kkt[:, :unknowns] = slopes
    kkt[:unknowns, unknowns:] = -slopes[unknowns:].T
    change = np.linalg.solve(kkt, -varied)
    # The loads are L_v, so their slopes in (z, ν, λ) are those of (L_z, −equalities, −gaps) in v.
    signed = varied.copy()
    signed[unknowns:] *= -1
    load_changes = (signed.T @ change + load_slopes).T
    load_changes[LENGTH] -= loads / equilibrium.length_mm  # of the stiffness, EI·n / 2 L0
    _turn_about_centres(equilibrium, change.T, load_changes)

    multipliers = np.zeros((len(loads), *active.shape))
    inner = np.zeros((len(loads), active[:, :, 1:].size))
    inner[:, active[:, :, 1:].ravel()] = change[equations + sum(taut) :].T
    multipliers[:, :, :, 1:] = inner.reshape(multipliers[:, :, :, 1:].shape)
    forces = load_changes[:, 2:].reshape(len(loads), len(scene), 4)[:, :, :2]
    displacements = np.zeros_like(forces)
    displacements[:, list(scene.mounted)] = change[4 * robot.segments : unknowns].T.reshape(len(loads), -1, 2)
    return Sensitivity(
        nodes=_node_slopes(equilibrium, change[: 4 * robot.segments].T),
        multipliers=multipliers,
        tension=equilibrium.stiffness * load_changes[:, CABLE],
        forces=equilibrium.stiffness * forces,
        displacements=displacements,
    )


def _derivatives(equilibrium: Equilibrium) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """``F_z, F_v, L_v, L_vv`` of :func:`solver.formulation.kkt_derivatives` at an equilibrium."""
    function = kkt_derivatives(equilibrium.robot, equilibrium.scene.laws, equilibrium.scene.mounted)
    values = function(*equilibrium.node_solution())
    conditions, varied, loads, load_slopes = (value.full() for value in values)
    return conditions, varied, loads.ravel(), load_slopes


def _turn_about_centres(equilibrium: Equilibrium, *rows: np.ndarray) -> None:
    """Make turns about the origin turns about each obstacle's centre, in place: they differ by a shift."""
    for j, obstacle in enumerate(equilibrium.scene):
        x, y = obstacle.extent.center
        for slopes in rows:
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
