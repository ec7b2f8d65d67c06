"""Equilibria as functions of torch tensors, with gradients from the implicit function theorem."""

from collections.abc import Sequence

import numpy as np
import torch

from agents.arguments import check_kind, check_whole
from solver import Equilibrium, Sensitivity, force_true, sensitivity


class _Context(torch.autograd.function.FunctionCtx):
    """What the forward pass keeps for the gradients."""

    values: torch.Tensor
    equilibria: Sequence[Equilibrium]
    rows: Sequence[int]


class EquilibriumOutputs(torch.autograd.Function):
    """The map ``(values, equilibria, rows) → nodes, tension, forces`` of a batch; use :func:`differentiable`."""

    @staticmethod
    def forward(
        ctx: _Context, values: torch.Tensor, equilibria: Sequence[Equilibrium], rows: Sequence[int]
    ) -> tuple[torch.Tensor, ...]:
        """Return nodes ``(b, n+1, 3)`` [mm, mm, rad], tension ``(b,)`` [N], forces on the robot ``(b, m, 2)`` [N]."""
        ctx.values, ctx.equilibria, ctx.rows = values, equilibria, rows
        outputs = (
            np.stack([equilibrium.nodes for equilibrium in equilibria]),
            np.array([equilibrium.tension for equilibrium in equilibria]),
            np.stack([force_true(equilibrium) for equilibrium in equilibria]),
        )
        return tuple(torch.as_tensor(output, dtype=values.dtype) for output in outputs)

    @staticmethod
    def backward(ctx: _Context, *gradients: torch.Tensor) -> tuple[torch.Tensor, None, None]:
        """Return the gradients with respect to the values, ``(b, k)``."""
        nodes, tension, forces = (gradient.numpy() for gradient in gradients)
        slopes = np.zeros(ctx.values.shape)
        for k, (equilibrium, values) in enumerate(zip(ctx.equilibria, ctx.values.tolist(), strict=True)):
            reached = [_is_reached(equilibrium, row, value) for row, value in zip(ctx.rows, values, strict=True)]
            if any(reached) and _is_differentiable(equilibrium):
                change = sensitivity(equilibrium)
                total = (
                    np.einsum("rij,ij->r", change.nodes, nodes[k])
                    + change.tension * tension[k]
                    + np.einsum("rij,ij->r", change.forces, forces[k])
                )
                slopes[k] = np.where(reached, total[list(ctx.rows)], 0.0)
        return torch.as_tensor(slopes, dtype=ctx.values.dtype), None, None


def _is_reached(equilibrium: Equilibrium, row: int, value: float) -> bool:
    """Return whether the equilibrium has the commanded value; that of a stalled or blocked robot has not."""
    commands = [*equilibrium.cables_mm, equilibrium.length_mm]  # the first rows of a sensitivity
    reached = commands[row] if row < len(commands) else value
    return bool(np.isclose(reached, value, rtol=1e-6, atol=0))


def _is_differentiable(equilibrium: Equilibrium) -> bool:
    """Return whether the shape is unique: in the paper's model shear costs nothing while the cable is not pulled."""
    return equilibrium.cable_mm > 0 or equilibrium.robot.model == "rod"


def differentiable(
    values: torch.Tensor, equilibria: Sequence[Equilibrium], rows: Sequence[int] = (0,)
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Return nodes, tensions and contact forces of a batch of equilibria, differentiable in the values behind them.

    Along a branch an equilibrium depends only on the last command and the obstacles. Where the robot stalled or was
    blocked, and so did not reach a command, it does not depend on that command, and the gradient is zero.

    Args:
        values: The values each equilibrium was solved for, ``(b, k)`` on the CPU, or ``(b,)`` for one value each.
        equilibria: Results of a solver, with the same numbers of segments and of obstacles.
        rows: What the values are: rows of a :class:`solver.Sensitivity`, such as the displacement of the first cable,
            the commanded length, or the position of an obstacle, see :meth:`solver.Sensitivity.rows`.

    Returns:
        Nodes ``(b, n+1, 3)`` [mm, mm, rad], tensions ``(b,)`` [N], forces on the robot ``(b, m, 2)`` [N].

    Raises:
        ValueError: If the values are not one row of ``len(rows)`` for each equilibrium, or a row is none of theirs.
        TypeError: If ``values`` is no tensor, or ``equilibria`` are none of the plane.
    """
    check_kind("values", values, torch.Tensor, "give a tensor of the values that the equilibria were solved for")
    check_kind("equilibria", equilibria, (list, tuple), "give a list of equilibria")
    check_kind("rows", rows, (list, tuple, range), "give the indices of rows, as (0,)")
    for equilibrium in equilibria:
        check_kind("equilibria", equilibrium, Equilibrium, "give results of solvers of the plane")
        obstacles = Sensitivity.rows(equilibrium.robot)
        last = obstacles.length + obstacles.motions * len(equilibrium.scene)
        rows = [check_whole("rows", row, 0, last) for row in rows]
    table = values[:, None] if values.ndim == 1 else values
    if table.shape != (len(equilibria), len(rows)):
        raise ValueError(f"values has shape {tuple(values.shape)}; it must be ({len(equilibria)}, {len(rows)})")
    nodes, tension, forces = EquilibriumOutputs.apply(table, equilibria, rows)  # type: ignore[no-untyped-call]
    return nodes, tension, forces
