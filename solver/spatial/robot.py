"""Description of the robot in space, validated on construction."""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from solver.common.presets import preset_fields
from solver.common.robot import (
    check_cable_limit,
    check_disks,
    check_fields,
    check_model,
    check_point_count,
    check_proportions,
    kept_for_robots,
    longest_arc_edge,
    widest_bend,
)
from solver.common.rod import Cable, Load, bending_ratios, check_rod, checked_rotations, full_cables
from solver.common.validation import (
    check_finite,
    check_number,
    check_numbers,
    check_sequence,
    check_whole,
    is_listed,
    refusal,
)

LINES = ("backbone", "holes", "rim")
TORSIONS = (0.01, 100.0)  # GJ over EI
TWIST_SLOPE = 0.45  # of a line at the distance a against the backbone, which the longest edges allow for
LEAST_SINE = math.sin(math.radians(30) - 1e-9)  # of the angle between the cables


def sides(cables_mm: np.ndarray) -> np.ndarray:
    """Return which cable of each pair is pulled: 1 for the first one, −1 for the one opposite to it.

    Raises:
        ValueError: If the displacements are no numbers.
    """
    return np.where(check_numbers("cables_mm", cables_mm, (...,)) < 0, -1.0, 1.0)


def stiffness_ratios(robot: "SpatialRobot") -> np.ndarray:
    """Return EI, twice, and GJ of each segment of a rod over the robot's rigidity, ``(n, 3)``."""
    bending = bending_ratios(robot)
    return np.column_stack([bending, bending, bending * np.array(robot.torsion_ratio)])


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialRobot:
    """A cable-driven continuum robot in space, clamped at the origin and pointing along +z.

    In the paper's model two pairs of cables run through its disks: the first cable at the angle 0 from +x, the second
    at ``angle``, and one opposite to each. A positive displacement pulls the first cable of a pair, a negative one its
    opposite; the other cable of the pair is slack and exerts no force. The rod has single cables, as many as are given,
    each with a displacement of its own, which pays it out where it is negative.

    Attributes:
        length_mm: Length of the backbone, L0 [mm].
        segments: Number of segments n; nodes are 0 (clamped) to n.
        offset_mm: Distance a of the cables from the backbone [mm].
        model: ``"paper"``, eq. 13: every segment takes an equal share of both displacements and may shear. ``"rod"``:
            cables slide through the disks without friction and can go slack, and segments are arcs that bend and twist;
            with more segments this robot converges to the Kirchhoff rod under tendon tension.
        angle: Angle from the first cable to the second, about +z [rad]; 30° to 150° either way.
        cables: Cables of the rod, each a :class:`solver.Cable`; none given stand for one at 0 and one at ``angle``.
        rigidity: Flexural rigidity EI of the backbone [N·mm²]. It scales forces and tensions, never the shape.
        max_tension: Tension the motor of a cable can hold [N]; ``math.inf`` lifts the limit.
        max_cable_mm: Largest displacement of a cable [mm]; ``None`` stands for π·a / 2, which turns the tip by 90°,
            but at most half the length.
        torsion_ratio: GJ over EI of the rod, one number or one for each segment; 0.77 is that of a round solid section
            with Poisson's ratio 0.3.
        segment_rigidity: EI of each segment of the rod [N·mm²]; ``None`` for ``rigidity`` in all.
        precurvature: Rotation vector of each segment of the rod at rest, one for all or each its own [rad].
        weight_per_length: Weight of a unit of length of the rod [N/mm], half of a segment's at each of its nodes.
        loads: Dead loads on disks of the rod, each a :class:`solver.Load`.
        disk_radius_mm: Radius R of the disks, whose edges meet where a segment of the rod bends far [mm]; ``None``
            stands for ``offset_mm``.
        disk_thickness_mm: Thickness t of the disks [mm].
        touch: Lines whose points can touch obstacles: ``"backbone"``, ``"holes"`` (those of all cables, in the paper's
            model four), and ``"rim"``, points of the edge of the disks.
        rim_points: Number of points of the rim, evenly spaced from +x on.
        between: Number of further points of each line, evenly spaced between every two nodes, that can touch.

    Raises:
        ValueError: If a value is not finite, not positive, or out of range; the message names the bound.
    """

    length_mm: float
    segments: int
    offset_mm: float
    angle: float = math.pi / 2
    rigidity: float = 5000.0
    max_tension: float = 15.0
    max_cable_mm: float | None = None
    touch: tuple[str, ...] = ("backbone", "holes")
    rim_points: int = 16
    between: int = 0
    model: Literal["paper", "rod"] = "rod"
    cables: tuple[Cable, ...] = ()
    torsion_ratio: float | tuple[float, ...] = 0.77
    segment_rigidity: tuple[float, ...] | None = None
    precurvature: tuple[float, ...] | tuple[tuple[float, ...], ...] = (0.0, 0.0, 0.0)
    weight_per_length: tuple[float, float, float] = (0.0, 0.0, 0.0)
    loads: tuple[Load, ...] = ()
    disk_radius_mm: float | None = None
    disk_thickness_mm: float = 0.0

    def __post_init__(self) -> None:
        check_fields(self, LINES)
        check_model(self.model)
        object.__setattr__(self, "angle", check_finite("angle", self.angle))
        if abs(math.sin(self.angle)) < LEAST_SINE:
            raise ValueError(
                f"angle is {self.angle}; it must be from π/6 to 5π/6 either way: nearer to one plane, the "
                "cables pull against each other, and an obstacle that turns the robot aside drives up their tension"
            )
        object.__setattr__(self, "rim_points", check_whole("rim_points", self.rim_points, 3, 64))
        check_proportions(self)
        self._check_rod()
        check_disks(self)
        self._check_cable_limit()
        check_point_count(self, self.lines * self.positions)  # last: the lines are kept for a robot that is valid

    def _check_rod(self) -> None:
        assign, paper = object.__setattr__, (Cable(), Cable(angle=self.angle))
        check_rod(self, 3, paper)
        assign(self, "precurvature", checked_rotations(self, self.precurvature))
        given = self.torsion_ratio
        ratios = check_sequence("torsion_ratio", given, "numbers") if is_listed(given) else [given] * self.segments
        bound = f"from {TORSIONS[0]} to {TORSIONS[1]}, one number or one for each of the {self.segments} segments"
        if len(ratios) != self.segments:
            raise refusal("torsion_ratio", self.torsion_ratio, bound)
        checked = tuple(check_number("torsion_ratio", ratio, *TORSIONS, bound) for ratio in ratios)
        assign(self, "torsion_ratio", checked if is_listed(given) else checked[0])

    def _check_cable_limit(self) -> None:
        check_cable_limit(self)
        if self.model == "rod":
            return
        bound = min(self.length_mm, self.segments * self.offset_mm * abs(math.sin(self.angle)))
        if not self.cable_limit_mm < bound:
            raise ValueError(
                f"max_cable_mm is {self.cable_limit_mm}; it must be below {bound:.6g} "
                "(the backbone's length, and the disks' reach n·a·|sin angle|)"
            )

    @classmethod
    def prototype(cls, **changes: Any) -> "SpatialRobot":
        """Return the paper's prototype with a second cable; for its rigidity see :meth:`solver.Robot.prototype`.

        Args:
            **changes: Fields of the robot that are to be others, such as ``angle=2.09``.

        Raises:
            ValueError: As the robot.
            TypeError: If a field is none of the robot's.
        """
        return cls(**{"length_mm": 180.0, "segments": 18, "offset_mm": 8.0, **changes})

    @classmethod
    def preset(cls, name: str, **changes: Any) -> "SpatialRobot":
        """Return a rod that people have, by its name in :data:`solver.PRESETS`; ``docs/model.md`` has the table.

        Args:
            name: As of :meth:`solver.Robot.preset`.
            **changes: Fields of the robot that are to be others, such as ``segments=40``; the cables follow.

        Raises:
            ValueError: If there is no such preset, and as the robot.
            TypeError: If a field is none of the robot's.
        """
        return cls(**preset_fields(name, changes, 3))

    @property
    def cable_limit_mm(self) -> float:
        """``max_cable_mm`` with its default filled in [mm]."""
        if self.max_cable_mm is not None:
            return self.max_cable_mm
        return min(math.pi * self.offset_mm, self.length_mm) / (2 if self.model == "paper" else 1)

    @property
    def holes(self) -> np.ndarray:
        """First and second hole of the base disk, ``(2, 3)`` [mm]."""
        turned = self.offset_mm * np.array([math.cos(self.angle), math.sin(self.angle), 0.0])
        return np.array([[self.offset_mm, 0.0, 0.0], turned])

    @property
    def cable_holes_mm(self) -> np.ndarray:
        """Where cables cross the disks, those opposite in the paper's model included, ``(h, 2)`` [mm]."""
        if self.model == "paper":
            first, second = self.holes[:, :2]
            return np.array([first, second, -first, -second])
        return np.array(list(dict.fromkeys(cable.hole_mm for cable in full_cables(self))))

    @property
    def edge_mm(self) -> float:
        """``disk_radius_mm`` with its default filled in [mm]."""
        return self.offset_mm if self.disk_radius_mm is None else self.disk_radius_mm

    @property
    def lines_mm(self) -> np.ndarray:
        """Positions on the disk of the lines of ``touch``, ``(p, 2)`` [mm]."""
        return _lines(self)

    @property
    def line_weights(self) -> np.ndarray:
        """Positions of the lines of ``touch`` as multiples of both holes, ``(p, 2)``."""
        return np.asarray(np.linalg.solve(self.holes[:, :2].T, self.lines_mm.T).T)

    @property
    def lines(self) -> int:
        """Number of lines of points."""
        return len(self.lines_mm)

    @property
    def least_cable_mm(self) -> float:
        """Least displacement of a cable [mm]."""
        return -self.cable_limit_mm

    @property
    def positions(self) -> int:
        """Number of points of a line that can touch, node 0 included."""
        return self.segments * (self.between + 1) + 1

    @property
    def shortest_mm(self) -> float:
        """Shortest length of the backbone, which is fixed [mm]."""
        return self.length_mm

    @property
    def longest_mm(self) -> float:
        """Longest length of the backbone, which is fixed [mm]."""
        return self.length_mm

    @property
    def segment_mm(self) -> float:
        """Length l0 of a backbone segment [mm]."""
        return self.length_mm / self.segments

    @property
    def edges_mm(self) -> tuple[float, ...]:
        """Largest possible distance between neighbouring points of each line [mm].

        A segment of the paper's model shears at most up to where its cable has no more length to give; one of the rod
        bends at most up to where its disks meet. It may bend so far while it twists by up to :attr:`bounded_twist`; a
        shape in which more twist makes an edge longer is out of the solver's range.
        """
        return _longest_edges(self)

    @property
    def bounded_twist(self) -> float:
        """Twist of a rod's segment that ``edges_mm`` allows for [rad]: 0.45 l0 / a more than the largest at rest."""
        at_rest = np.abs(np.reshape(self.precurvature, (-1, 3))[:, 2]).max()
        return float(TWIST_SLOPE * self.segment_mm / self.offset_mm + at_rest)

    @property
    def energy_scale(self) -> float:
        """Scale B = EI / 2 l0 [N·mm] of the elastic energy, B times the objective [rad²]."""
        return self.rigidity / (2 * self.segment_mm)


