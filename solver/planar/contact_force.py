"""Contact force of one robot of any kind by virtual work: ``contact`` and ``shape`` of :mod:`solver.planar.estimators`.

A robot that one cable bends evenly has both motions in closed form. Of any other one, with several cables, loads,
precurvature or segments unlike each other, ``contact`` solves the free robot under its loads and moves it along the way
that its cables were pulled: of several sections, a cable that is taut there may be slack here, so that single cables
cannot be compared. ``shape`` turns the segments up to each end of a cable alike: the tensions and the loads do work on
this motion, and what they do beyond bending the robot is the work against the contacts.
"""

from collections.abc import Sequence

import numpy as np

from solver.common.loads import node_loads
from solver.common.rod import bending_ratios, full_cables
from solver.common.scene import Scene
from solver.common.validation import LARGEST, check_array, check_finite, check_instance, check_positive, is_listed
from solver.planar.equilibrium import Equilibrium
from solver.planar.estimators import (
    Motion,
    arc_slopes,
    force_factor,
    free_motion,
    node_slopes,
    point_forces,
    shape_motion,
)
from solver.planar.robot import Robot
from solver.planar.sensitivity import sensitivity
from solver.planar.solve import Solver

Tensions = float | Sequence[float] | np.ndarray


def contact_estimate(nominal: Equilibrium, tension: Tensions, rigidity_ratio: float = 1.0) -> np.ndarray:
    """Estimate the contact force from tension and displacement of the cables, ``(m, 2)`` [N].

    Args:
        nominal: Equilibrium of the nominal robot in the known scene at the measured displacements.
        tension: Measured cable tension, of several cables one each [N].
        rigidity_ratio: Rigidity over its nominal value k, as :attr:`RigidityFit.ratio`.

    Raises:
        ValueError: If a tension or the ratio is not a finite number, or the ratio is not positive, or the tensions are
            not those of these cables.
        TypeError: If ``nominal`` is not an equilibrium of the plane.
    """
    tensions = _check_tensions(nominal, tension)
    if nominal.robot.bends_evenly:
        motion = free_motion(nominal.robot, *_cable_and_length(nominal))
        return _estimate(nominal, motion, tensions, rigidity_ratio)
    motion = _solved_motion(nominal)
    way = _way(nominal, (tensions > 0) | (motion.tensions > 0))
    motion = Motion(motion.nodes, np.tensordot(way, motion.slopes, 1)[None], way[None] @ motion.tensions)
    return _estimate(nominal, motion, way[None] @ tensions, rigidity_ratio)


def shape_estimate(
    nominal: Equilibrium, nodes: np.ndarray, tension: Tensions, rigidity_ratio: float = 1.0
) -> np.ndarray:
    """Estimate the contact force from the tensions of the cables and the measured shape, ``(m, 2)`` [N].

    Args:
        nominal: Equilibrium of the nominal robot in the known scene at the measured displacements.
        nodes: Measured node poses, ``(n+1, 3)`` [mm, mm, rad].
        tension: Measured cable tension, of several cables one each [N].
        rigidity_ratio: Rigidity over its nominal value k, as :attr:`RigidityFit.ratio`.

    Raises:
        ValueError: As :func:`contact_estimate`, or if the poses are not finite or not those of this robot's nodes.
        TypeError: As :func:`contact_estimate`.
    """
    tensions = _check_tensions(nominal, tension)
    nodes = check_array("nodes", nodes, nominal.nodes.shape, -LARGEST, LARGEST, "finite")
    if nominal.robot.bends_evenly:
        motion = shape_motion(nominal.robot, nodes, *_cable_and_length(nominal))
        return _estimate(nominal, motion, tensions, rigidity_ratio)
    motion, cables, loads = _turning_motion(nominal, nodes)
    return _estimate(nominal, motion, cables @ tensions + loads, rigidity_ratio)


def _check_tensions(nominal: Equilibrium, tension: Tensions) -> np.ndarray:
    """Return the tensions of the cables of an equilibrium as an array, ``(c,)`` [N]."""
    check_instance("nominal", nominal, Equilibrium, "take one of a solver of the plane")
    count = len(nominal.robot.cables)
    if count == 1 and not is_listed(tension):
        return np.array([check_finite("tension", tension)])
    return check_array("tension", tension, (count,), -LARGEST, LARGEST, "finite, one for each cable")


def _cable_and_length(nominal: Equilibrium) -> tuple[np.ndarray, np.ndarray]:
    return np.array(nominal.cable_mm), np.array(nominal.length_mm)


def _estimate(nominal: Equilibrium, motion: Motion, works: np.ndarray, rigidity_ratio: float) -> np.ndarray:
    ratio = np.array(check_positive("rigidity_ratio", rigidity_ratio))
    factor = force_factor(nominal.robot, motion, point_forces(nominal), works, ratio)
    return np.asarray(factor * nominal.forces)


def _solved_motion(nominal: Equilibrium) -> Motion:
    """Return the free robot under its loads at the displacements of an equilibrium; a slack cable moves nothing."""
    solver = Solver(nominal.robot, Scene())
    free = solver.step(solver.rest(), nominal.cables_mm.tolist(), nominal.length_mm)
    slopes = sensitivity(free)
    return Motion(free.nodes, slopes.nodes[slopes.rows(nominal.robot).cables], free.tensions)


def _way(nominal: Equilibrium, taut: np.ndarray) -> np.ndarray:
    """Return the direction in which the taut cables were pulled, all alike if none was, ``(c,)``."""
    pulls = np.where(taut, nominal.cables_mm, 0.0)
    pulls = pulls if pulls.any() else np.ones(len(pulls))
    return np.asarray(pulls / np.linalg.norm(pulls))


def _turning_motion(nominal: Equilibrium, nodes: np.ndarray) -> tuple[Motion, np.ndarray, np.ndarray]:
    """Return a motion from a shape for each node where cables end: all segments up to there turn alike.

    Returns:
        The motion, whose tensions are the works of the bending, the work of each cable's unit tension, ``(e, c)``, and
        that of the loads, ``(e,)`` [N].
    """
    robot, length = nominal.robot, nominal.length_mm / nominal.robot.segments
    cables, segments = full_cables(robot), np.arange(robot.segments)
    reach = np.array([cable.end for cable in cables])
    ends = np.unique(reach)
    turns = (segments < ends[:, None]) / (ends[:, None] * robot.offset_mm)  # a cable at the offset moves by about 1 mm
    angles = -np.diff(nodes[:, 2])
    holes = np.array([cable.hole_mm[0] for cable in cables])[:, None]
    stretch, taken = arc_slopes(angles, holes, length)
    slopes = node_slopes(np.diff(nodes[:, :2], axis=0), stretch * turns, turns)
    taken = np.where(segments < reach[:, None], taken, 0.0)
    moments = robot.rigidity * bending_ratios(robot) * (angles - np.broadcast_to(robot.precurvature, len(angles)))
    return Motion(nodes, slopes, turns @ moments / length), turns @ taken.T, _load_works(robot, length, nodes, slopes)


def _load_works(robot: Robot, segment_mm: float, nodes: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Return the work of the loads on motions of the nodes ``(e, n+1, 3)``, ``(e,)`` [N]."""
    works = np.zeros(len(slopes))
    for load in node_loads(robot, segment_mm):
        moved, angle = slopes[:, load.node], nodes[load.node, 2]
        around = load.place_mm[0] * (load.force[1] * np.cos(angle) - load.force[0] * np.sin(angle))
        works += moved[:, :2] @ np.array(load.force) + (load.moment + around) * moved[:, 2]
    return works
