"""The robot: what the solver needs to know of it, validated once."""

import math
from collections.abc import Sequence, Sized
from dataclasses import dataclass, replace
from typing import Any, Protocol

LINES = ("backbone", "cable", "rim")
CABLES = ("uniform", "sliding")


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
        cable: ``"uniform"``, the paper's: every segment takes an equal share of the cable displacement and shears.
            ``"sliding"``: the cable slides through the disks without friction and can go slack, and segments are arcs
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
    cable: str = "uniform"
    length_range_mm: tuple[float, float] | None = None
    touch: tuple[str, ...] = ("backbone", "cable")
    between: int = 0
    disk_radius_mm: float | None = None
    disk_thickness_mm: float = 0.0

    def __post_init__(self) -> None:
        check_numbers(self, LINES)
        self._check_disks()
        if self.cable not in CABLES:
            raise ValueError(f"cable is {self.cable!r}; it must be one of {', '.join(CABLES)}")
        self._check_lengths()
        if self.max_cable_mm is None:
            object.__setattr__(self, "max_cable_mm", min(math.pi * self.offset_mm, 0.5 * self.lengths_mm[0]))
        require_positive("max_cable_mm", self.max_cable_mm)
        bound = min(self.lengths_mm[0], 2 * self.segments * self.offset_mm)
        if not self.cable_limit_mm < bound:
            raise ValueError(
                f"max_cable_mm is {self.max_cable_mm}; it must be below {bound} "
                "(the backbone's shortest length, and the disks' reach 2·n·a)"
            )

    def _check_disks(self) -> None:
        if self.disk_radius_mm is None:
            object.__setattr__(self, "disk_radius_mm", self.offset_mm)
        require_positive("disk_radius_mm", self.disk_radius_mm)
        shortest = min(self.length_range_mm or (self.length_mm,)) / self.segments
        if not 0 <= self.disk_thickness_mm < shortest:
            raise ValueError(
                f"disk_thickness_mm is {self.disk_thickness_mm}; it must be from 0 to below {shortest:.6g}, "
                "the length of a segment"
            )

    def _check_lengths(self) -> None:
        if self.length_range_mm is None:
            return
        shortest, longest = self.length_range_mm
        object.__setattr__(self, "length_range_mm", (float(shortest), float(longest)))
        for bound in (shortest, longest):
            require_positive("a bound of length_range_mm", bound)
        if not shortest <= self.length_mm <= longest:
            raise ValueError(f"length_mm is {self.length_mm}; it must lie in length_range_mm {self.length_range_mm}")

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
        if length_mm == self.length_mm:
            return self
        self.check_length(length_mm)
        return replace(self, length_mm=length_mm)

    def check_length(self, length_mm: float) -> None:
        """Refuse a length outside its range.

        Raises:
            ValueError: Naming the value and the range.
        """
        shortest, longest = self.lengths_mm
        if not shortest <= length_mm <= longest:
            raise ValueError(
                f"length_mm is {length_mm}; it must be from {shortest:.6g} to {longest:.6g} (robot.length_range_mm)"
            )

    @property
    def lengths_mm(self) -> tuple[float, float]:
        """Shortest and longest length of the backbone [mm]."""
        return self.length_range_mm or (self.length_mm, self.length_mm)

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
        segment = self.lengths_mm[1] / self.segments
        if self.cable == "sliding":
            assert self.disk_radius_mm is not None
            widest = (segment - self.disk_thickness_mm) / self.disk_radius_mm
            stretched = [abs(line) * widest for line in self.lines_mm]
        else:
            turned = math.sqrt(segment**2 - (segment - self.cable_limit_mm / self.segments) ** 2) / self.offset_mm
            stretched = [max(0.0, -line) * turned for line in self.lines_mm]
        return tuple((segment + stretch) / (self.between + 1) for stretch in stretched)

    @property
    def stiffness(self) -> float:
        """B = EI / 2 l0 [N·mm], which turns the objective J = Σθ² [rad²] into energy."""
        return self.rigidity / (2 * self.segment_mm)

    @property
    def cable_limit_mm(self) -> float:
        """``max_cable_mm`` with its default filled in [mm]."""
        assert self.max_cable_mm is not None
        return self.max_cable_mm


class AnyRobot(Protocol):
    """What robots in the plane and in space have in common."""

    @property
    def segments(self) -> int:
        """Number of segments."""

    @property
    def between(self) -> int:
        """Number of points of a line between every two nodes."""

    @property
    def lines_mm(self) -> Sized:
        """Places on the disk of the lines of points that can touch [mm]."""

    @property
    def positions(self) -> int:
        """Number of points of a line that can touch, node 0 included."""

    @property
    def edges_mm(self) -> Sequence[float]:
        """Longest distance there can be between neighbouring points of each line [mm]."""


def check_numbers(robot: Any, lines: tuple[str, ...]) -> None:
    """Refuse what no robot can have; its ``touch`` becomes a tuple, of some of these lines.

    Raises:
        ValueError: Naming the value and the bound.
    """
    for name in ("length_mm", "offset_mm", "rigidity"):
        require_positive(name, getattr(robot, name))
    if not (isinstance(robot.segments, int) and 2 <= robot.segments <= 4096):
        raise ValueError(f"segments is {robot.segments!r}; it must be a whole number from 2 to 4096")
    if not robot.max_tension > 0:
        raise ValueError(f"max_tension is {robot.max_tension}; it must be positive (math.inf lifts the limit)")
    object.__setattr__(robot, "touch", tuple(robot.touch))
    if not robot.touch or len(set(robot.touch)) != len(robot.touch) or not set(robot.touch) <= set(lines):
        raise ValueError(f"touch is {robot.touch}; it must name some of {lines}, each once")
    if not (isinstance(robot.between, int) and 0 <= robot.between <= 256):
        raise ValueError(f"between is {robot.between!r}; it must be a whole number from 0 to 256")


def require_positive(name: str, value: float | None) -> None:
    """Refuse what is not a positive, finite number.

    Raises:
        ValueError: Naming the value.
    """
    if value is None or not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name} is {value}; it must be positive and finite")
