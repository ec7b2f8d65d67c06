"""Shapes and tensions of robots that are not straight at rest: precurved ones, and those that carry weight or loads.

Displacements of cables are counted from the straight robot. A robot at rest is bent by a command of its own: a cable
that nothing opposes is slack up to there, and the tension grows from there on.
"""

import numpy as np

from agents.environment import EnvIndex
from agents.estimation.shape import observed_commands
from ccr_gym import Settings, SpatialSettings
from solver import Scene, Solver
from solver.spatial import SpatialSolver

STRAIGHT = 1e-6  # command below which a robot is straight [a]
AT_REST = 1e-6  # of a motor [a]


class RestingShape:
    """What many equal robots are bent by at rest.

    Args:
        settings: Settings of the environments.
        count: Number N of robots.

    Attributes:
        commands: Commands that the shape at rest tells, zero of straight robots, ``(c,)`` [a].
    """

    def __init__(self, settings: Settings | SpatialSettings, count: int) -> None:
        self.commands = rest_commands(settings)
        self._straight = not self.commands.any()
        slack = (self.commands > 0) & (settings.actuation.low >= 0)
        self._least = np.where(slack, self.commands, -np.inf)
        self._start, self._age = np.zeros((count, len(self.commands))), np.zeros(count, int)

    def reset(self, index: EnvIndex) -> None:
        """Start new episodes of some robots."""
        self._age[index] = 0

    def update(self, motors: np.ndarray, index: EnvIndex) -> None:
        """Take in the next positions of motors, ``(k, c)`` [a]; the first ones tell where the episode begins."""
        begun = np.where(np.abs(motors) < AT_REST, self.commands, motors)
        self._start[index] = np.where((self._age[index] == 0)[:, None], begun, self._start[index])
        self._age[index] += 1

    def shown(self, places: np.ndarray, latencies: np.ndarray, index: EnvIndex) -> np.ndarray:
        """Return the commands that shapes show where cables are at places, ``(k, L, c, B)`` each [a]."""
        if self._straight:
            return places
        first = (self._age[index][:, None] - 1 <= latencies)[:, :, None, None]
        start = self._start[index][:, None, :, None]
        return np.where(first, start, np.maximum(places, self._least[:, None]))

    def pulled(self, places: np.ndarray) -> np.ndarray:
        """Return by how much places ``(..., c, B)`` pull a free robot more than its own bend does [a]."""
        if self._straight:
            return places
        return np.asarray(np.maximum(places, self._least[:, None]) - self.commands[:, None])


def rest_commands(settings: Settings | SpatialSettings) -> np.ndarray:
    """Return the commands that the shape of the nominal robot at rest tells, zeros where it is straight, ``(c,)`` [a].

    Raises:
        ValueError: If its motors cannot carry its loads.
    """
    if isinstance(settings, Settings):
        nodes = Solver(settings.robot, Scene([])).rest().nodes
        seen = {"nodes": (nodes / [settings.reach_mm, settings.reach_mm, np.pi]).ravel()}
    else:
        rest = SpatialSolver(settings.robot, Scene([])).rest()
        axes = np.swapaxes(rest.frames[:, :, [0, 2]], 1, 2)
        seen = {"nodes": (rest.nodes / settings.reach_mm).ravel(), "frames": axes.ravel()}
    commands = observed_commands(seen, settings)
    return np.where(np.abs(commands) < STRAIGHT, 0.0, commands)
