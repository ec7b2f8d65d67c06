"""What robots of the plane and of space have in common, and the checks they share."""

import math
from collections.abc import Callable, Sequence, Sized
from functools import lru_cache, wraps
from typing import Any, Protocol, TypeVar, runtime_checkable

from solver.common.validation import SMALLEST, check_number, check_positive, check_sequence, check_whole, refusal

T = TypeVar("T")
RIGIDITIES = (1e-60, 1e60)  # that leave EI/L² and EI/2l0, and the squares of forces, normal numbers [N·mm²]
OFFSETS = (1e-4, 10.0)  # over the longest length: nearer cables leave too few digits of their share
LEAST_TENSION = 1e-6  # a limit of tension, over EI/(aL): the robot cannot bend below it
LEAST_CABLE = 1e-6  # the largest cable displacement, over a
MODELS = ("paper", "rod")
THICKEST = 0.9  # thickness of a disk, over the segment at its shortest
THIRDS = 80  # of the range of angles in the search for the longest edge of a bent segment
MAX_POINTS = 2**18  # that can touch, on all lines together


def kept_for_robots(function: Callable[[Any], T]) -> Callable[[Any], T]:
    """Keep what a function returns for robots; for the last one it is found without looking at its fields."""
    found = lru_cache(maxsize=64)(function)
    last: list[tuple[Any, Any]] = [(None, None)]

    @wraps(function)
    def find(robot: Any) -> Any:
        known, value = last[0]
        if known is not robot:
            value = found(robot)
            last[0] = robot, value
        return value

    return find


@runtime_checkable
class AnyRobot(Protocol):
    """A robot of the plane or of space; see :class:`solver.Robot` for its fields."""

    @property
    def length_mm(self) -> float:
        """Length of the backbone at rest, L0 [mm]."""

    @property
    def shortest_mm(self) -> float:
        """Shortest length of the backbone [mm]."""

    @property
    def longest_mm(self) -> float:
        """Longest length of the backbone [mm]."""

    @property
    def segments(self) -> int:
        """Number of segments."""

    @property
    def disk_radius_mm(self) -> float | None:
        """Radius of the disks of a rod as given [mm]."""

    @property
    def edge_mm(self) -> float:
        """``disk_radius_mm`` with its default filled in [mm]."""

    @property
    def disk_thickness_mm(self) -> float:
        """Thickness of the disks of a rod [mm]."""

    @property
    def offset_mm(self) -> float:
        """Distance a of the cables from the backbone [mm]."""

    @property
    def rigidity(self) -> float:
        """Flexural rigidity EI of the backbone [N·mm²]."""

    @property
    def max_tension(self) -> float:
        """Cable tension the motor can hold [N]."""

    @property
    def max_cable_mm(self) -> float | None:
        """Largest cable displacement as given [mm]."""

    @property
    def model(self) -> str:
        """``"paper"`` or ``"rod"``."""

    @property
    def cables(self) -> Sized:
        """The cables, in the paper's model of space pairs of them."""

    @property
    def least_cable_mm(self) -> float:
        """Least displacement of a cable [mm]."""

    @property
    def cable_limit_mm(self) -> float:
        """``max_cable_mm`` with its default filled in [mm]."""

    @property
    def touch(self) -> tuple[str, ...]:
        """Names of the lines whose points can touch obstacles."""

    @property
    def between(self) -> int:
        """Number of points of a line between every two nodes."""

    @property
    def lines_mm(self) -> Sized:
        """Positions on the disk of the lines of points that can touch [mm]."""

    @property
    def positions(self) -> int:
        """Number of points of a line that can touch, node 0 included."""

    @property
    def edges_mm(self) -> Sequence[float]:
        """Largest possible distance between neighbouring points of each line [mm]."""


def check_fields(robot: AnyRobot, lines: tuple[str, ...]) -> None:
    """Check the fields that all robots have; numbers become floats and ints, ``touch`` a tuple of some of the lines.

    Raises:
        ValueError: Naming the value and the bound.
    """
    assign = object.__setattr__
    for name in ("length_mm", "offset_mm"):
        assign(robot, name, check_positive(name, getattr(robot, name)))
    assign(robot, "rigidity", check_positive("rigidity", robot.rigidity, *RIGIDITIES))
    assign(robot, "segments", check_whole("segments", robot.segments, 2, 4096))
    assign(robot, "between", check_whole("between", robot.between, 0, 256))
    bound = "positive (math.inf lifts the limit)"
    assign(robot, "max_tension", check_number("max_tension", robot.max_tension, SMALLEST, math.inf, bound))
    bound = f"a tuple of some of {lines}, each once, as ({lines[0]!r},)"
    touch = check_sequence("touch", robot.touch, bound)
    named = all(isinstance(line, str) and line in lines for line in touch)
    if not touch or not named or len(set(touch)) != len(touch):
        raise refusal("touch", robot.touch, bound)
    assign(robot, "touch", tuple(touch))


