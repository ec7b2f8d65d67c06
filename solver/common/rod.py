"""What a rod has beyond a robot of the paper's model: cables, segments unlike each other, precurvature and loads."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol, runtime_checkable

import numpy as np

from solver.common.robot import OFFSETS, AnyRobot
from solver.common.validation import (
    check_finite,
    check_instance,
    check_number,
    check_pair,
    check_point,
    check_positive,
    check_sequence,
    check_whole,
    is_listed,
    refusal,
)

MAX_CABLES = 12  # kMaxCables of the kernel
STIFFNESSES = (1e-3, 1e3)  # of a segment, over the robot's rigidity
MOST_LOAD = 1e4  # a load or the whole weight, over EI/L²
MOST_TURN = 1.5  # precurvature of a segment [rad]


@dataclass(frozen=True, slots=True, kw_only=True)
class Cable:
    """A cable that runs straight from disk to disk, from the base to the disk where it ends.

    Attributes:
        angle: Direction of its holes from the backbone, from +x on [rad]; in the plane 0 or π.
        offset_mm: Distance of its holes from the backbone [mm]; ``None`` stands for the robot's ``offset_mm``.
        end: Node of its last disk; ``None`` stands for the tip.

    Raises:
        ValueError: If a value is not finite, or out of range.
    """

    angle: float = 0.0
    offset_mm: float | None = None
    end: int | None = None

    def __post_init__(self) -> None:
        assign = object.__setattr__
        assign(self, "angle", check_finite("angle of a cable", self.angle, 1e3))
        if self.offset_mm is not None:
            assign(self, "offset_mm", check_positive("offset_mm of a cable", self.offset_mm))
        if self.end is not None:
            assign(self, "end", check_whole("end of a cable", self.end, 1, 4096))

    @property
    def hole_mm(self) -> tuple[float, float]:
        """Where the cable crosses the disks, from the backbone [mm]."""
        assert self.offset_mm is not None
        return self.offset_mm * math.cos(self.angle), self.offset_mm * math.sin(self.angle)


@dataclass(frozen=True, slots=True, kw_only=True)
class Load:
    """A dead load on the disk of a node: it keeps its direction in the base frame while the disk turns.

    Attributes:
        node: Node of the disk, from 1 on.
        force: Force [N].
        moment: Moment, counter-clockwise, in the plane only [N·mm]; in space a couple of two forces takes its place.
        at: Point of the disk where the force acts: its distance from the backbone [mm], and its direction from +x on
            [rad], in the plane 0 or π.

    Raises:
        ValueError: If a value is not finite, or out of range.
    """

    node: int
    force: tuple[float, ...]
    moment: float = 0.0
    at: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        assign = object.__setattr__
        assign(self, "node", check_whole("node of a load", self.node, 1, 4096))
        space = len(check_sequence("force of a load", self.force, "two or three numbers"))
        assign(self, "force", check_point("force of a load", self.force, 3 if space == 3 else 2))
        assign(self, "moment", check_finite("moment of a load", self.moment))
        assign(self, "at", check_pair("at of a load", self.at))

    @property
    def place_mm(self) -> tuple[float, float]:
        """Point of the disk where the force acts, from the backbone [mm]."""
        distance, angle = self.at
        return distance * math.cos(angle), distance * math.sin(angle)


@runtime_checkable
class AnyRod(AnyRobot, Protocol):
    """A robot whose model may be the rod; see :class:`solver.Robot` for its fields."""

    @property
    def cables(self) -> Sequence[Cable]:
        """The cables."""

    @property
    def precurvature(self) -> object:
        """Angles of each segment at rest [rad]."""

    @property
    def segment_rigidity(self) -> Sequence[float] | None:
        """EI of each segment [N·mm²]."""

    @property
    def weight_per_length(self) -> Sequence[float]:
        """Weight of a unit of length [N/mm]."""

    @property
    def loads(self) -> Sequence[Load]:
        """Dead loads on disks."""


def check_rod(robot: AnyRod, space: int, usual: tuple[Cable, ...]) -> None:
    """Check the fields of a rod, and fill in its cables; of a robot of the paper's model, that it has nothing else.

    Args:
        robot: The robot.
        space: Dimensions of a point.
        usual: Cables of the paper's model, which stand for none.

    Raises:
        ValueError: Naming the value and the bound.
        TypeError: If a cable or a load is of another class.
    """
    assign = object.__setattr__
    assign(robot, "cables", _checked_cables(robot, space, usual))
    assign(robot, "loads", _checked_loads(robot, space))
    assign(robot, "weight_per_length", _checked_weight(robot, space))
    if robot.segment_rigidity is not None:
        assign(robot, "segment_rigidity", _each_segment(robot, "segment_rigidity", robot.segment_rigidity))
        low, high = (ratio * robot.rigidity for ratio in STIFFNESSES)
        bound = f"from {low:.6g} to {high:.6g}, {STIFFNESSES} of rigidity"
        for rigidity in robot.segment_rigidity:
            check_number("an entry of segment_rigidity", rigidity, low, high, bound)
    if robot.model == "paper":
        _check_paper(robot, usual)


def _check_paper(robot: AnyRod, usual: tuple[Cable, ...]) -> None:
    for name, given in (
        ("cables", full_cables(robot) != tuple(_full(robot, cable) for cable in usual)),
        ("segment_rigidity", robot.segment_rigidity is not None),
        ("loads", bool(robot.loads)),
        ("weight_per_length", any(robot.weight_per_length)),
    ):
        if given:
            raise ValueError(f'{name} is given; the paper\'s model has no choice of it: choose model="rod"')


def _checked_cables(robot: AnyRod, space: int, usual: tuple[Cable, ...]) -> tuple[Cable, ...]:
    bound = f"at most {MAX_CABLES} of solver.Cable"
    cables = check_sequence("cables", robot.cables, bound) or usual
    if len(cables) > MAX_CABLES:
        raise refusal("cables", robot.cables, bound)
    for cable in cables:
        check_instance("an entry of cables", cable, Cable, "make it by Cable(angle=…, offset_mm=…, end=…)")
        assert isinstance(cable, Cable)
        full = _full(robot, cable)
        low, high = OFFSETS[0] * robot.longest_mm, robot.offset_mm
        check_number(
            "offset_mm of an entry of cables", full.offset_mm, low, high, f"from {low:.6g} to the robot's, {high:.6g}"
        )
        check_whole("end of an entry of cables", full.end, 1, robot.segments)
        if space == 2:
            _check_side("angle of an entry of cables", cable.angle)
    return tuple(cables)  # type: ignore[arg-type]


def _full(robot: AnyRod, cable: Cable) -> Cable:
    return _filled((cable,), robot.offset_mm, robot.segments)[0]


@lru_cache(maxsize=256)
def _filled(cables: tuple[Cable, ...], offset_mm: float, segments: int) -> tuple[Cable, ...]:
    def filled(cable: Cable) -> Cable:
        offset = offset_mm if cable.offset_mm is None else cable.offset_mm
        return replace(cable, offset_mm=offset, end=segments if cable.end is None else cable.end)

    return tuple(map(filled, cables))


def full_cables(robot: AnyRod) -> tuple[Cable, ...]:
    """Return the cables of a robot with offset and end filled in."""
    return _filled(tuple(robot.cables), robot.offset_mm, robot.segments)


def bending_ratios(robot: AnyRod) -> np.ndarray:
    """Return EI of each segment over the robot's rigidity, ``(n,)``."""
    if robot.segment_rigidity is None:
        return np.ones(robot.segments)
    return np.array(robot.segment_rigidity) / robot.rigidity


