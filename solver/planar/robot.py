"""Description of the planar robot, validated on construction."""

import math
from dataclasses import dataclass, replace
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
from solver.common.rod import Cable, Load, check_rod, checked_angles, full_cables
from solver.common.validation import check_number, check_positive, check_sequence, refusal

LINES = ("backbone", "cable", "rim")
LEAST_LENGTH = 1e-3  # shortest over longest length


@dataclass(frozen=True, slots=True, kw_only=True)
class Robot:
    """A planar cable-driven continuum robot, clamped at the origin and pointing along +y, its cable on the +x side.

    Attributes:
        length_mm: Length of the backbone at rest, L0 [mm].
        segments: Number of segments n the backbone is divided into; nodes are 0 (clamped) to n.
        offset_mm: Distance a of the cable from the backbone [mm].
        rigidity: Flexural rigidity EI of the backbone [N·mm²]. It scales forces and tension, never the shape.
        max_tension: Cable tension the motor can hold [N]; ``math.inf`` lifts the limit.
        max_cable_mm: Largest cable displacement [mm]; ``None`` stands for π·a, which turns the tip by 180°, but at most
            half the shortest length.
        model: ``"rod"``: cables slide through the disks without friction and can go slack, and segments are arcs
            (Rao 2024); with more segments this robot converges to the elastica under constant tendon tension, and its
            contact forces are those of statics. ``"paper"``, the model of the paper to the letter: every segment takes
            an equal share of the cable displacement and may shear.
        length_range_mm: Shortest and longest length the base can insert [mm]; ``None`` for a robot of fixed length.
        touch: Lines whose points can touch obstacles: ``"backbone"``, ``"cable"``, those of all cables (both in the
            paper), and ``"rim"``, the edge of the disks on the side of −x.
        between: Number of further points of each line, evenly spaced between every two nodes, that can touch.
        cables: Cables of the rod, each a :class:`solver.Cable` at the angle 0 (towards +x) or π; none given stand for
            one at 0, as the paper's model has it.
        segment_rigidity: EI of each segment of the rod [N·mm²]; ``None`` for ``rigidity`` in all.
        precurvature: Angle of each segment of the rod at rest, one number for all or each its own, positive towards +x
            [rad].
        weight_per_length: Weight of a unit of length of the rod [N/mm], half of a segment's at each of its nodes.
        loads: Dead loads on disks of the rod, each a :class:`solver.Load`.
        disk_radius_mm: Radius R of the disks, whose edges meet where a segment of the rod bends far [mm]; ``None``
            stands for ``offset_mm``. The paper's model shears before its segments bend so far.
        disk_thickness_mm: Thickness t of the disks [mm].

    Raises:
        ValueError: If a value is not finite, not positive, or out of range; the message names the bound.
    """

    length_mm: float
    segments: int
    offset_mm: float
    rigidity: float = 5000.0
    max_tension: float = 15.0
    max_cable_mm: float | None = None
    model: Literal["paper", "rod"] = "rod"
    length_range_mm: tuple[float, float] | None = None
    touch: tuple[str, ...] = ("backbone", "cable")
    between: int = 0
    cables: tuple[Cable, ...] = ()
    segment_rigidity: tuple[float, ...] | None = None
    precurvature: float | tuple[float, ...] = 0.0
    weight_per_length: tuple[float, float] = (0.0, 0.0)
    loads: tuple[Load, ...] = ()
    disk_radius_mm: float | None = None
    disk_thickness_mm: float = 0.0

    def __post_init__(self) -> None:
        check_fields(self, LINES)
        check_model(self.model)
        self._check_lengths()
        check_proportions(self)
        check_rod(self, 2, (Cable(),))
        object.__setattr__(self, "precurvature", checked_angles(self, self.precurvature))
        check_disks(self)
        self._check_cable_limit()
        check_point_count(
            self, len(self.lines_mm) * self.positions
        )  # last: the lines are kept for a robot that is valid

    def _check_cable_limit(self) -> None:
        # The equal shares of the paper's model take from every segment alike, also at its shortest.
        longest = self.shortest_mm if self.model == "paper" else self.longest_mm
        check_cable_limit(self)
        bound = min(longest, 2 * self.segments * self.offset_mm)
        if not self.cable_limit_mm < bound:
            raise ValueError(
                f"max_cable_mm is {self.cable_limit_mm}; it must be below {bound} "
                f"(the backbone's {'shortest ' if self.model == 'paper' else ''}length, and the disks' reach 2·n·a)"
            )

    def _check_lengths(self) -> None:
        if self.length_range_mm is None:
            return
        wanted = "a pair (shortest, longest) of lengths"
        bounds = check_sequence("length_range_mm", self.length_range_mm, wanted)
        if len(bounds) != 2:
            raise refusal("length_range_mm", bounds, wanted)
        shortest, longest = (check_positive("a bound of length_range_mm", bound) for bound in bounds)
        object.__setattr__(self, "length_range_mm", (shortest, longest))
        if not shortest <= self.length_mm <= longest:
            raise ValueError(f"length_mm is {self.length_mm}; it must lie in length_range_mm {self.length_range_mm}")
        if shortest < LEAST_LENGTH * longest:
            raise ValueError(
                f"length_range_mm is {self.length_range_mm}; the shortest must be at least {LEAST_LENGTH} of the "
                f"longest, {LEAST_LENGTH * longest:.6g}"
            )

    @classmethod
    def prototype(cls, **changes: Any) -> "Robot":
        """Return the paper's 3-D printed prototype: 180 mm, a = 8 mm, 18 segments.

        The paper gives no rigidity. 5000 N·mm² is an assumption of this project: a cable load of 350 gf then displaces
        the cable of the free robot by about 8 mm.

        Args:
            **changes: Fields of the robot that are to be others, such as ``model="rod"``.

        Raises:
            ValueError: As the robot.
            TypeError: If a field is none of the robot's.
        """
        return cls(**{"length_mm": 180.0, "segments": 18, "offset_mm": 8.0, **changes})

    @classmethod
    def preset(cls, name: str, **changes: Any) -> "Robot":
        """Return a rod that people have, by its name in :data:`solver.PRESETS`; ``docs/model.md`` has the table.

        Args:
            name: ``"prototype"``, ``"three_cables"``, ``"rao_2021"``, ``"snake_arm"``, ``"neuroendoscope"`` or
                ``"guidewire"``. In the plane it has a pair of opposed cables a section, the prototype a single one.
            **changes: Fields of the robot that are to be others, such as ``segments=40``; the cables follow.

        Raises:
            ValueError: If there is no such preset, and as the robot.
            TypeError: If a field is none of the robot's.
        """
        return cls(**preset_fields(name, changes, 2))

    def at(self, length_mm: float) -> "Robot":
        """Return the same robot, inserted to a length at rest [mm].

        Raises:
            ValueError: If the length is outside its range.
        """
        if type(length_mm) is float and length_mm == self.length_mm:
            return self
        return replace(self, length_mm=self.check_length(length_mm))

    def check_length(self, length_mm: float) -> float:
        """Return a length within its range as a float.

        Raises:
            ValueError: Naming the value and the range.
        """
        shortest, longest = self.lengths_mm
        if type(length_mm) is float and shortest <= length_mm <= longest:
            return length_mm
        bound = f"from {shortest:.6g} to {longest:.6g} (robot.length_range_mm)"
        return check_number("length_mm", length_mm, shortest, longest, bound)

    @property
    def lengths_mm(self) -> tuple[float, float]:
        """Shortest and longest length of the backbone [mm]."""
        return self.length_range_mm or (self.length_mm, self.length_mm)

    @property
    def shortest_mm(self) -> float:
        """Shortest length of the backbone [mm]."""
        return self.lengths_mm[0]

    @property
    def longest_mm(self) -> float:
        """Longest length of the backbone [mm]."""
        return self.lengths_mm[1]

    @property
    def segment_mm(self) -> float:
        """Length l0 of a backbone segment [mm]."""
        return self.length_mm / self.segments

    @property
    def edge_mm(self) -> float:
        """``disk_radius_mm`` with its default filled in [mm]."""
        return self.offset_mm if self.disk_radius_mm is None else self.disk_radius_mm

    @property
    def lines_mm(self) -> tuple[float, ...]:
        """Distances of the lines of ``touch`` from the backbone, towards the cable [mm]."""
        return _lines(self)

    @property
    def positions(self) -> int:
        """Number of points of a line that can touch, node 0 included."""
        return self.segments * (self.between + 1) + 1

    @property
    def edges_mm(self) -> tuple[float, ...]:
        """Largest possible distance between neighbouring points of each line of ``touch`` [mm].

        A line beside the backbone is stretched where its segment bends away from it: in the rod by an arc up to where
        the disks meet, in the paper's model by a shear up to where the cable has no more length to give.
        """
        return _longest_edges(self)

    @property
    def energy_scale(self) -> float:
        """Scale B = EI / 2 l0 [N·mm] of the elastic energy, B times the objective J = Σθ² [rad²]."""
        return self.rigidity / (2 * self.segment_mm)

    @property
    def bends_evenly(self) -> bool:
        """Whether all segments of the robot that nothing touches bend alike: one cable to the tip alone bends it."""
        loaded = self.loads or any(self.weight_per_length) or self.segment_rigidity
        one = full_cables(self) == (Cable(offset_mm=self.offset_mm, end=self.segments),)
        return one and not loaded and self.least_cable_mm == 0

    @property
    def least_cable_mm(self) -> float:
        """Least displacement of a cable: 0 for one alone on a robot that is straight at rest [mm]."""
        alone = len(self.cables) == 1 and not np.any(self.precurvature)
        return 0.0 if alone else -self.cable_limit_mm

    @property
    def cable_limit_mm(self) -> float:
        """``max_cable_mm`` with its default filled in [mm]."""
        if self.max_cable_mm is not None:
            return self.max_cable_mm
        return min(math.pi * self.offset_mm, 0.5 * (self.shortest_mm if self.model == "paper" else self.longest_mm))


@kept_for_robots
def _lines(robot: Robot) -> tuple[float, ...]:
    cables = dict.fromkeys(math.copysign(cable.offset_mm or 0.0, cable.hole_mm[0]) for cable in full_cables(robot))
    distances = {"backbone": (0.0,), "cable": tuple(cables), "rim": (-robot.offset_mm,)}
    return tuple(dict.fromkeys(distance for line in robot.touch for distance in distances[line]))


@kept_for_robots
def _longest_edges(robot: Robot) -> tuple[float, ...]:
    segment = robot.longest_mm / robot.segments
    if robot.model == "rod":
        widest = widest_bend(segment, robot.edge_mm, robot.disk_thickness_mm)
        longest = [longest_arc_edge(segment, line, widest) for line in robot.lines_mm]
    else:
        turned = math.sqrt(segment**2 - (segment - robot.cable_limit_mm / robot.segments) ** 2) / robot.offset_mm
        longest = [segment + max(0.0, -line) * turned for line in robot.lines_mm]
    return tuple(max(segment, length) / (robot.between + 1) for length in longest)
