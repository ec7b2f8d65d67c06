"""Copies of solvers, in this process or another."""

from solver.common.robot import AnyRobot
from solver.common.scene import Scene


class RebuiltFromScene:
    """Base class of solvers, which are copied and pickled as their robot and scene and keep nothing else.

    What a solver has compiled is made anew, so a copy gives the same results bit for bit, in another process too, and
    reading one from a file runs no code beyond what pickle itself does.
    """

    robot: AnyRobot
    scene: Scene

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        return type(self), (self.robot, self.scene)
