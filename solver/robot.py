"""The robot: what the solver needs to know of it, validated once."""

import math
from dataclasses import dataclass

LINES = ("backbone", "cable", "rim")


@dataclass(frozen=True, slots=True, kw_only=True)
class Robot:
    """A planar cable-driven continuum robot, clamped at the origin and pointing along +y, its cable on the +x side.

    Attributes:
        length_mm: Length of the backbone, L0 [mm].
        segments: Number of segments n the backbone is divided into; nodes are 0 (clamped) to n.
        offset_mm: Distance a of the cable from the backbone [mm].
        rigidity: Flexural rigidity EI of the backbone [N·mm²]. It scales forces and tension, never the shape.
        max_tension: Cable tension the motor can hold [N]; ``math.inf`` lifts the limit.
        max_cable_mm: Largest cable displacement [mm]; ``None`` stands for π·a, half a turn of the tip.
        touch: The lines whose points can touch obstacles: ``"backbone"``, ``"cable"`` (both in the paper), and
            ``"rim"``, the edge of the disks opposite to the cable.
        between: Number of points of each line, evenly spaced between every two nodes, that can touch as well.

    Raises:
        ValueError: If a value is not finite, not positive, or out of range; the message names the bound.
    """

    length_mm: float
    segments: int
    offset_mm: float
    rigidity: float = 5000.0
    max_tension: float = 15.0
    max_cable_mm: float | None = None
    touch: tuple[str, ...] = ("backbone", "cable")
    between: int = 0

    def __post_init__(self) -> None:
        for name in ("length_mm", "offset_mm", "rigidity"):
            require_positive(name, getattr(self, name))
        object.__setattr__(self, "touch", tuple(self.touch))
        if not self.touch or len(set(self.touch)) != len(self.touch) or not set(self.touch) <= set(LINES):
            raise ValueError(f"touch is {self.touch}; it must name some of {LINES}, each once")
        if not (isinstance(self.between, int) and 0 <= self.between <= 256):
            raise ValueError(f"between is {self.between!r}; it must be a whole number from 0 to 256")
        if not self.max_tension > 0:
            raise ValueError(f"max_tension is {self.max_tension}; it must be positive (math.inf lifts the limit)")
        if not (isinstance(self.segments, int) and 2 <= self.segments <= 4096):
            raise ValueError(f"segments is {self.segments!r}; it must be a whole number from 2 to 4096")
        if self.max_cable_mm is None:
            object.__setattr__(self, "max_cable_mm", min(math.pi * self.offset_mm, 0.5 * self.length_mm))
        require_positive("max_cable_mm", self.max_cable_mm)
        bound = min(self.length_mm, 2 * self.segments * self.offset_mm)
        if not self.cable_limit_mm < bound:
            raise ValueError(
                f"max_cable_mm is {self.max_cable_mm}; it must be below {bound} "
                "(the backbone's length, and the disks' reach 2·n·a)"
            )

    @classmethod
    def prototype(cls, *, max_tension: float = 15.0, segments: int = 18) -> "Robot":
        """The paper's 3-D printed prototype: 180 mm, a = 8 mm, 18 segments.

        The paper gives no rigidity. 5000 N·mm² is an assumption of this project: 350 gf on the cable then bend the
        free robot by about 8 mm of cable displacement.
        """
        return cls(length_mm=180.0, segments=segments, offset_mm=8.0, max_tension=max_tension)

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
    def spacing_mm(self) -> float:
        """Distance between neighbouring points of the backbone that can touch [mm]."""
        return self.segment_mm / (self.between + 1)

    @property
    def stiffness(self) -> float:
        """B = EI / 2 l0 [N·mm], which turns the objective J = Σθ² [rad²] into energy."""
        return self.rigidity / (2 * self.segment_mm)

    @property
    def cable_limit_mm(self) -> float:
        """``max_cable_mm`` with its default filled in [mm]."""
        assert self.max_cable_mm is not None
        return self.max_cable_mm


def require_positive(name: str, value: float | None) -> None:
    """Refuse what is not a positive, finite number.

    Raises:
        ValueError: Naming the value.
    """
    if value is None or not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name} is {value}; it must be positive and finite")
