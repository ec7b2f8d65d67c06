"""Where branches end for good, by the shape and the node-coordinate problem alone, which share nothing with the kernel.

A motion ``dz`` of the nodes and a change ``dp`` of the command keep every segment whole where ``A dz + h_p dp = 0``,
and enter no obstacle where ``G dz >= 0`` for the closed gaps. Where ``Gᵀν = Aᵀy`` with ``ν >= 0``, each such motion has
``yᵀ h_p dp = −νᵀ G dz <= 0``: none meets a command for which it is positive (Farkas' lemma). That is to first order.
Where a branch of stable shapes ends so, the multipliers grow without bound, and the curvature of the gaps, which alone
decides then about stability, rules out motions of second order.
"""

import numpy as np
from scipy.optimize import nnls

CLOSED = 1e-9  # of the robot's length: a gap that is
SMALL_CHANGE = 1e-6  # of the way to a command, for a difference quotient
BALANCED = (
    1e-4  # of the slopes: ten times the bound of the kernel, in another norm; ordinary contacts have 0.06 and more
)
MEETING = 1e-6  # of a segment's length: distance of the holes of a cable that meet


def is_wedged(state, command):
    """Return whether closed gaps, whatever the energy, keep a state from going towards a command (cables, length)."""
    residual, closing = wedge(state, command)
    return residual <= BALANCED and closing > 0


def wedge(state, command):
    """Return ``|Gᵀν − Aᵀy|`` over the slopes, where Σν = 1, and ``yᵀ h_p dp`` of a command [mm]."""
    unknowns, parameters = state._node_point()
    _, shapes, shape_slopes, clearance, slopes = (part.full() for part in state._derivatives(unknowns, parameters))
    cables = len(state.robot.cables) if state.robot.model == "rod" else 0  # which motors let out; disks that meet hold
    closed = cables + np.flatnonzero(clearance[cables:] <= CLOSED * state.robot.longest_mm)
    if not closed.size:
        return np.inf, 0.0
    slopes = slopes[closed].T
    weights = np.linalg.lstsq(shape_slopes.T, slopes, rcond=None)[0]
    free = (slopes - shape_slopes.T @ weights) / np.linalg.norm(slopes)  # what no segment takes up, a column a gap
    multipliers, _ = nnls(np.vstack([free, np.ones(closed.size)]), np.append(np.zeros(len(free)), 1.0))
    multipliers /= multipliers.sum()
    present = np.array([*state.cables_mm, state.length_mm])
    moved = parameters.copy()
    moved[: present.size] += SMALL_CHANGE * (command - present)
    change = (state._derivatives(unknowns, moved)[1].full() - shapes).ravel() / SMALL_CHANGE
    return float(np.linalg.norm(free @ multipliers)), float(weights @ multipliers @ change)


def holes_meet(state):
    """Return whether two neighbouring holes of a taut cable of a rod in space coincide.

    The length of the cable has no slope there. Disks without thickness that are as wide as the cables are offset meet
    in such a place, and in no other.
    """
    robot = state.robot
    holes = state.nodes[:, None] + np.einsum("nij,cj->nci", state.frames[..., :2], np.array(robot.cable_holes_mm))
    apart = np.linalg.norm(np.diff(holes, axis=0), axis=-1)  # (segments, cables)
    ends = [cable.end or robot.segments for cable in robot.cables]
    threaded = np.arange(robot.segments)[:, None] < np.array(ends)
    taut = state.tensions > 0
    return bool(np.any(threaded & taut & (apart <= MEETING * state.length_mm / robot.segments)))
