"""The robot: what the solver needs to know of it, validated once."""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

from solver.common.robot import OFFSETS, check_cable, check_numbers, check_points, check_scale
from solver.common.validation import number, positive, sequence, shown

LINES = ("backbone", "cable", "rim")
MODELS = ("paper", "rod")
ANGLES = 64  # at which the longest edge of a bent segment is looked for
LEAST_LENGTH = 1e-3  # shortest over longest length
THICKEST = 0.9  # a disk, over the segment at its shortest


@dataclass(frozen=True, slots=True, kw_only=True)
class Robot:
    """A planar cable-driven continuum robot, clamped at the origin and pointing along +y, its cable on the +x side.

    Attributes:
        length_mm: Length of the backbone at rest, L0 [mm].
        segments: Number of segments n the backbone is divided into; nodes are 0 (clamped) to n.
        offset_mm: Distance a of the cable from the backbone [mm].
        rigidity: Flexural rigidity EI of the backbone [N·mm²]. It scales forces and tension, never the shape.
        max_tension: Cable tension the motor can hold [N]; ``math.inf`` lifts the limit.
        max_cable_mm: Largest cable displacement [mm]; ``None`` stands for π·a, half a turn of the tip.
        model: ``"paper"``, the paper's: every segment takes an equal share of the cable displacement and shears.
            ``"rod"``: the cable slides through the disks without friction and can go slack, and segments are arcs
            (Rao 2024); with more segments this robot tends to the elastica under a tendon of constant tension.
        length_range_mm: Shortest and longest length the base can insert [mm]; ``None`` for a robot of fixed length.
        touch: The lines whose points can touch obstacles: ``"backbone"``, ``"cable"`` (both in the paper), and
            ``"rim"``, the edge of the disks opposite to the cable.
        between: Number of points of each line, evenly spaced between every two nodes, that can touch as well.
        disk_radius_mm: Radius R of the disks, whose edges meet where a segment bends far [mm]; ``None`` stands for
            ``offset_mm``. A uniform cable shears its segments before they bend as far.
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
    model: Literal["paper", "rod"] = "paper"
    length_range_mm: tuple[float, float] | None = None
    touch: tuple[str, ...] = ("backbone", "cable")
    between: int = 0
    disk_radius_mm: float | None = None
    disk_thickness_mm: float = 0.0

    def __post_init__(self) -> None:
        check_numbers(self, LINES)
        if not (isinstance(self.model, str) and self.model in MODELS):
            raise ValueError(f"model is {shown(self.model)}; it must be one of {', '.join(MODELS)}")
        self._check_lengths()
        shortest, longest = self.lengths_mm
        check_scale(self, longest)
        self._check_disks()
        check_points(self, len(self.touch) * self.positions)
        check_cable(self, min(math.pi * self.offset_mm, 0.5 * shortest))
        bound = min(shortest, 2 * self.segments * self.offset_mm)
        if not self.cable_limit_mm < bound:
            raise ValueError(
                f"max_cable_mm is {self.max_cable_mm}; it must be below {bound} "
                "(the backbone's shortest length, and the disks' reach 2·n·a)"
            )

    def _check_disks(self) -> None:
        radius = self.offset_mm if self.disk_radius_mm is None else self.disk_radius_mm
        low, high = (ratio * self.longest_mm for ratio in OFFSETS)
        bound = f"from {low:.6g} to {high:.6g}, {OFFSETS} of the longest length"
        radius = number("disk_radius_mm", radius, low, high, bound)
        most = THICKEST * self.shortest_mm / self.segments
        bound = f"from 0 to {most:.6g}, {THICKEST} of a segment's length"
        thickness = number("disk_thickness_mm", self.disk_thickness_mm, 0.0, most, bound)
        object.__setattr__(self, "disk_radius_mm", radius)
        object.__setattr__(self, "disk_thickness_mm", thickness)

    def _check_lengths(self) -> None:
        if self.length_range_mm is None:
            return
        bounds = sequence("length_range_mm", self.length_range_mm, "a pair (shortest, longest) of lengths")
        if len(bounds) != 2:
            raise ValueError(f"length_range_mm is {shown(bounds)}; it must be a pair (shortest, longest) of lengths")
        shortest, longest = (positive("a bound of length_range_mm", bound) for bound in bounds)
        object.__setattr__(self, "length_range_mm", (shortest, longest))
        if not shortest <= self.length_mm <= longest:
            raise ValueError(f"length_mm is {self.length_mm}; it must lie in length_range_mm {self.length_range_mm}")
        if shortest < LEAST_LENGTH * longest:
            raise ValueError(
                f"length_range_mm is {self.length_range_mm}; the shortest must be at least {LEAST_LENGTH} of the "
                f"longest, {LEAST_LENGTH * longest:.6g}"
            )

    @classmethod
    def prototype(cls, *, max_tension: float = 15.0, segments: int = 18) -> "Robot":
        """The paper's 3-D printed prototype: 180 mm, a = 8 mm, 18 segments.

        The paper gives no rigidity. 5000 N·mm² is an assumption of this project: 350 gf on the cable then bend the
        free robot by about 8 mm of cable displacement.
        """
        return cls(length_mm=180.0, segments=segments, offset_mm=8.0, max_tension=max_tension)

    def at(self, length_mm: float) -> "Robot":
        """The same robot, inserted to a length at rest [mm].

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
        return number("length_mm", length_mm, shortest, longest, bound)

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
    def lines_mm(self) -> tuple[float, ...]:
        """Distance of the lines of ``touch`` from the backbone, towards the cable [mm]."""
        place = {"backbone": 0.0, "cable": self.offset_mm, "rim": -self.offset_mm}
        return tuple(place[line] for line in self.touch)

    @property
    def positions(self) -> int:
        """Number of points of a line that can touch, node 0 included."""
        return self.segments * (self.between + 1) + 1

    @property
    def edges_mm(self) -> tuple[float, ...]:
        """Longest distance there can be between neighbouring points of each line of ``touch`` [mm].

        A line beside the backbone is stretched where its segment bends away from it: by an arc up to where the disks
        meet, with a uniform cable by a shear up to where the cable has no more length to give.
        """
        return _longest_edges(self)

    @property
    def energy_scale(self) -> float:
        """B = EI / 2 l0 [N·mm], which turns the objective J = Σθ² [rad²] into energy."""
        return self.rigidity / (2 * self.segment_mm)

    @property
    def cable_limit_mm(self) -> float:
        """``max_cable_mm`` with its default filled in [mm]."""
        assert self.max_cable_mm is not None
        return self.max_cable_mm


@lru_cache(maxsize=64)
def _longest_edges(robot: Robot) -> tuple[float, ...]:
    segment = robot.longest_mm / robot.segments
    if robot.model == "rod":
        assert robot.disk_radius_mm is not None
        widest = min((segment - robot.disk_thickness_mm) / robot.disk_radius_mm, math.pi)
        angles = [widest * k / ANGLES for k in range(1, ANGLES + 1)]
        longest = [max(2 * (segment / t + abs(line)) * math.sin(t / 2) for t in angles) for line in robot.lines_mm]
    else:
        turned = math.sqrt(segment**2 - (segment - robot.cable_limit_mm / robot.segments) ** 2) / robot.offset_mm
        longest = [segment + max(0.0, -line) * turned for line in robot.lines_mm]
    return tuple(max(segment, length) / (robot.between + 1) for length in longest)
