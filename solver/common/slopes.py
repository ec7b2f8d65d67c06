"""Slopes of an equilibrium in its parameters, found by the kernel."""

import math
from collections import OrderedDict
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from solver import _kernel
from solver.common.equilibrium import BaseEquilibrium
from solver.common.implicit import check_active
from solver.common.layout import Layout
from solver.common.robot import AnyRobot
from solver.common.scene import Scene

MOST_KERNELS = 16
Kernel = _kernel.Kernel | _kernel.SpatialKernel


class _Held(NamedTuple):
    """A kernel, what it was made of, and columns and shapes of the parts of its slopes."""

    robot: object
    scene: object
    kernel: Kernel | None
    shape: tuple[int, int]
    parts: list[tuple[slice, tuple[int, ...]]]


class KernelSlopes:
    """Finds slopes by the kernel, of which it keeps those of the robots and scenes that it was asked for last.

    Args:
        make: Makes the kernel of a robot and a scene.
        layout: Returns the memory layout of the blocks of a robot among a number of obstacles.
    """

    def __init__(self, make: Callable[[Any, Scene], Kernel], layout: Callable[[Any, int], Layout]) -> None:
        self._make, self._layout = make, layout
        # By identity: to compare robots would take longer than to find their slopes.
        self._held: OrderedDict[tuple[int, int], _Held] = OrderedDict()

    def __call__(
        self, equilibrium: BaseEquilibrium[AnyRobot], active: np.ndarray | None = None
    ) -> list[np.ndarray] | None:
        """Return the slopes of nodes, in space of their turns, multipliers, tensions, forces and displacements.

        Args:
            equilibrium: The equilibrium.
            active: Which contacts stay closed, ``(m, p, k)`` bool; ``None`` for those with a positive multiplier, but
                for those that others imply, such as the third of a link that lies flush on a side: their multipliers
                keep still.

        Returns:
            The slopes, with the parameters along their first axes; ``None`` where the kernel finds none: its Hessian is
            singular, contacts or taut cables all but depend on each other, too many contacts are closed, or no compiler
            is there for a custom shape.

        Raises:
            ValueError: If ``active`` has the wrong shape, or contacts that cannot all be closed at once.
        """
        robot, scene = equilibrium.robot, equilibrium.scene
        _, _, kernel, shape, parts = self._held.get((id(robot), id(scene))) or self._hold(robot, scene)
        if kernel is None:
            return None
        if active is not None:
            active = check_active(equilibrium, active).copy()
            active[~np.array(scene.mounted, bool), :, 0] = False  # the base does not move
        slopes = np.empty(shape)
        found, left_out = kernel.slopes(equilibrium.block, active, slopes)
        if active is not None and left_out:
            raise ValueError(f"active has {active.sum()} contacts that depend on each other; close fewer")
        return [slopes[:, columns].reshape(shape) for columns, shape in parts] if found else None

    def _hold(self, robot: Any, scene: Scene) -> _Held:
        """Return the kernel of a robot and a scene, which takes the place of the oldest one."""
        try:
            kernel = self._make(robot, scene)
        except RuntimeError:  # a custom shape cannot be compiled
            held = _Held(robot, scene, None, (0, 0), [])
        else:
            shape = kernel.slopes_shape
            parts = row_parts(self._layout(robot, len(scene)), robot.segments)
            held = _Held(robot, scene, kernel, shape, [(columns, (shape[0], *part)) for columns, part in parts])
        self._held[id(robot), id(scene)] = held
        if len(self._held) > MOST_KERNELS:
            self._held.popitem(last=False)
        return held


def row_parts(layout: Layout, segments: int) -> list[tuple[slice, tuple[int, ...]]]:
    """Return columns and shape of each part of a row of slopes, in the order of :class:`KernelSlopes`."""
    nodes = (segments + 1, 3)
    fields = [layout.multipliers, layout.cables, layout.forces, layout.displacements]
    parts, start = [], 0
    for shape in [nodes] * (layout.force.shape[0] - 1) + [field.shape for field in fields]:
        stop = start + math.prod(shape)
        parts.append((slice(start, stop), shape))
        start = stop
    return parts