@kept_for_robots
def _lines(robot: SpatialRobot) -> np.ndarray:
    turns = 2 * math.pi / robot.rim_points * np.arange(robot.rim_points)
    positions = {
        "backbone": np.zeros((1, 2)),
        "holes": robot.cable_holes_mm,
        "rim": robot.offset_mm * np.column_stack([np.cos(turns), np.sin(turns)]),
    }
    lines = np.concatenate([positions[line] for line in robot.touch])
    lines.setflags(write=False)
    return lines


@kept_for_robots
def _longest_edges(robot: SpatialRobot) -> tuple[float, ...]:
    segment = robot.segment_mm
    if robot.model == "rod":
        reaches = np.linalg.norm(robot.lines_mm, axis=1)
        widest = widest_bend(segment, robot.edge_mm, robot.disk_thickness_mm)
        along = [max(segment, longest_arc_edge(segment, reach, widest)) for reach in reaches]
        across = 2 * reaches * math.sin(min(robot.bounded_twist, math.pi) / 2)
        return tuple((np.hypot(along, across) / (robot.between + 1)).tolist())
    turned = math.sqrt(segment**2 - (segment - robot.cable_limit_mm / robot.segments) ** 2)
    stretched = np.abs(robot.line_weights).sum(axis=1) * turned
    return tuple(((segment + stretched) / (robot.between + 1)).tolist())
