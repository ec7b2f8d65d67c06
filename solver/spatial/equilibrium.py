"""The result of a solve in space."""

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import casadi as ca
import numpy as np

from solver.common.equilibrium import BaseEquilibrium
from solver.common.gap_laws import GapLaw
from solver.common.geometry import divided
from solver.common.layout import SPACE, Layout, make_layout
from solver.common.node_problem import first_derivatives
from solver.spatial.formulation import spatial_problem
from solver.spatial.robot import SpatialRobot, sides


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SpatialEquilibrium(BaseEquilibrium):
    """One equilibrium of a robot among obstacles in space; a step starts from it and needs nothing else.

    Frame: base at the origin, unactuated backbone along +z, first cable on the +x side. The lines of points that can
    touch are those of ``robot.lines_mm``. The attributes are those of
    :class:`~solver.common.equilibrium.BaseEquilibrium`.
    """

    robot_kind: ClassVar[type] = SpatialRobot

    robot: SpatialRobot

    @property
    def cables_mm(self) -> np.ndarray:
        """Signed displacements of both pairs of cables; what was commanded unless stalled or blocked, ``(2,)`` [mm]."""
        return self._layout.cables(self.block)

    @property
    def tensions(self) -> np.ndarray:
        """Tension of the pulled cable of both pairs, ``(2,)`` [N]."""
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
        """Rotation of each disk: its axes are the columns, ``(n+1, 3, 3)``."""
        return self._layout.frames(self.block)

    @property
    def pulled(self) -> np.ndarray:
        """Points of the pulled cables of both pairs on each disk, ``(2, n+1, 3)`` [mm]."""
        return np.asarray(
            self.nodes + np.einsum("nij,kj->kni", self.frames, sides(self.cables_mm)[:, None] * self.robot.holes)
        )

    @property
    def points(self) -> np.ndarray:
        """The points that can touch, ``(p, k, 3)`` [mm]."""
        return touching_points(self.robot, self.nodes, self.frames)

    @property
    def onset_tensions(self) -> np.ndarray:
        """Tensions where the present contact began, signed as the displacements, zero without one, ``(2,)`` [N]."""
        return self._layout.onset(self.block)

    @property
    def tip_slopes(self) -> np.ndarray:
        """Slopes of the free tip in both displacements, ``(2, 5)``: its place [mm/mm] and its turn towards both cables.

        The turn towards a cable is the angle of the tip's bending seen by that cable, times its offset [mm per mm].
        """
        slopes = self._layout.tip_slopes(self.block)
        return np.concatenate([slopes[:, :3], self.robot.offset_mm * slopes[:, 3:]], axis=1)

    @property
    def _layout(self) -> Layout:
        return spatial_layout(self.robot, len(self.scene))

    @property
    def _derivatives(self) -> ca.Function:
        return _node_derivatives(self.robot, self.scene.laws, self.scene.mounted)

    def _node_point(self) -> tuple[np.ndarray, np.ndarray]:
        mounts = self.displacements[list(self.scene.mounted)]
        parameters = [*self.cables_mm, self.length_mm, self.robot.rigidity, *self.scene.parameters]
        unknowns = [self.nodes[1:].ravel(), self.pulled[:, 1:].ravel(), mounts.ravel()]
        return np.concatenate(unknowns), np.array(parameters)


def touching_points(robot: SpatialRobot, nodes: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """The points of the lines of a robot, ``(p, k, 3)`` [mm], of nodes ``(n+1, 3)`` and frames ``(n+1, 3, 3)``."""
    return divided(nodes + np.einsum("nij,pj->pni", frames[:, :, :2], robot.lines_mm), robot.between)


def spatial_layout(robot: SpatialRobot, obstacles: int) -> Layout:
    """The layout for a robot among a number of obstacles."""
    return make_layout(SPACE, robot.segments, robot.lines, robot.positions, obstacles)


@lru_cache(maxsize=32)
def _node_derivatives(robot: SpatialRobot, laws: tuple[GapLaw, ...], mounted: tuple[bool, ...]) -> ca.Function:
    """:func:`~solver.common.node_problem.first_derivatives` of :func:`spatial_problem`."""
    return first_derivatives(spatial_problem(robot, laws, mounted))
