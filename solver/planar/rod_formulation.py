"""The rod's part of the node-coordinate problem in the plane: segments that are arcs, cables that slide, and loads."""

from typing import NamedTuple

import casadi as ca
import numpy as np

from solver.common.gap_laws import sinc_and_cosine
from solver.common.loads import load_work
from solver.common.node_problem import norms
from solver.common.rod import bending_ratios, full_cables
from solver.planar.robot import Robot


class Pose(NamedTuple):
    """Points of backbone and disks at nodes 0…n, the disks between them, and the angles of the segments."""

    backbone: ca.MX
    edge: ca.MX
    disk: ca.MX
    angle: ca.MX

    def line(self, share: float) -> ca.MX:
        """Return the points of the disks at a share of their vector from the backbone."""
        return self.backbone + share * self.disk

    def turn(self, node: int) -> ca.MX:
        """Return the angle of the disk of a node, counter-clockwise [rad]."""
        return -ca.sum2(self.angle[:, :node])


def pose(points: ca.MX, offset: ca.MX) -> Pose:
    """Return the shape of the points of backbone and disk edges of nodes 1…n, ``(4n,)``."""
    n = points.shape[0] // 4
    backbone = ca.horzcat(ca.vertcat(0, 0), ca.reshape(points[: 2 * n], 2, n))
    edge = ca.horzcat(ca.vertcat(offset, 0), ca.reshape(points[2 * n :], 2, n))
    disk = edge - backbone
    before, after = disk[:, :-1], disk[:, 1:]
    sine = before[0, :] * after[1, :] - before[1, :] * after[0, :]
    return Pose(backbone, edge, disk, ca.atan2(-sine, ca.sum1(before * after)))


def rod_inequality_count(robot: Robot) -> int:
    """Return how many inequalities a rod has of its own: slacks of its cables, and two gaps between disks a segment."""
    return len(robot.cables) + 2 * robot.segments


def rod_objective(robot: Robot, shape: Pose, total: ca.MX, energy_scale: ca.MX) -> ca.MX:
    """Return the elastic energy and the potential of the loads, over ``B = EI / 2 l0`` [rad²]."""
    strain = shape.angle - ca.DM(np.broadcast_to(robot.precurvature, robot.segments)).T
    work = load_work(robot, total / robot.segments, lambda node, place: _point(robot, shape, node, place), shape.turn)
    return ca.MX(ca.dot(ca.DM(bending_ratios(robot)).T * strain, strain) - work / energy_scale)


def _point(robot: Robot, shape: Pose, node: int, place: tuple[float, float]) -> ca.MX:
    return shape.backbone[:, node] + place[0] / robot.offset_mm * shape.disk[:, node]


def rod_segments(robot: Robot, shape: Pose, pulls: ca.MX, total: ca.MX, offset: ca.MX) -> tuple[ca.MX, ca.MX]:
    """Return the equalities of the rod's segments, which are arcs, and the robot's own inequalities.

    Equalities: length of the chord minus its value, component of the chord along the bisector of the disks, length of
    the disk minus its value. Inequalities: slack of each cable, then the gaps between the disks of each segment on the
    side of +x, then on the other.
    """
    before, after = shape.disk[:, :-1], shape.disk[:, 1:]
    chord = shape.backbone[:, 1:] - shape.backbone[:, :-1]
    sinc, _ = sinc_and_cosine(shape.angle**2 / 4)
    astride = ca.sum1(chord * (before + after)) / (2 * offset)
    equalities = ca.horzcat(norms(chord) - total / robot.segments * sinc, astride, norms(after) - offset)
    ahead = ca.vertcat(-before[1, :] - after[1, :], before[0, :] + after[0, :])  # across the bisector of the disks
    ahead = ahead / ca.repmat(norms(ahead), 2, 1)
    return equalities, ca.vertcat(*_slacks(robot, shape, ahead, pulls, total), *_disk_gaps(robot, shape, ahead))


def _slacks(robot: Robot, shape: Pose, ahead: ca.MX, pulls: ca.MX, total: ca.MX) -> list[ca.MX]:
    """Return how much longer each cable is than its way through the disks [mm].

    It runs across the bisector; its length has no slope where the holes of two disks meet.
    """
    slacks = []
    for k, cable in enumerate(full_cables(robot)):
        end = cable.end or robot.segments
        line = shape.line(cable.hole_mm[0] / robot.offset_mm)
        ways = ca.sum1((line[:, 1:] - line[:, :-1]) * ahead)
        slacks.append(total * end / robot.segments - pulls[k] - ca.sum2(ways[:, :end]))
    return slacks


def _disk_gaps(robot: Robot, shape: Pose, ahead: ca.MX) -> list[ca.MX]:
    """Return the gaps between the edges of consecutive disks, across their bisector, on each side [mm]."""
    half_cosine = norms(shape.disk[:, :-1] + shape.disk[:, 1:]) / (2 * robot.offset_mm)
    gaps = []
    for side in (1, -1):
        edges = shape.line(side * robot.edge_mm / robot.offset_mm)
        apart = ca.sum1((edges[:, 1:] - edges[:, :-1]) * ahead)
        gaps.append((apart - robot.disk_thickness_mm * half_cosine).T)
    return gaps
