"""Sensitivities of an equilibrium by the implicit function theorem at its active set."""

from typing import NamedTuple

import casadi as ca
import numpy as np

from solver.common.equilibrium import BaseEquilibrium
from solver.common.robot import AnyRobot
from solver.common.validation import shown


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
    active = _check_active(equilibrium, active)
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
        change = np.linalg.solve(matrix, -varied)
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


def _check_active(equilibrium: BaseEquilibrium[AnyRobot], active: np.ndarray | None) -> np.ndarray:
    """Return which contacts stay closed, by default those with a positive multiplier."""
    active = equilibrium.contact if active is None else active
    if not (isinstance(active, np.ndarray) and active.dtype == bool and active.shape == equilibrium.contact.shape):
        has = f"has shape {active.shape} of {active.dtype}" if isinstance(active, np.ndarray) else f"is {shown(active)}"
        raise ValueError(
            f"active {has}; it must be an array of bool, shaped as the multipliers, {equilibrium.contact.shape}"
        )
    if (active & ~np.isfinite(equilibrium.gaps)).any():
        raise ValueError("active has contacts of points that cannot touch the obstacle; close others")
    return active