def _check_side(name: str, angle: float) -> None:
    if abs(math.sin(angle)) > 1e-9:
        raise refusal(name, angle, "0 or π in the plane")


def _checked_loads(robot: AnyRod, space: int) -> tuple[Load, ...]:
    loads = check_sequence("loads", robot.loads, "a sequence of solver.Load")
    most = MOST_LOAD * robot.rigidity / robot.longest_mm**2
    for load in loads:
        check_instance("an entry of loads", load, Load, "make it by Load(node=…, force=…)")
        assert isinstance(load, Load)
        check_whole("node of an entry of loads", load.node, 1, robot.segments)
        if len(load.force) != space:
            raise refusal("force of an entry of loads", load.force, f"{space} numbers for this robot")
        bound = f"at most {most:.6g} N in size, {MOST_LOAD:g} of EI/L²"
        check_number("force of an entry of loads", math.hypot(*load.force), 0.0, most, bound)
        if space == 3 and load.moment:
            raise refusal("moment of an entry of loads", load.moment, "0 in space: take two forces")
        check_number("moment of an entry of loads", abs(load.moment), 0.0, most * robot.longest_mm, f"{bound} times L")
        if space == 2 and load.at[0]:
            _check_side("angle of an entry of loads", load.at[1])
    return tuple(loads)  # type: ignore[arg-type]


