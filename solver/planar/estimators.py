"""Contact force by virtual work at the point that touches, from what a real robot measures.

For any motion that the robot can make while its cable moves by dl, the work of cable and contacts is the change of
energy: ``B dJ/dl = T + Σ F_j·x_j'`` with ``B = EI / 2 l0``. The left side is the tension that the bending alone needs,
so contacts take up the rest, ``Σ F_j·x_j' = k T_bend − T``, k being the rigidity over its nominal value. Which points
touch, the direction of the forces and how several share them are knowledge of the model: the nominal robot's
equilibrium at the displacement that the encoder reads. One factor on its forces is unknown.

The two estimates differ in the shape at which the motion is taken. ``contact`` takes the free robot at the same
displacement, which is right at small deflection; ``shape`` takes the measured shape and is right at any.

Everything works on one robot or on arrays of them (...), with cables along an axis c, so that robots of several cables
can share the formula. k is learnt before contact, see :class:`RigidityFit`. The motions here are in closed form, those
of robots that one cable bends evenly; :mod:`solver.planar.contact_force` has those of any robot.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from solver.common.geometry import subdivide
from solver.common.validation import (
    LARGEST,
    check_alike,
    check_array,
    check_instance,
    check_numbers,
    check_positive,
    check_whole,
    refusal,
)
from solver.planar.equilibrium import Equilibrium
from solver.planar.robot import Robot

NEWTON_ITERATIONS = 5  # for the free robot's angle; the start is off by the square of the angle
SPREAD = math.log(3)  # standard deviation of k around 1 before anything is measured
MAX_ROBOTS = 2**31 - 1  # along an axis
LEAST_SLOPE = 0.02  # of a contact's motion against its force, over L/a; below, a pull hardly presses on it


class Motion(NamedTuple):
    """A shape, and a motion from it in which the cables take up dl.

    Attributes:
        nodes: Node poses, ``(..., n+1, 3)`` [mm, mm, rad].
        slopes: Their slopes in the displacement of each cable, ``(..., c, n+1, 3)`` [mm, mm, rad per mm].
        tensions: Tension that the bending alone needs in each cable, at nominal rigidity, ``(..., c)`` [N].
    """

    nodes: np.ndarray
    slopes: np.ndarray
    tensions: np.ndarray


@dataclass(frozen=True, slots=True)
class RigidityFit:
    """Rigidity over its nominal value k, by least squares over the free phase with a ridge to 1.

    It is the state of an episode: :meth:`updated` returns the next, and leaves it as it is where anything touches.
    Where the tension is measured at the motor, k is the rigidity ratio over the share of the load that arrives.

    Attributes:
        products: Sum of products of measured and free tension over their variance, and the ridge's, ``(...)``.
        squares: Sum of squares of the free tension, likewise, ``(...)``.
    """

    products: np.ndarray
    squares: np.ndarray

    @classmethod
    def prior(cls, *shape: int) -> Self:
        """Return the state before anything is measured, k = 1, of robots in an array of a shape."""
        weight = np.full([check_whole("shape", count, 0, MAX_ROBOTS) for count in shape], SPREAD**-2)
        return cls(weight, weight)

    @property
    def ratio(self) -> np.ndarray:
        """Rigidity over its nominal value k, ``(...)``."""
        return np.asarray(self.products / self.squares)

    def updated(
        self, tensions: np.ndarray, free_tensions: np.ndarray, touching: np.ndarray, tension_noise_n: float
    ) -> Self:
        """Return the state after a measurement.

        Args:
            tensions: Measured tensions, ``(..., c)`` [N].
            free_tensions: Those of the free nominal robot at the same displacements, ``(..., c)`` [N].
            touching: Whether anything touches, ``(...)`` bool.
            tension_noise_n: Standard deviation of the measured tension [N].

        Raises:
            ValueError: If the noise is not positive, or the tensions are not finite numbers of these robots.
        """
        tensions, free_tensions = (
            check_array(name, given, (..., -1), -LARGEST, LARGEST, "finite")
            for name, given in (("tensions", tensions), ("free_tensions", free_tensions))
        )
        touching = _check_flags("touching", touching)
        check_alike(tensions=tensions.shape, free_tensions=free_tensions.shape)
        check_alike(tensions=tensions.shape[:-1], touching=touching.shape, products=np.shape(self.products))
        weight = np.where(touching, 0.0, check_positive("tension_noise_n", tension_noise_n) ** -2)
        products, squares = (np.sum(other * free_tensions, axis=-1) for other in (tensions, free_tensions))
        return type(self)(self.products + weight * products, self.squares + weight * squares)


def point_forces(equilibrium: Equilibrium) -> np.ndarray:
    """Return the force of each obstacle on each point of the robot, by energy, ``(m, p, k, 2)`` [N].

    Raises:
        TypeError: If ``equilibrium`` is not one of the plane.
    """
    check_instance("equilibrium", equilibrium, Equilibrium, "take one of a solver of the plane")
    multipliers, points = equilibrium.multipliers, equilibrium.points
    forces = np.zeros((*multipliers.shape, 2))
    for touch in np.argwhere(equilibrium.contact):
        obstacle, line, position = touch
        at = points[line, position] - equilibrium.displacements[obstacle]
        normal = equilibrium.scene.obstacles[obstacle].normal_at(at)
        forces[tuple(touch)] = equilibrium.energy_scale * multipliers[tuple(touch)] * normal
    return forces


def force_factor(
    robot: Robot, motion: Motion, forces: np.ndarray, tensions: np.ndarray, rigidity_ratio: np.ndarray
) -> np.ndarray:
    """Return the factor on the nominal forces for which they do the work that the cables lack, ``(...)``.

    With ``g_i`` the work of the nominal forces against the motion by cable i, it is
    ``Σ g_i (T_i − k T_bend,i) / Σ g_i²``, by least squares; at least 0, as obstacles push. The denominator has a floor,
    so that it is small where the motion hardly works against any contact.

    Args:
        robot: The robot.
        motion: Shape and motion, of :func:`free_motion` or :func:`shape_motion`.
        forces: Nominal force of each obstacle on each point, ``(..., m, p, k, 2)`` [N], as :func:`point_forces`.
        tensions: Measured tensions, ``(..., c)`` [N].
        rigidity_ratio: Rigidity over its nominal value k, ``(...)``.

    Raises:
        ValueError: If an array is not one of numbers, or not of this robot's shapes.
        TypeError: If the robot is not one of the plane, or ``motion`` is no motion.
    """
    _check_motion(robot, motion)
    forces = check_numbers("forces", forces, (..., -1, len(robot.lines_mm), robot.positions, 2))
    tensions = check_numbers("tensions", tensions, (..., motion.tensions.shape[-1]))
    rigidity_ratio = check_numbers("rigidity_ratio", rigidity_ratio, (...,))
    leading = {"forces": forces.shape[:-4], "tensions": tensions.shape[:-1], "rigidity_ratio": rigidity_ratio.shape}
    check_alike(motion=motion.tensions.shape[:-1], **leading)
    slopes = point_slopes(robot, motion)
    pressed = forces.sum(axis=-4)
    works = -np.sum(pressed[..., None, :, :, :] * slopes, axis=(-3, -2, -1))
    total = np.sqrt(np.sum(forces**2, axis=-1)).sum(axis=(-3, -2, -1))
    least = LEAST_SLOPE * robot.longest_mm / robot.offset_mm * total
    lacking = tensions - rigidity_ratio[..., None] * motion.tensions
    squares = np.maximum(np.sum(works**2, axis=-1), least**2)
    return np.asarray(np.maximum(np.sum(works * lacking, axis=-1), 0.0) / np.where(squares > 0, squares, 1.0))


def point_slopes(robot: Robot, motion: Motion) -> np.ndarray:
    """Return the slopes of the points that can touch, ``(..., c, p, k, 2)`` [mm per mm]."""
    angles, slopes = motion.nodes[..., None, :, 2], motion.slopes
    turned = slopes[..., 2, None] * np.stack([-np.sin(angles), np.cos(angles)], axis=-1)
    lines = slopes[..., None, :, :2] + np.array(robot.lines_mm)[:, None, None] * turned[..., None, :, :]
    return subdivide(lines, robot.between)


def free_motion(robot: Robot, cable_mm: np.ndarray, length_mm: np.ndarray) -> Motion:
    """Return pose, slopes and tension of the free robot at cable displacements and lengths ``(...)`` [mm].

    Raises:
        ValueError: If a displacement is beyond what any robot of these disks can take up, or a length not from half to
            twice the robot's, or the robot does not bend evenly.
        TypeError: If the robot is not one of the plane.
    """
    cable_mm, length_mm = _check_measured(robot, cable_mm, length_mm)
    angle, chord = _free_segment(robot, cable_mm / robot.segments, length_mm / robot.segments)
    middles = (np.arange(robot.segments) + 0.5) * angle[..., None]
    nodes = np.zeros((*angle.shape, robot.segments + 1, 3))
    nodes[..., 1:, 0] = chord[..., None] * np.cumsum(np.sin(middles), axis=-1)
    nodes[..., 1:, 1] = chord[..., None] * np.cumsum(np.cos(middles), axis=-1)
    nodes[..., 2] = -angle[..., None] * np.arange(robot.segments + 1)
    return shape_motion(robot, nodes, cable_mm, length_mm)


def shape_motion(robot: Robot, nodes: np.ndarray, cable_mm: np.ndarray, length_mm: np.ndarray) -> Motion:
    """Return the motion from a shape in which every segment takes up the cable alike, and the tension that it needs.

    A rod's segments all turn by the same angle. Those of the paper's model take an equal share at constant shear.

    Args:
        robot: The robot.
        nodes: Node poses, ``(..., n+1, 3)`` [mm, mm, rad].
        cable_mm: Cable displacements, ``(...)`` [mm].
        length_mm: Lengths of the backbone, ``(...)`` [mm].

    Raises:
        ValueError: As :func:`free_motion`, or if the poses are not finite or not those of this robot's nodes.
        TypeError: If the robot is not one of the plane.
    """
    cable_mm, length_mm = _check_measured(robot, cable_mm, length_mm)
    nodes = check_array("nodes", nodes, (..., robot.segments + 1, 3), -LARGEST, LARGEST, "finite")
    check_alike(nodes=nodes.shape[:-2], cable_mm=cable_mm.shape, length_mm=length_mm.shape)
    robots = np.broadcast_shapes(nodes.shape[:-2], cable_mm.shape, length_mm.shape)
    nodes = np.broadcast_to(nodes, (*robots, *nodes.shape[-2:]))
    ahead, angles = np.diff(nodes[..., :2], axis=-2), -np.diff(nodes[..., 2], axis=-1)
    length, pull = length_mm[..., None] / robot.segments, cable_mm[..., None] / robot.segments
    if robot.model == "rod":
        stretch, taken = arc_slopes(angles, robot.offset_mm, length)
        turns = np.broadcast_to(1 / taken.sum(axis=-1, keepdims=True), angles.shape)
    else:
        bisector = nodes[..., :-1, 2] - angles / 2
        reach = ahead[..., 1] * np.cos(bisector) - ahead[..., 0] * np.sin(bisector)
        cable = reach - 2 * robot.offset_mm * np.sin(angles / 2)  # across the bisector of the disks
        stretch = np.zeros_like(angles)
        turns = (length - pull) / (robot.segments * robot.offset_mm * np.cos(angles / 2) * cable)
    energy_scale = robot.rigidity / (2 * length[..., 0])
    tensions = 2 * energy_scale * np.sum(angles * turns, axis=-1)
    return Motion(nodes, node_slopes(ahead, stretch * turns, turns)[..., None, :, :], tensions[..., None])


def _check_measured(robot: Robot, cable_mm: np.ndarray, length_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements of the cable and lengths of a robot as arrays; both may be noisy, and beyond its range."""
    check_instance("robot", robot, Robot, "the motions are those of robots of the plane")
    if not robot.bends_evenly:
        raise ValueError(
            "the closed form is that of a robot that one cable to its tip bends evenly; contact_estimate and "
            "shape_estimate take any robot"
        )
    low, high = robot.shortest_mm / 2, 2 * robot.longest_mm
    length_mm = check_array("length_mm", length_mm, (...,), low, high, f"from {low:.6g} to {high:.6g}")
    most = min(robot.longest_mm, 2 * robot.segments * robot.offset_mm)
    cable_mm = check_array("cable_mm", cable_mm, (...,), -most, most, f"from {-most:.6g} to {most:.6g}")
    check_alike(cable_mm=cable_mm.shape, length_mm=length_mm.shape)
    return cable_mm, length_mm


