"""Points of a robot in the plane that can touch obstacles."""

import numpy as np

from solver.common.geometry import divided
from solver.planar.robot import Robot


def touching_points(robot: Robot, nodes: np.ndarray) -> np.ndarray:
    """The points of ``robot.touch``, ``(lines, positions, 2)`` [mm], of node poses ``(n+1, 3)``.

    Those between two nodes divide the straight line between their points evenly.
    """
    disks = np.column_stack([np.cos(nodes[:, 2]), np.sin(nodes[:, 2])])
    return divided(nodes[:, :2] + np.array(robot.lines_mm)[:, None, None] * disks, robot.between)
