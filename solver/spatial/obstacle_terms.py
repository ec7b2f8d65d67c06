"""What obstacles add to a node-coordinate problem in space: gaps of all points that can touch, and springs."""

import itertools
from typing import NamedTuple

import casadi as ca

from solver.common.gap_laws import GapLaw, PointGaps
from solver.common.node_problem import grow, subdivide

MOTIONS = 7  # components of an obstacle's change: shift, turns, growth
SPRING_SIZE = 6  # upper entries of the stiffness of a spring


class ObstacleSymbols(NamedTuple):
    """Symbols of the obstacles in a node-coordinate problem.

    Attributes:
        laws: Gap laws.
        mounted: Which are on springs.
        displacements: Displacements of those, one after the other [mm].
        parameters: Their shapes, one after the other, then the stiffness of those on springs.
        change: Change of each, :data:`MOTIONS` numbers; ``None`` for none.
    """

    laws: tuple[GapLaw, ...]
    mounted: tuple[bool, ...]
    displacements: ca.MX
    parameters: ca.MX
    change: ca.MX | None


def parameter_count(laws: tuple[GapLaw, ...], mounted: tuple[bool, ...]) -> int:
    """Return how many parameters the obstacles have."""
    return sum(law.size for law in laws) + SPRING_SIZE * sum(mounted)


def obstacle_terms(
    symbols: ObstacleSymbols, lines: list[ca.MX], between: int, energy_scale: ca.MX
) -> tuple[ca.MX, list[PointGaps]]:
    """Return the energy of the springs over ``B = EI / 2 l0`` [rad²], and the gaps of the points of lines.

    The gaps are ordered (obstacle, line, position), without node 0.
    """
    laws, mounted, displacements, parameters, change = symbols
    starts = list(itertools.accumulate((law.size for law in laws), initial=0))
    displacements = ca.reshape(displacements, 3, -1)
    springs = ca.reshape(parameters[starts[-1] :], SPRING_SIZE, -1)
    points = [subdivide(line, between)[:, 1:] for line in lines]
    energy, gaps = ca.MX(0), list[PointGaps]()
    for j, law in enumerate(laws):
        own = None if change is None else change[MOTIONS * j : MOTIONS * (j + 1)]
        shape, shift, turn = _moved(law, parameters[starts[j] : starts[j + 1]], own)
        if mounted[j]:
            mount = sum(mounted[:j])
            moved = displacements[:, mount]
            energy += _twice_spring_energy(springs[:, mount], moved) / (2 * energy_scale)
            shift = shift + moved
        gaps += [PointGaps(law, turn.T @ (line - ca.repmat(shift, 1, line.shape[1])), shape) for line in points]
    return energy, gaps


def _moved(law: GapLaw, shape: ca.MX, change: ca.MX | None) -> tuple[ca.MX, ca.MX, ca.MX]:
    """Return the shape, shift and rotation of an obstacle after a change of its own, to second order in the turns."""
    if change is None:
        return shape, ca.MX.zeros(3), ca.MX.eye(3)
    turns = ca.skew(change[3:6])
    return grow(law, shape, change[6]), change[:3], ca.MX.eye(3) + turns + turns @ turns / 2


def _twice_spring_energy(spring: ca.MX, moved: ca.MX) -> ca.MX:
    """Return twice the energy of a spring, given by its six upper entries [N·mm]."""
    xx, xy, xz, yy, yz, zz = ca.vertsplit(spring)
    matrix = ca.vertcat(ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz))
    return ca.dot(moved, matrix @ moved)
