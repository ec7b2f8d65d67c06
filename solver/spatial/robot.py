"""Description of the robot in space, validated on construction."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from solver.common.robot import check_cable_limit, check_fields, check_point_count, check_proportions
from solver.common.validation import check_finite, check_whole

LINES = ("backbone", "holes", "rim")
LEAST_SINE = math.sin(math.radians(30) - 1e-9)  # of the angle between the cables


def sides(cables_mm: np.ndarray) -> np.ndarray:
    """Return which cable of each pair is pulled: 1 for the first one, −1 for the one opposite to it."""
    return np.where(cables_mm < 0, -1.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialRobot:
    """A cable-driven continuum robot in space, clamped at the origin and pointing along +z.

    Two pairs of cables run through its disks: the first cable at the angle 0 from +x, the second at ``angle``, and one
    opposite to each. A positive displacement pulls the first cable of a pair, a negative one its opposite; the other
    cable of the pair is slack and exerts no force.

    Attributes:
        length_mm: Length of the backbone, L0 [mm].
        segments: Number of segments n; nodes are 0 (clamped) to n.
        offset_mm: Distance a of the cables from the backbone [mm].
        angle: Angle from the first cable to the second, about +z [rad]; 30° to 150° either way.
        rigidity: Flexural rigidity EI of the backbone [N·mm²]. It scales forces and tensions, never the shape.
        max_tension: Tension the motor of a cable can hold [N]; ``math.inf`` lifts the limit.
        max_cable_mm: Largest displacement of a cable [mm]; ``None`` stands for π·a / 2, which turns the tip by 90°,
            but at most half the length.
        touch: Lines whose points can touch obstacles: ``"backbone"``, ``"holes"`` (those of all four cables), and
            ``"rim"``, points of the edge of the disks.
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

    def __post_init__(self) -> None:
        check_fields(self, LINES)
        object.__setattr__(self, "angle", check_finite("angle", self.angle))
        if abs(math.sin(self.angle)) < LEAST_SINE:
            raise ValueError(
                f"angle is {self.angle}; it must be from π/6 to 5π/6 either way: nearer to one plane, the "
                "cables pull against each other, and an obstacle that turns the robot aside drives up their tension"
            )
        object.__setattr__(self, "rim_points", check_whole("rim_points", self.rim_points, 3, 64))
        check_proportions(self)
        check_point_count(self, self.lines * self.positions)
        check_cable_limit(self, min(math.pi * self.offset_mm, self.length_mm) / 2)
        bound = min(self.length_mm, self.segments * self.offset_mm * abs(math.sin(self.angle)))
        if not self.cable_limit_mm < bound:
            raise ValueError(
                f"max_cable_mm is {self.max_cable_mm}; it must be below {bound:.6g} "
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

    @property
    def cable_limit_mm(self) -> float:
        """``max_cable_mm`` with its default filled in [mm]."""
        assert self.max_cable_mm is not None
        return self.max_cable_mm

    @property
    def holes(self) -> np.ndarray:
        """First and second hole of the base disk, ``(2, 3)`` [mm]."""
        turned = self.offset_mm * np.array([math.cos(self.angle), math.sin(self.angle), 0.0])
        return np.array([[self.offset_mm, 0.0, 0.0], turned])

    @property
    def lines_mm(self) -> np.ndarray:
        """Positions on the disk of the lines of ``touch``, ``(p, 2)`` [mm]."""
        first, second = self.holes[:, :2]
        turns = 2 * math.pi / self.rim_points * np.arange(self.rim_points)
        positions = {
            "backbone": np.zeros((1, 2)),
            "holes": np.array([first, second, -first, -second]),
            "rim": self.offset_mm * np.column_stack([np.cos(turns), np.sin(turns)]),
        }
        return np.concatenate([positions[line] for line in self.touch])

    @property
    def line_weights(self) -> np.ndarray:
        """Positions of the lines of ``touch`` as multiples of both holes, ``(p, 2)``."""
        return np.asarray(np.linalg.solve(self.holes[:, :2].T, self.lines_mm.T).T)

    @property
    def lines(self) -> int:
        """Number of lines of points."""
        counts = {"backbone": 1, "holes": 4, "rim": self.rim_points}
        return sum(counts[line] for line in self.touch)

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

        A segment shears at most up to where its cable has no more length to give.
        """
        segment, shared = self.segment_mm, self.cable_limit_mm / self.segments
        turned = math.sqrt(segment**2 - (segment - shared) ** 2)
        stretched = np.abs(self.line_weights).sum(axis=1) * turned
        return tuple(((segment + stretched) / (self.between + 1)).tolist())

    @property
    def energy_scale(self) -> float:
        """Scale B = EI / 2 l0 [N·mm] of the elastic energy, B times the objective [rad²]."""
        return self.rigidity / (2 * self.segment_mm)
