"""The memory layout of equilibria in the plane."""

from solver.common.layout import PLANE, SLIDING, Layout, make_layout
from solver.planar.robot import Robot


def layout(robot: Robot, obstacles: int) -> Layout:
    """The layout for a robot among a number of obstacles."""
    model = SLIDING if robot.model == "rod" else PLANE
    return make_layout(model, robot.segments, len(robot.touch), robot.positions, obstacles)