def _checked_weight(robot: AnyRod, space: int) -> tuple[float, ...]:
    weight = check_point("weight_per_length", robot.weight_per_length, space)
    most = MOST_LOAD * robot.rigidity / robot.longest_mm**3
    check_number(
        "weight_per_length", math.hypot(*weight), 0.0, most, f"at most {most:.6g} N/mm, {MOST_LOAD:g} of EI/L³"
    )
    return weight


def _each_segment(robot: AnyRod, name: str, value: object) -> tuple[float, ...]:
    """Return numbers of the segments as a tuple of floats."""
    bound = f"a number for each of the {robot.segments} segments"
    entries = check_sequence(name, value, bound)
    if len(entries) != robot.segments:
        raise refusal(name, value, bound)
    return tuple(check_finite(f"an entry of {name}", entry) for entry in entries)


def checked_angles(robot: AnyRod, value: object) -> float | tuple[float, ...]:
    """Return the angles of the segments at rest in the plane, one for all or one for each, as given [rad].

    Raises:
        ValueError: Naming the value and the bound.
    """
    angles = _each_segment(robot, "precurvature", value if is_listed(value) else [value] * robot.segments)
    _check_turns(robot, angles)
    return angles if is_listed(value) else angles[0]


def checked_rotations(robot: AnyRod, value: object) -> tuple[float, ...] | tuple[tuple[float, ...], ...]:
    """Return the rotation vectors of the segments at rest in space, one for all or one for each, as given [rad].

    Raises:
        ValueError: Naming the value and the bound.
    """
    bound = f"a rotation vector, or one for each of the {robot.segments} segments"
    rows = check_sequence("precurvature", value, bound)
    one = not (rows and is_listed(rows[0]))
    rows = [rows] * robot.segments if one else rows
    if len(rows) != robot.segments:
        raise refusal("precurvature", value, bound)
    vectors = tuple(check_point("an entry of precurvature", row, 3) for row in rows)
    _check_turns(robot, tuple(math.hypot(*vector) for vector in vectors))
    return vectors[0] if one else vectors


def _check_turns(robot: AnyRod, angles: tuple[float, ...]) -> None:
    for angle in angles:
        check_number("an angle of precurvature", abs(angle), 0.0, MOST_TURN, f"at most {MOST_TURN} rad in size")
    if robot.model == "paper" and any(angles):
        raise ValueError('precurvature is given; the paper\'s model has no choice of it: choose model="rod"')


def check_cables(robot: AnyRobot, name: str, cables_mm: object) -> tuple[float, ...]:
    """Return commanded displacements of the cables as floats; of a single cable it may be a number.

    Raises:
        ValueError: Naming the value and the bound.
    """
    count, low, high = len(robot.cables), robot.least_cable_mm, robot.cable_limit_mm
    bound = f"from {low:.6g} to {high:.6g} (robot.max_cable_mm)"
    if count == 1 and not is_listed(cables_mm):
        return (check_number(name, cables_mm, low, high, bound),)
    bound = f"{count} number{'s' * (count > 1)}, {bound}"
    entries = check_sequence(name, cables_mm, bound)
    if len(entries) != count:
        raise refusal(name, cables_mm, bound)
    return tuple(check_number(f"an entry of {name}", entry, low, high, bound) for entry in entries)
