"""Equilibria as functions of torch tensors: gradients by the implicit function theorem."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch

from solver import Equilibrium, Sensitivity, force_true, sensitivity


class EquilibriumOutputs(torch.autograd.Function):
    """``(values, equilibria, rows) → nodes, tension, forces`` of a batch; use :func:`differentiable`."""

    @staticmethod
    def forward(
        ctx: Any, values: torch.Tensor, equilibria: Sequence[Equilibrium], rows: Sequence[int]
    ) -> tuple[torch.Tensor, ...]:
        """Nodes ``(b, n+1, 3)`` [mm, mm, rad], tension ``(b,)`` [N], forces on the robot ``(b, m, 2)`` [N]."""
        ctx.values, ctx.equilibria, ctx.rows = values, equilibria, rows
        outputs = (
            np.stack([equilibrium.nodes for equilibrium in equilibria]),
            np.array([equilibrium.tension for equilibrium in equilibria]),
            np.stack([force_true(equilibrium) for equilibrium in equilibria]),
        )
        return tuple(torch.as_tensor(output, dtype=values.dtype) for output in outputs)

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor) -> tuple[torch.Tensor, None, None]:
        """Slopes of the values, ``(b, k)``."""
        nodes, tension, forces = (gradient.numpy() for gradient in gradients)
        slopes = np.zeros(ctx.values.shape)
        for k, (equilibrium, values) in enumerate(zip(ctx.equilibria, ctx.values.tolist(), strict=True)):
            followed = [_followed(equilibrium, row, value) for row, value in zip(ctx.rows, values, strict=True)]
            if not any(followed) or not _determined(equilibrium):
                continue
            change = sensitivity(equilibrium)
            everything = (
                np.einsum("rij,ij->r", change.nodes, nodes[k])
                + change.tension * tension[k]
                + np.einsum("rij,ij->r", change.forces, forces[k])
            )
            slopes[k] = np.where(followed, everything[list(ctx.rows)], 0.0)
        return torch.as_tensor(slopes, dtype=ctx.values.dtype), None, None


def _followed(equilibrium: Equilibrium, row: int, value: float) -> bool:
    """Whether the equilibrium is where a value commands; a stalled or blocked robot is not."""
    reached = {Sensitivity.CABLE: equilibrium.cable_mm, Sensitivity.LENGTH: equilibrium.length_mm}.get(row, value)
    return bool(np.isclose(reached, value, rtol=1e-6, atol=0))


def _determined(equilibrium: Equilibrium) -> bool:
    return equilibrium.cable_mm > 0 or equilibrium.robot.model == "rod"


def differentiable(
    values: torch.Tensor, equilibria: Sequence[Equilibrium], rows: Sequence[int] = (Sensitivity.CABLE,)
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Node poses, tensions and contact forces of a batch, with gradients in the values they were solved for.

    Each equilibrium is the answer of a solver. Along a branch it depends on the last command and the obstacles only;
    where the robot could not follow a command (it stalled or was blocked) it does not depend on it, and the gradient
    vanishes.

    Args:
        values: What each was solved for, ``(b, k)`` on the CPU, or ``(b,)`` for one value each.
        equilibria: The answers; robots of equally many segments among equally many obstacles.
        rows: What the values are: rows of a :class:`solver.Sensitivity`, such as the cable displacement and
            the length commanded, or the place of an obstacle.

    Returns:
        Nodes ``(b, n+1, 3)`` [mm, mm, rad], tensions ``(b,)`` [N], forces on the robot ``(b, m, 2)`` [N].

    Raises:
        ValueError: If there is not one row of values for each equilibrium.
    """
    table = values[:, None] if values.ndim == 1 else values
    if table.shape != (len(equilibria), len(rows)):
        raise ValueError(f"values has shape {tuple(values.shape)}; it must be ({len(equilibria)}, {len(rows)})")
    nodes, tension, forces = EquilibriumOutputs.apply(table, equilibria, rows)  # type: ignore[no-untyped-call]
    return nodes, tension, forces
