"""Result of a step in space."""

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
import numpy as np

from solver.common.equilibrium import BaseEquilibrium
from solver.common.geometry import slacks_mm, subdivide
from solver.common.layout import SPACE, Layout, make_layout
from solver.common.loads import load_work
from solver.common.rod import full_cables
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
        """Displacements, of the rod of each cable, else signed of both pairs, as commanded unless stalled or blocked.

        Their shape is ``(c,)`` [mm].
        """
        return self._layout.cables(self.block)

    @property
    def tensions(self) -> np.ndarray:
        """Tension of each cable of the rod, else of the pulled cable of each pair, ``(c,)`` [N]."""
        return self._layout.tensions(self.block)

    @property
    def controls(self) -> np.ndarray:
        """Shears and twist of each segment, as in :mod:`solver.spatial.formulation`, ``(n, 3)``; of a rod rotations.

        A rotation vector of a rod is its bending towards −y and +x, and its twist [rad].
        """
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
        """Points of cables on each disk, ``(c, n+1, 3)`` [mm]: of the rod all, also on disks beyond their ends.

        In the paper's model they are those of the pulled cable of each pair.
        """
        if self.robot.model == "rod":
            holes = np.array([(*cable.hole_mm, 0.0) for cable in full_cables(self.robot)])
        else:
            holes = sides(self.cables_mm)[:, None] * self.robot.holes
        return np.asarray(self.nodes + np.einsum("nij,kj->kni", self.frames, holes))

    @property
    def slacks_mm(self) -> np.ndarray:
        """Excess length of each cable of the rod over its path through the disks, ``(c,)`` [mm].

        In the paper's model, whose cables have no slack, it is zero.
        """
        if self.robot.model == "paper":
            return np.zeros(len(self.cables_mm))
        return slacks_mm(self.robot, self.length_mm, self.cables_mm, self.pulled)

    @property
    def inequality_multipliers(self) -> np.ndarray:
        """Multipliers of the inequalities of :func:`solver.spatial.formulation.node_problem`, ``(k,)`` [rad²/mm]."""
        multipliers = self.multipliers[:, :, 1:].ravel()
        if self.robot.model == "paper":
            return multipliers
        return np.concatenate([self.tensions / self.energy_scale, self.disk_multipliers, multipliers])

    @property
    def disk_multipliers(self) -> np.ndarray:
        """Multiplier of the contact between the disks of each segment, ``(n,)`` for a rod, else ``(0,)`` [rad²/mm]."""
        return self._layout.disk_multipliers(self.block)

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
        unknowns = [self.nodes[1:].ravel(), *self._disk_unknowns(), mounts.ravel()]
        return np.concatenate(unknowns), np.array(parameters)

    def _disk_unknowns(self) -> list[np.ndarray]:
        """Return what the node-coordinate problem knows of the disks: holes, or of a rod edges and rotation vectors."""
        if self.robot.model == "paper":
            return [self.pulled[:, 1:].ravel()]
        edges = self.nodes[1:] + self.robot.offset_mm * np.moveaxis(self.frames[1:, :, :2], 2, 0)
        return [edges.ravel(), self.robot.offset_mm * self.controls.ravel()]

    def _load_work(self) -> float:
        nodes, frames, segment = self.nodes, self.frames, self.robot.segment_mm
        return float(load_work(self.robot, segment, lambda node, at: nodes[node] + frames[node][:, :2] @ at))


def unstressed_nodes(robot: SpatialRobot) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes and frames of a robot that nothing strains, straight but for its precurvature: ``(n+1, 3[, 3])``."""
    nodes, frames = np.zeros((robot.segments + 1, 3)), np.tile(np.eye(3), (robot.segments + 1, 1, 1))
    if not np.any(robot.precurvature):
        nodes[:, 2] = np.linspace(0.0, robot.length_mm, len(nodes))
        return nodes, frames
    for i, turn in enumerate(np.broadcast_to(robot.precurvature, (robot.segments, 3))):
        chord = robot.segment_mm * np.sinc(np.hypot(*turn[:2]) / (2 * np.pi))
        nodes[i + 1] = nodes[i] + chord * (frames[i] @ _rotation(turn / 2))[:, 2]
        frames[i + 1] = frames[i] @ _rotation(turn)
    return nodes, frames


def _rotation(turn: np.ndarray) -> np.ndarray:
    """Return the rotation matrix of a rotation vector."""
    angle = float(np.linalg.norm(turn))
    axis = np.cross(turn / angle if angle else turn, np.eye(3)).T
    return np.asarray(np.eye(3) + np.sin(angle) * axis + (1 - np.cos(angle)) * axis @ axis)


def touching_points(robot: SpatialRobot, nodes: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Return the points of ``robot.touch``, ``(lines, positions, 3)`` [mm], at nodes ``(n+1, 3)`` and their frames."""
    return subdivide(nodes + np.einsum("nij,pj->pni", frames[:, :, :2], robot.lines_mm), robot.between)


def spatial_layout(robot: SpatialRobot, obstacles: int) -> Layout:
    """Return the layout for a robot among a number of obstacles."""
    sizes = robot.segments, len(robot.cables), robot.lines, robot.positions
    return make_layout(SPACE[robot.model], *sizes, obstacles)
