"""Slopes of an equilibrium in its parameters, found by the kernel."""

from collections import OrderedDict
from collections.abc import Callable
from typing import Any

import numpy as np

from solver import _kernel
from solver.common.equilibrium import BaseEquilibrium
from solver.common.robot import AnyRobot
from solver.common.scene import Scene

MOST_KERNELS = 16
Kernel = _kernel.Kernel | _kernel.SpatialKernel


class KernelSlopes:
    """Finds slopes by the kernel, of which it keeps those of the robots and scenes that it was asked for last.

    Args:
        make: Makes the kernel of a robot and a scene.
    """

    def __init__(self, make: Callable[[Any, Scene], Kernel]) -> None:
        self._make = make
        # By identity: to compare robots would take longer than their slopes. The entries hold what has the identity.
        self._kernels: OrderedDict[tuple[int, int], tuple[object, object, Kernel]] = OrderedDict()

    def __call__(self, equilibrium: BaseEquilibrium[AnyRobot], active: np.ndarray | None) -> tuple[np.ndarray, ...] | None:
        """Return the slopes of node poses, multipliers, tensions, forces and displacements, parameters first.

        In space those of node poses are positions, then turns of the disks, ``(q, 2 (n+1), 3)``.

        Args:
            equilibrium: The equilibrium.
            active: Which contacts stay closed, ``(m, p, k)`` bool; ``None`` for those with a positive multiplier.

        Returns:
            The slopes, or ``None`` where the kernel does not find them: its Hessian is singular, or contacts in
            ``active`` depend on each other or are too many.
        """
        kernel = self._kernel(equilibrium.robot, equilibrium.scene)
        slopes = np.empty(kernel.slopes_shape)
        found, left_out = kernel.slopes(equilibrium.block, active, slopes)
        if not found or (active is not None and left_out):
            return None
        return self._split(equilibrium, slopes)

    @staticmethod
    def _split(equilibrium: BaseEquilibrium[AnyRobot], slopes: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the parts of the rows of slopes as views."""
        parameters, width = slopes.shape
        layout = equilibrium._layout
        shapes = [layout.multipliers.shape, layout.cables.shape, layout.forces.shape, layout.displacements.shape]
        ends = np.cumsum([np.prod(shape, dtype=int) for shape in shapes])
        start = width - int(ends[-1])
        parts = [slopes[:, :start].reshape(parameters, -1, 3)]
        for shape, end in zip(shapes, ends.tolist(), strict=True):
            parts.append(slopes[:, start : width - int(ends[-1]) + end].reshape(parameters, *shape))
            start = width - int(ends[-1]) + end
        return tuple(parts)

    def _kernel(self, robot: Any, scene: Scene) -> Kernel:
        key = id(robot), id(scene)
        kept = self._kernels.get(key)
        if kept is None:
            kept = self._kernels[key] = robot, scene, self._make(robot, scene)
            if len(self._kernels) > MOST_KERNELS:
                self._kernels.popitem(last=False)
        return kept[2]
