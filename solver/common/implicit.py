"""Sensitivities of an equilibrium by the implicit function theorem at its active set."""

from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np

from solver.common.equilibrium import BaseEquilibrium
from solver.common.robot import AnyRobot
from solver.common.scene import MAX_OBSTACLES
from solver.common.signals import held_signals
from solver.common.validation import check_whole, shown


@dataclass(frozen=True, slots=True)
class ParameterRows:
    """Where each parameter stands along the first axis of a sensitivity: cables, length, then the obstacles.

    Attributes:
        cable_count: Number of cables, in the paper's model of space of pairs of them.
        motions: Number of motions of an obstacle.
    """

    cable_count: int
    motions: int

    @property
    def cables(self) -> slice:
        """Rows of the displacements of the cables."""
        return slice(0, self.cable_count)

    @property
    def length(self) -> int:
        """Row of the length of the backbone."""
        return self.cable_count

    def obstacle(self, index: int) -> slice:
        """Return the rows of an obstacle: its shift, turn and growth.

        Raises:
            ValueError: If it is not the index of an obstacle.
        """
        start = self.cable_count + 1 + self.motions * check_whole("obstacle", index, 0, MAX_OBSTACLES - 1)
        return slice(start, start + self.motions)


class Response(NamedTuple):
    """Derivatives of a solution of a node-coordinate problem in its parameters, along the first axis of each array.

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


@held_signals()
def respond(
    equilibrium: BaseEquilibrium[AnyRobot], kkt: ca.Function, active: np.ndarray | None, closed: list[bool]
) -> Response:
    """Solve the linearised optimality conditions for a change of every parameter.

    Args:
        equilibrium: Equilibrium to differentiate.
        kkt: :func:`~solver.common.node_problem.second_derivatives` of its node-coordinate problem.
        active: Which contacts stay closed, ``(m, p, k)`` bool; ``None`` for those with a positive multiplier.
        closed: Which of the inequalities before the contacts stay closed.

    Raises:
        ValueError: If ``active`` has the wrong shape, or contacts that cannot all be closed at once.
    """
    active = check_active(equilibrium, active)
    touching = active[:, :, 1:].ravel()
    conditions, varied, loads, load_slopes = (value.full() for value in kkt(*equilibrium.node_solution()))
    unknowns = conditions.shape[1]
    equations = len(conditions) - len(closed) - touching.size
    kept = np.concatenate([np.ones(equations, bool), closed, touching]).astype(bool)
    slopes, varied = conditions[kept], varied[kept]
    count = len(slopes)
    matrix = np.zeros((count, count))
    matrix[:, :unknowns] = slopes
    matrix[:unknowns, unknowns:] = -slopes[unknowns:].T
    try:
        change = _solve(matrix, -varied)
    except np.linalg.LinAlgError as error:
        raise ValueError(f"active has {touching.sum()} contacts that depend on each other; close fewer") from error
    # The loads are L_v, so their slopes in (z, ν, λ) are those of (L_z, −equalities, −gaps) in v.
    signed = varied.copy()
    signed[unknowns:] *= -1
    multipliers = np.zeros((change.shape[1], *active.shape))
    inner = np.zeros((change.shape[1], touching.size))
    inner[:, touching] = change[equations + sum(closed) :].T
    multipliers[:, :, :, 1:] = inner.reshape(multipliers[:, :, :, 1:].shape)
    return Response(change[:unknowns].T.copy(), multipliers, (signed.T @ change + load_slopes).T, loads.ravel())


def _solve(matrix: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Solve linear equations whose coefficients differ by many orders of magnitude, with two rounds of refinement."""
    solution = np.linalg.solve(matrix, sides).astype(np.longdouble)
    for _ in range(2):
        residual = sides - matrix.astype(np.longdouble) @ solution
        solution += np.linalg.solve(matrix, residual.astype(float))
    return np.asarray(solution, float)


def check_active(equilibrium: BaseEquilibrium[AnyRobot], active: np.ndarray | None) -> np.ndarray:
    """Return which contacts stay closed, by default those with a positive multiplier.

    Raises:
        ValueError: If ``active`` has the wrong shape, or contacts of points that cannot touch.
    """
    active = equilibrium.contact if active is None else active
    if not (isinstance(active, np.ndarray) and active.dtype == bool and active.shape == equilibrium.contact.shape):
        has = f"has shape {active.shape} of {active.dtype}" if isinstance(active, np.ndarray) else f"is {shown(active)}"
        raise ValueError(
            f"active {has}; it must be an array of bool, shaped as the multipliers, {equilibrium.contact.shape}"
        )
    if (active & ~np.isfinite(equilibrium.gaps)).any():
        raise ValueError("active has contacts of points that cannot touch the obstacle; close others")
    return active
