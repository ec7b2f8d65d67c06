"""The memory layout of equilibria in the plane."""

from solver.common.layout import PLANE, Layout, make_layout
from solver.planar.robot import Robot


def layout(robot: Robot, obstacles: int) -> Layout:
    """Return the layout for a robot among a number of obstacles."""
    sizes = robot.segments, len(robot.cables), len(robot.lines_mm), robot.positions
    return make_layout(PLANE[robot.model], *sizes, obstacles)