def _check_motion(robot: Robot, motion: Motion) -> None:
    """Check that a motion is one of a robot."""
    check_instance("robot", robot, Robot, "the motions are those of robots of the plane")
    check_instance("motion", motion, Motion, "take one of free_motion or shape_motion")
    nodes = (robot.segments + 1, 3)
    check_numbers("motion.nodes", motion.nodes, (..., *nodes))
    slopes = check_numbers("motion.slopes", motion.slopes, (..., -1, *nodes))
    check_numbers("motion.tensions", motion.tensions, (..., slopes.shape[-3]))


def _check_flags(name: str, value: object) -> np.ndarray:
    """Return whether something holds, of one robot or of many, as an array of bool."""
    flags = np.asarray(value)
    if flags.dtype != bool:
        raise refusal(name, value, "a bool or an array of bool")
    return flags


def node_slopes(ahead: np.ndarray, stretch: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Return the slopes of node poses whose segments stretch and whose disks turn against each other."""
    slopes = np.zeros((*turns.shape[:-1], turns.shape[-1] + 1, 3))
    slopes[..., 1:, 2] = -np.cumsum(turns, axis=-1)
    turning = slopes[..., :-1, 2] - turns / 2  # of a segment, which turns with the bisector of its disks
    slopes[..., 1:, 0] = np.cumsum(stretch * ahead[..., 0] - turning * ahead[..., 1], axis=-1)
    slopes[..., 1:, 1] = np.cumsum(stretch * ahead[..., 1] + turning * ahead[..., 0], axis=-1)
    return slopes


def _free_segment(robot: Robot, pull: np.ndarray, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return angle [rad] and chord [mm] of the free robot's segments, which all are alike, for arrays of them."""
    offset = robot.offset_mm
    if robot.model == "paper":
        return 2 * np.arcsin(pull / (2 * offset)), np.asarray(length)
    half = pull / (2 * offset)
    for _ in range(NEWTON_ITERATIONS):
        taken = length * (1 - np.sinc(half / np.pi)) + 2 * offset * np.sin(half)
        half = half - (taken - pull) / (2 * offset * np.cos(half) - length * _sinc_slope(half))
    return 2 * half, length * np.sinc(half / np.pi)


def arc_slopes(
    angles: np.ndarray, holes_mm: float | np.ndarray, length_mm: float | np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return, of segments of a rod, the slopes in their angles of the logarithm of the chord and of the cable taken up.

    Args:
        angles: Angles between their disks, ``(..., n)`` [rad].
        holes_mm: Distances of the cables from the backbone, broadcast with the angles [mm].
        length_mm: Lengths of the segments, likewise [mm].
    """
    slope = _sinc_slope(angles / 2)
    return slope / (2 * np.sinc(angles / (2 * np.pi))), holes_mm * np.cos(angles / 2) - length_mm * slope / 2


def _sinc_slope(half: np.ndarray) -> np.ndarray:
    """Return the derivative of sin h / h."""
    return np.asarray((np.cos(half) - np.sinc(half / np.pi)) / np.where(half == 0, 1.0, half))
