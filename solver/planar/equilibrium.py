"""Result of a step in the plane."""

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
import numpy as np

from solver.common.equilibrium import BaseEquilibrium
from solver.common.geometry import slacks_mm, subdivide
from solver.common.layout import Layout
from solver.common.loads import load_work
from solver.common.rod import full_cables
from solver.planar.formulation import node_derivatives
from solver.planar.layout import layout
from solver.planar.robot import Robot


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Equilibrium(BaseEquilibrium[Robot]):
    """Equilibrium of a robot among obstacles in the plane; a step starts from it and needs nothing else.

    Frame: base at the origin, unactuated backbone along +y, cable on the +x side. The lines of points that can touch
    are those of ``robot.touch``, by default (backbone, cable). The attributes are those of
    :class:`~solver.common.equilibrium.BaseEquilibrium`.
    """

    robot_kind: ClassVar[type] = Robot

    @property
    def cables_mm(self) -> np.ndarray:
        """Displacement of each cable, as commanded unless stalled or blocked, ``(c,)`` [mm]."""
        return self._layout.cables(self.block)

    @property
    def tensions(self) -> np.ndarray:
        """Tension of each cable, ``(c,)`` [N]."""
        return self._layout.tensions(self.block)

    @property
    def cable_mm(self) -> float:
        """Displacement l of the first cable, as commanded unless the step stalled or was blocked [mm]."""
        return float(self.block[self._layout.cables.at])

    @property
    def length_mm(self) -> float:
        """Length of the backbone L0, which insertion changes [mm]."""
        return float(self.block[self._layout.length.at])

    @property
    def tension(self) -> float:
        """Tension dE/dl of the first cable along the branch [N]."""
        return float(self.block[self._layout.tensions.at])

    @property
    def shear(self) -> np.ndarray:
        """Shear angle ψ of each segment, ``(n,)`` [rad]; zero for a rod."""
        sines = self._layout.coordinates(self.block)
        return np.zeros_like(sines) if self.robot.model == "rod" else np.asarray(np.arcsin(sines))

    @property
    def nodes(self) -> np.ndarray:
        """Backbone point and disk angle of each node, ``(n+1, 3)`` [mm, mm, rad]."""
        return self._layout.nodes(self.block)

    @property
    def cable_nodes(self) -> np.ndarray:
        """Point of the first cable on each disk, ``(n+1, 2)`` [mm]."""
        return np.asarray(self.pulled[0])

    @property
    def pulled(self) -> np.ndarray:
        """Points of each cable on each disk, also on those beyond its end, ``(c, n+1, 2)`` [mm]."""
        holes = np.array([cable.hole_mm[0] for cable in full_cables(self.robot)])
        return np.asarray(self.nodes[:, :2] + holes[:, None, None] * self._layout.frames(self.block))

    @property
    def slacks_mm(self) -> np.ndarray:
        """Excess length of each cable over its path through the disks, zero in the paper's model, ``(c,)`` [mm]."""
        return slacks_mm(self.robot, self.length_mm, self.cables_mm, self.pulled)

    @property
    def slack_mm(self) -> float:
        """Excess length of the first cable over its path through the disks [mm]; zero unless a rod's cable is slack."""
        return float(self.slacks_mm[0])

    @property
    def points(self) -> np.ndarray:
        """The points that can touch, ``(p, k, 2)`` [mm]."""
        return touching_points(self.robot, self.nodes)

    @property
    def inequality_multipliers(self) -> np.ndarray:
        """Multipliers of the inequalities of :func:`solver.planar.formulation.node_problem`, ``(k,)`` [rad²/mm]."""
        multipliers = self.multipliers[:, :, 1:].ravel()
        if self.robot.model != "rod":
            return multipliers
        disks = self.disk_multipliers
        cables = self.tensions / self.energy_scale
        return np.concatenate([cables, np.maximum(disks, 0), np.maximum(-disks, 0), multipliers])

    @property
    def disk_multipliers(self) -> np.ndarray:
        """Multiplier of the contact between the disks of each segment [rad²/mm].

        It is negative where the segment bends away from the cable. The shape is ``(n,)`` for a rod and ``(0,)`` for the
        paper's model, whose segments shear before they bend so far.
        """
        return self._layout.disk_multipliers(self.block)

    @property
    def onset_tension(self) -> float:
        """Cable tension where the present contact began, zero while nothing touches [N]."""
        return float(self._layout.onset(self.block)[0])

    @property
    def tip_slopes(self) -> np.ndarray:
        """Slopes of the free tip pose in the cable displacement (eq. 7), ``(3,)`` [mm, mm, rad per mm]."""
        return self._layout.tip_slopes(self.block)

    @property
    def _layout(self) -> Layout:
        return layout(self.robot, len(self.scene))

    @property
    def _derivatives(self) -> ca.Function:
        return node_derivatives(self.robot, self.scene.laws, self.scene.mounted)

    def _node_point(self) -> tuple[np.ndarray, np.ndarray]:
        robot, mounts = self.robot, self.displacements[list(self.scene.mounted)]
        parameters = [*self.cables_mm, self.length_mm, robot.offset_mm, robot.rigidity, *self.scene.parameters]
        edges = self.nodes[1:, :2] + robot.offset_mm * self._layout.frames(self.block)[1:]
        unknowns = [self.nodes[1:, :2].ravel(), edges.ravel(), mounts.ravel()]
        return np.concatenate(unknowns), np.array(parameters)

    def _load_work(self) -> float:
        nodes, disks, segment = self.nodes, self._layout.frames(self.block), self.length_mm / self.robot.segments
        return float(
            load_work(
                self.robot,
                segment,
                lambda node, place: nodes[node, :2] + place[0] * disks[node],
                lambda node: nodes[node, 2],
            )
        )


def unstressed_nodes(robot: Robot) -> np.ndarray:
    """Return the node poses of a robot that nothing strains, straight but for its precurvature, ``(n+1, 3)``."""
    turns = np.broadcast_to(robot.precurvature, robot.segments)
    angles = np.concatenate([[0.0], -np.cumsum(turns)])
    headings, chords = angles[:-1] - turns / 2, robot.segment_mm * np.sinc(turns / (2 * np.pi))
    steps = chords[:, None] * np.column_stack([-np.sin(headings), np.cos(headings)])
    return np.column_stack([np.vstack([np.zeros(2), np.cumsum(steps, axis=0)]), angles])


def touching_points(robot: Robot, nodes: np.ndarray) -> np.ndarray:
    """Return the points of ``robot.touch``, ``(lines, positions, 2)`` [mm], at node poses ``(n+1, 3)``.

    Those between two nodes divide the straight line between their points evenly.
    """
    disks = np.column_stack([np.cos(nodes[:, 2]), np.sin(nodes[:, 2])])
    return subdivide(nodes[:, :2] + np.array(robot.lines_mm)[:, None, None] * disks, robot.between)
