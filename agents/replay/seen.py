"""Shapes that measured positions tell."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from agents.replay.log import Log
from agents.replay.model import AnyEquilibrium, Model, positions

ITERATIONS = 2  # of Gauss and Newton
FARTHEST = 0.5  # of a seen command from that of the encoders [a]
FLAT = 1e-3  # singular values of slopes that count as none [mm per mm]
TYPICAL = 90  # percentile over the rows of how uncertain a command is


class Seen(NamedTuple):
    """What measured positions tell.

    Attributes:
        shapes: The model's equilibrium that is nearest to the positions of each row.
        deviation: Standard deviation of its commands for a unit one of each coordinate [mm per mm]; None where nothing
            was measured.
    """

    shapes: Sequence[AnyEquilibrium]
    deviation: float | None


def seen_shapes(log: Log, model: Model, commands_mm: np.ndarray, nominal: Sequence[AnyEquilibrium]) -> Seen:
    """Return the shapes that the positions of a log tell, without any those at the encoders.

    Args:
        log: The log.
        model: The nominal robot.
        commands_mm: Commands that the encoders read, ``(K, commands)`` [mm].
        nominal: Equilibria at these.
    """
    if not log.nodes.size:
        return Seen(nominal, None)
    found = [_nearest(model, *row, log.nodes) for row in zip(nominal, commands_mm, log.positions_mm, strict=True)]
    shapes, deviations = zip(*found, strict=True)
    return Seen(shapes, float(np.percentile(deviations, TYPICAL)))


def _nearest(
    model: Model, equilibrium: AnyEquilibrium, command_mm: np.ndarray, measured: np.ndarray, nodes: np.ndarray
) -> tuple[AnyEquilibrium, float]:
    """Return the equilibrium nearest to measured positions ``(m, d)``, and the deviation of its commands."""
    most, at, inverse = FARTHEST * equilibrium.robot.offset_mm, command_mm, np.zeros(0)
    for _ in range(ITERATIONS):
        slopes = model.slopes(equilibrium, at, nodes).reshape(len(at), -1)
        inverse = np.linalg.pinv(slopes.T, rcond=FLAT)
        moved = at + inverse @ (measured - positions(equilibrium, nodes)).ravel()
        at = np.clip(moved, command_mm - most, command_mm + most)
        equilibrium = model.at(equilibrium, at)
    return equilibrium, float(np.linalg.norm(inverse, axis=1).max())
