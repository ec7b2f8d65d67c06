"""Result of a step in space."""

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
import numpy as np

from solver.common.equilibrium import BaseEquilibrium
from solver.common.geometry import subdivide
from solver.common.layout import SPACE, Layout, make_layout
from solver.spatial.formulation import node_derivatives
from solver.spatial.robot import SpatialRobot, sides


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SpatialEquilibrium(BaseEquilibrium[SpatialRobot]):
    """Equilibrium of a robot among obstacles in space; a step starts from it and needs nothing else.

    Frame: base at the origin, unactuated backbone along +z, first cable on the +x side. The lines of points that can
    touch are those of ``robot.lines_mm``. The attributes are those of
    :class:`~solver.common.equilibrium.BaseEquilibrium`.
    """

    robot_kind: ClassVar[type] = SpatialRobot

    @property
    def cables_mm(self) -> np.ndarray:
        """Signed displacements of both pairs of cables, as commanded unless stalled or blocked, ``(2,)`` [mm]."""
        return self._layout.cables(self.block)

    @property
    def tensions(self) -> np.ndarray:
        """Tension of the pulled cable of each pair, ``(2,)`` [N]."""
        return self._layout.tensions(self.block)

    @property
    def controls(self) -> np.ndarray:
        """Shears and twist of each segment, ``(n, 3)``, as in :mod:`solver.spatial.formulation`."""
        return self._layout.coordinates(self.block)

    @property
    def nodes(self) -> np.ndarray:
        """Backbone points, ``(n+1, 3)`` [mm]."""
        return self._layout.nodes(self.block)

    @property
    def frames(self) -> np.ndarray:
        """Rotation of each disk, whose axes are the columns, ``(n+1, 3, 3)``."""
        return self._layout.frames(self.block)

    @property
    def pulled(self) -> np.ndarray:
        """Points of the pulled cable of each pair on each disk, ``(2, n+1, 3)`` [mm]."""
        return np.asarray(
            self.nodes + np.einsum("nij,kj->kni", self.frames, sides(self.cables_mm)[:, None] * self.robot.holes)
        )

    @property
    def points(self) -> np.ndarray:
        """The points that can touch, ``(p, k, 3)`` [mm]."""
        return touching_points(self.robot, self.nodes, self.frames)

    @property
    def onset_tensions(self) -> np.ndarray:
        """Tensions at the onset of the present contact, signed as the displacements, zero without one, ``(2,)`` [N]."""
        return self._layout.onset(self.block)

    @property
    def tip_slopes(self) -> np.ndarray:
        """Slopes of the free tip in both displacements, ``(2, 5)``: of its position and its turn towards both cables.

        The turn towards a cable is the bending angle of the tip seen by that cable, times its offset [mm per mm].
        """
        slopes = self._layout.tip_slopes(self.block)
        return np.concatenate([slopes[:, :3], self.robot.offset_mm * slopes[:, 3:]], axis=1)

    @property
    def _layout(self) -> Layout:
        return spatial_layout(self.robot, len(self.scene))

    @property
    def _derivatives(self) -> ca.Function:
        return node_derivatives(self.robot, self.scene.laws, self.scene.mounted)

    def _node_point(self) -> tuple[np.ndarray, np.ndarray]:
        mounts = self.displacements[list(self.scene.mounted)]
        parameters = [*self.cables_mm, self.length_mm, self.robot.rigidity, *self.scene.parameters]
        unknowns = [self.nodes[1:].ravel(), self.pulled[:, 1:].ravel(), mounts.ravel()]
        return np.concatenate(unknowns), np.array(parameters)


def touching_points(robot: SpatialRobot, nodes: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Return the points of ``robot.touch``, ``(lines, positions, 3)`` [mm], at nodes ``(n+1, 3)`` and their frames."""
    return subdivide(nodes + np.einsum("nij,pj->pni", frames[:, :, :2], robot.lines_mm), robot.between)


def spatial_layout(robot: SpatialRobot, obstacles: int) -> Layout:
    """Return the layout for a robot among a number of obstacles."""
    sizes = robot.segments, len(robot.cables), robot.lines, robot.positions
    return make_layout(SPACE[robot.model], *sizes, obstacles)
