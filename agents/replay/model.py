"""The nominal robot, led along the displacements of a log."""

from collections.abc import Iterable
from dataclasses import replace
from math import inf

import numpy as np

from agents.replay.commands import actuation_of
from agents.replay.robots import AnyRobot
from solver import Equilibrium, Robot, Scene, Solver
from solver.spatial import SpatialEquilibrium, SpatialSolver

AnyEquilibrium = Equilibrium | SpatialEquilibrium
DIFFERENCE = 1e-4  # of a command, for slopes [a]


def followed(robot: AnyRobot) -> AnyRobot:
    """Return the robot without a tension limit: where the log says that a cable was, there it was."""
    return replace(robot, max_tension=inf)


class Model:
    """The nominal robot among its obstacles, which follows commands.

    Args:
        robot: The robot, as of :func:`followed`.
        scene: The obstacles.
    """

    def __init__(self, robot: AnyRobot, scene: Scene) -> None:
        self._solver = Solver(robot, scene) if isinstance(robot, Robot) else SpatialSolver(robot, scene)
        self._actuation, self._limits = actuation_of(robot), (robot.least_cable_mm, robot.cable_limit_mm)
        self._now = self._solver.rest()
        self._difference = DIFFERENCE * robot.offset_mm

    def path(self, commands_mm: np.ndarray) -> Iterable[AnyEquilibrium]:
        """Yield the equilibria at commands ``(K, commands)``, one after the other [mm]."""
        for command in commands_mm:
            self._now = self._step(self._now, command)
            yield self._now

    def slopes(self, equilibrium: AnyEquilibrium, command_mm: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        """Return by how much nodes move with each command, ``(commands, m, d)`` [mm per mm]."""
        ways = np.where(command_mm > 0, -self._difference, self._difference)
        ends = (self._step(equilibrium, command_mm + way) for way in np.diag(ways))
        start = positions(equilibrium, nodes)
        return np.stack([(positions(end, nodes) - start) / way for end, way in zip(ends, ways, strict=True)])

    def at(self, equilibrium: AnyEquilibrium, command_mm: np.ndarray) -> AnyEquilibrium:
        """Return the equilibrium that a command leads to from another one."""
        return self._step(equilibrium, command_mm)

    def _step(self, equilibrium: AnyEquilibrium, command_mm: np.ndarray) -> AnyEquilibrium:
        cables = np.clip(self._actuation.cables_mm(command_mm), *self._limits)
        reached: AnyEquilibrium = self._solver.step(equilibrium, cables.tolist())  # type: ignore[arg-type]
        return reached


def positions(equilibrium: AnyEquilibrium, nodes: np.ndarray) -> np.ndarray:
    """Return the positions of nodes, ``(m, d)`` [mm]."""
    space = 2 if isinstance(equilibrium, Equilibrium) else 3
    return np.asarray(equilibrium.nodes[nodes, :space])
