"""The memory layout of equilibria in the plane."""

from solver.common.layout import PLANE, ROD, Layout, Model, make_layout
from solver.planar.robot import Robot


def layout_model(robot: Robot) -> Model:
    """Return how many numbers describe a robot."""
    return ROD if robot.model == "rod" else PLANE


def layout(robot: Robot, obstacles: int) -> Layout:
    """Return the layout for a robot among a number of obstacles."""
    return make_layout(layout_model(robot), robot.segments, len(robot.touch), robot.positions, obstacles)