def check_proportions(robot: AnyRobot) -> None:
    """Check offset and tension limit in proportion to the robot's longest length.

    Raises:
        ValueError: Naming the value and the bound.
    """
    longest = robot.longest_mm
    low, high = (ratio * longest for ratio in OFFSETS)
    bound = f"from {low:.6g} to {high:.6g}, {OFFSETS} of the longest length"
    check_number("offset_mm", robot.offset_mm, low, high, bound)
    least = LEAST_TENSION * robot.rigidity / (robot.offset_mm * longest)
    bound = f"at least {least:.6g}, {LEAST_TENSION} of EI/(a·L), to bend the robot at all (math.inf lifts the limit)"
    check_number("max_tension", robot.max_tension, least, math.inf, bound)


def check_point_count(robot: AnyRobot, count: int) -> None:
    """Check that the points that can touch are not too many.

    Raises:
        ValueError: Naming the numbers and the bound.
    """
    if count > MAX_POINTS:
        raise ValueError(
            f"segments is {robot.segments} and between is {robot.between}; with {len(robot.touch)} kinds of lines in "
            f"touch these are {count} points that can touch, and at most {MAX_POINTS} are allowed: lower either"
        )


def check_cable_limit(robot: AnyRobot) -> None:
    """Check that the largest cable displacement is not negligible.

    Raises:
        ValueError: Naming the value and the bound.
    """
    if robot.max_cable_mm is not None:
        object.__setattr__(robot, "max_cable_mm", check_positive("max_cable_mm", robot.max_cable_mm))
    least = LEAST_CABLE * robot.offset_mm
    bound = f"at least {least:.6g}, {LEAST_CABLE} of offset_mm"
    check_number("max_cable_mm", robot.cable_limit_mm, least, math.inf, bound)


def check_model(model: object) -> None:
    """Check the name of a model.

    Raises:
        ValueError: Naming the value and the names.
    """
    if not (isinstance(model, str) and model in MODELS):
        raise refusal("model", model, f"one of {', '.join(MODELS)}")


def check_disks(robot: AnyRobot) -> None:
    """Check the radius of the disks and their thickness in proportion to the robot.

    Raises:
        ValueError: Naming the value and the bound.
    """
    low, high = (ratio * robot.longest_mm for ratio in OFFSETS)
    bound = f"from {low:.6g} to {high:.6g}, {OFFSETS} of the longest length"
    if robot.disk_radius_mm is not None:
        radius = check_number("disk_radius_mm", robot.disk_radius_mm, low, high, bound)
        object.__setattr__(robot, "disk_radius_mm", radius)
    most = THICKEST * robot.shortest_mm / robot.segments
    bound = f"from 0 to {most:.6g}, {THICKEST} of a segment's length"
    thickness = check_number("disk_thickness_mm", robot.disk_thickness_mm, 0.0, most, bound)
    object.__setattr__(robot, "disk_thickness_mm", thickness)


def widest_bend(segment: float, disk_radius: float, disk_thickness: float) -> float:
    """Return the angle by which a segment of the rod can bend before its disks meet, at most half a turn [rad]."""
    return min((segment - disk_thickness) / disk_radius, math.pi)


def longest_arc_edge(segment: float, line: float, widest: float) -> float:
    """Return the longest distance of neighbouring nodes of a line beside an arc, on its outer side [mm].

    Args:
        segment: Length of the arc [mm].
        line: Distance of the line from the backbone [mm].
        widest: Largest angle of the arc [rad].
    """
    low, high = 0.0, widest
    for _ in range(THIRDS):  # concave, so the larger of two values tells where the largest is not
        left, right = low + (high - low) / 3, high - (high - low) / 3
        shorter = _arc_edge(segment, line, left) < _arc_edge(segment, line, right)
        low, high = (left, high) if shorter else (low, right)
    return max(_arc_edge(segment, line, angle) for angle in (high, widest))


def _arc_edge(segment: float, line: float, angle: float) -> float:
    return 2 * (segment / angle + abs(line)) * math.sin(angle / 2)
