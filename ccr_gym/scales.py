"""Natural units of a robot, in which tasks, sensors, rewards and observations are scaled.

A robot and a scene that are s times as large, with an s² times as large rigidity, move alike under the same forces. So
nothing in an environment is a number of millimetres or newtons: it is a multiple of one of these.
"""

from typing import NamedTuple

from solver import Robot
from solver.common.robot import AnyRobot
from solver.common.validation import check_instance
from solver.spatial import SpatialRobot

FORCE_SPAN = 10.0  # force on a robot of one section that is observed as 1 [EI/L²]
TENSION_SPAN = 10.0  # tension of a robot of one section that is observed as 1 [EI/(aL)]
RADIUS_SPAN = 1 / 9  # obstacle radius that is observed as 1 [L]
ROBOTS = (Robot, SpatialRobot)
AHEAD = (2, 4, 8)  # steps ahead at which a moving set-point is observed


class Scales(NamedTuple):
    """Natural units of a robot.

    Attributes:
        length_mm: Its length at rest L [mm].
        travel_mm: Cable displacement that bends it by a radian, the offset a of its cables [mm].
        force_n: EI/L²: a side force of this size at the tip of a cantilever deflects it by a third of its length [N].
        tension_n: EI/(aL): cable tension that bends it by a radian [N].
    """

    length_mm: float
    travel_mm: float
    force_n: float
    tension_n: float

    @classmethod
    def of(cls, robot: AnyRobot) -> "Scales":
        """Return the natural units of a robot.

        Raises:
            TypeError: If it is no robot.
        """
        if not isinstance(robot, ROBOTS):  # to look for all that a robot has takes longer than all else of a reset
            check_instance("robot", robot, AnyRobot, "take a solver.Robot or solver.spatial.SpatialRobot")
        length, offset, rigidity = robot.length_mm, robot.offset_mm, robot.rigidity
        return cls(length, offset, rigidity / length / length, rigidity / offset / length)
