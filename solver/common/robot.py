"""Checks of a robot that the plane and space share, and what both kinds of robot offer."""

import math
from collections.abc import Sequence, Sized
from typing import Any, Protocol

from solver.common.validation import SMALLEST, number, positive, sequence, shown, whole

RIGIDITIES = (1e-60, 1e60)  # that leave EI/L² and EI/2l0, and the squares of forces, normal numbers [N·mm²]
OFFSETS = (1e-4, 10.0)  # over the longest length: nearer ones leave too few digits of a cable's share
LEAST_TENSION = 1e-6  # a limit of tension, over EI/(aL): the robot cannot bend below it
LEAST_CABLE = 1e-6  # the largest displacement, over a
MAX_POINTS = 2**18  # that can touch: of all lines together


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

    @property
    def longest_mm(self) -> float:
        """Longest length of the backbone [mm]."""

    @property
    def rigidity(self) -> float:
        """Flexural rigidity EI of the backbone [N·mm²]."""


def check_numbers(robot: Any, lines: tuple[str, ...]) -> None:
    """Refuse what no robot can have; its numbers become floats and ints, its ``touch`` a tuple, of some of these lines.

    Raises:
        ValueError: Naming the value and the bound.
    """
    assign = object.__setattr__
    for name in ("length_mm", "offset_mm"):
        assign(robot, name, positive(name, getattr(robot, name)))
    assign(robot, "rigidity", positive("rigidity", robot.rigidity, *RIGIDITIES))
    assign(robot, "segments", whole("segments", robot.segments, 2, 4096))
    assign(robot, "between", whole("between", robot.between, 0, 256))
    bound = "positive (math.inf lifts the limit)"
    assign(robot, "max_tension", number("max_tension", robot.max_tension, SMALLEST, math.inf, bound))
    wanted = f"a tuple of some of {lines}, each once, as ({lines[0]!r},)"
    touch = sequence("touch", robot.touch, wanted)
    named = all(isinstance(line, str) and line in lines for line in touch)
    if not touch or not named or len(set(touch)) != len(touch):
        raise ValueError(f"touch is {shown(robot.touch)}; it must be {wanted}")
    assign(robot, "touch", tuple(touch))


def check_scale(robot: Any, longest: float) -> None:
    """Refuse numbers that are out of all proportion to the robot's longest length.

    Raises:
        ValueError: Naming the value and the bound.
    """
    low, high = (ratio * longest for ratio in OFFSETS)
    number("offset_mm", robot.offset_mm, low, high, f"from {low:.6g} to {high:.6g}, {OFFSETS} of the longest length")
    least = LEAST_TENSION * robot.rigidity / (robot.offset_mm * longest)
    bound = f"at least {least:.6g}, {LEAST_TENSION} of EI/(a·L), to bend the robot at all (math.inf lifts the limit)"
    number("max_tension", robot.max_tension, least, math.inf, bound)


def check_points(robot: Any, count: int) -> None:
    """Refuse more points that can touch than there is room for.

    Raises:
        ValueError: Naming the numbers and the bound.
    """
    if count > MAX_POINTS:
        raise ValueError(
            f"segments is {robot.segments} and between is {robot.between}; with {len(robot.touch)} kinds of lines in "
            f"touch these are {count} points that can touch, and at most {MAX_POINTS} are allowed: divide less finely"
        )


def check_cable(robot: Any, default: float) -> None:
    """Fill in the largest displacement of a cable, and refuse one that is no number or too small to matter.

    Raises:
        ValueError: Naming the value and the bound.
    """
    largest = default if robot.max_cable_mm is None else positive("max_cable_mm", robot.max_cable_mm)
    least = LEAST_CABLE * robot.offset_mm
    number("max_cable_mm", largest, least, math.inf, f"at least {least:.6g}, {LEAST_CABLE} of offset_mm")
    object.__setattr__(robot, "max_cable_mm", largest)
