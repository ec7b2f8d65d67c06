"""The robot in space: what the solver needs to know of it, validated once."""

import math
from dataclasses import dataclass

import numpy as np

from solver.common.robot import check_cable, check_numbers, check_points, check_scale
from solver.common.validation import finite, whole

LINES = ("backbone", "holes", "rim")
LEAST_SINE = math.sin(math.radians(30) - 1e-9)  # of the angle between the cables


def sides(cables_mm: np.ndarray) -> np.ndarray:
    """Which cables of the pairs are pulled: 1 for the first ones, −1 for those opposite to them."""
    return np.where(cables_mm < 0, -1.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialRobot:
    """A cable-driven continuum robot in space, clamped at the origin and pointing along +z.

    Two pairs of cables run through its disks: the first cable at the angle 0 from +x, the second at ``angle``, and one
    opposite to each. A displacement is that of the first cable of a pair where it is positive, that of its opposite
    where it is negative; the other cable of the pair is slack and binds nothing.

    Attributes:
        length_mm: Length of the backbone, L0 [mm].
        segments: Number of segments n; nodes are 0 (clamped) to n.
        offset_mm: Distance a of the cables from the backbone [mm].
        angle: From the first cable to the second, about +z [rad]; 30° to 150° either way.
        rigidity: Flexural rigidity EI of the backbone [N·mm²]. It scales forces and tensions, never the shape.
        max_tension: Tension the motor of a cable can hold [N]; ``math.inf`` lifts the limit.
        max_cable_mm: Largest displacement of a cable [mm]; ``None`` stands for π·a / 2, a quarter turn of the tip.
        touch: The lines whose points can touch obstacles: ``"backbone"``, ``"holes"`` (of all four cables), and
            ``"rim"``, points of the edge of the disks.
        rim_points: How many points the rim has, evenly around from +x.
        between: Number of points of each line, evenly spaced between every two nodes, that can touch as well.

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
        check_numbers(self, LINES)
        object.__setattr__(self, "angle", finite("angle", self.angle))
        if abs(math.sin(self.angle)) < LEAST_SINE:
            raise ValueError(
                f"angle is {self.angle}; it must be from π/6 to 5π/6 either way: cables nearer to one plane with the "
                "backbone pull against each other, and an obstacle that turns the robot aside drives up their tension"
            )
        object.__setattr__(self, "rim_points", whole("rim_points", self.rim_points, 3, 64))
        check_scale(self, self.length_mm)
        check_points(self, self.lines * self.positions)
        check_cable(self, min(math.pi * self.offset_mm, self.length_mm) / 2)
        bound = min(self.length_mm, self.segments * self.offset_mm * abs(math.sin(self.angle)))
        if not self.cable_limit_mm < bound:
            raise ValueError(f"max_cable_mm is {self.max_cable_mm}; it must be below {bound:.6g}")

    @classmethod
    def prototype(cls, *, segments: int = 18, angle: float = math.pi / 2, max_tension: float = 15.0) -> "SpatialRobot":
        """The paper's prototype, with a second cable; of its rigidity see :meth:`solver.Robot.prototype`."""
        return cls(length_mm=180.0, segments=segments, offset_mm=8.0, angle=angle, max_tension=max_tension)

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
        """Place on the disk of the lines of ``touch``, ``(p, 2)`` [mm]."""
        first, second = self.holes[:, :2]
        turns = 2 * math.pi / self.rim_points * np.arange(self.rim_points)
        places = {
            "backbone": np.zeros((1, 2)),
            "holes": np.array([first, second, -first, -second]),
            "rim": self.offset_mm * np.column_stack([np.cos(turns), np.sin(turns)]),
        }
        return np.concatenate([places[line] for line in self.touch])

    @property
    def line_weights(self) -> np.ndarray:
        """The same as multiples of both holes, ``(p, 2)``."""
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
        """Longest distance there can be between neighbouring points of each line [mm].

        A cable turns its segment by no more than a shear up to where it has no more length to give.
        """
        segment, shared = self.segment_mm, self.cable_limit_mm / self.segments
        turned = math.sqrt(segment**2 - (segment - shared) ** 2)
        stretched = np.abs(self.line_weights).sum(axis=1) * turned
        return tuple(((segment + stretched) / (self.between + 1)).tolist())

    @property
    def energy_scale(self) -> float:
        """B = EI / 2 l0 [N·mm], which turns the objective [rad²] into energy."""
        return self.rigidity / (2 * self.segment_mm)
