"""Steps of the solver that torch can differentiate through."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch

from solver import Equilibrium
from solver.forces import force_true
from solver.sensitivity import CABLE, sensitivity


class EquilibriumOutputs(torch.autograd.Function):
    """``(cable_mm, equilibria) → nodes, tension, forces`` of a batch, differentiable in the cable displacements.

    Each equilibrium is the answer of a solver to its cable displacement. Along a branch it depends on the last command
    only; where the cable could not follow the command (a stall or jam) it does not depend on it, and the gradient
    vanishes. Use :func:`differentiable`.
    """

    @staticmethod
    def forward(ctx: Any, cable_mm: torch.Tensor, equilibria: Sequence[Equilibrium]) -> tuple[torch.Tensor, ...]:
        """Nodes ``(b, n+1, 3)`` [mm, mm, rad], tension ``(b,)`` [N], forces on the robot ``(b, m, 2)`` [N]."""
        ctx.equilibria, ctx.cable_mm = equilibria, cable_mm
        outputs = (
            np.stack([equilibrium.nodes for equilibrium in equilibria]),
            np.array([equilibrium.tension for equilibrium in equilibria]),
            np.stack([force_true(equilibrium) for equilibrium in equilibria]),
        )
        return tuple(torch.as_tensor(output, dtype=cable_mm.dtype) for output in outputs)

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor) -> tuple[torch.Tensor, None]:
        """Slopes of the cable displacement, ``(b,)``."""
        nodes, tension, forces = (gradient.numpy() for gradient in gradients)
        slopes = np.zeros(len(ctx.equilibria))
        for k, (equilibrium, command) in enumerate(zip(ctx.equilibria, ctx.cable_mm.tolist(), strict=True)):
            if equilibrium.cable_mm > 0 and np.isclose(equilibrium.cable_mm, command, rtol=1e-6, atol=0):
                change = sensitivity(equilibrium)
                slopes[k] = (
                    np.sum(nodes[k] * change.nodes[CABLE])
                    + tension[k] * change.tension[CABLE]
                    + np.sum(forces[k] * change.forces[CABLE])
                )
        return torch.as_tensor(slopes, dtype=ctx.cable_mm.dtype), None


def differentiable(
    cable_mm: torch.Tensor, equilibria: Sequence[Equilibrium]
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Node poses, tensions and contact forces of a batch, with gradients in the commanded cable displacements.

    Args:
        cable_mm: Commanded cable displacements, ``(b,)`` on the CPU [mm].
        equilibria: What a solver answered to each; robots of equally many segments among equally many obstacles.

    Returns:
        Nodes ``(b, n+1, 3)`` [mm, mm, rad], tensions ``(b,)`` [N], forces on the robot ``(b, m, 2)`` [N].

    Raises:
        ValueError: If there is not one equilibrium for each displacement.
    """
    if cable_mm.shape != (len(equilibria),):
        raise ValueError(f"cable_mm has shape {tuple(cable_mm.shape)}; it must be ({len(equilibria)},)")
    nodes, tension, forces = EquilibriumOutputs.apply(cable_mm, equilibria)  # type: ignore[no-untyped-call]
    return nodes, tension, forces
