"""Verdicts of the solver, as data."""

from enum import IntEnum


class Status(IntEnum):
    """How a step of the solver ended. Every verdict comes with a valid equilibrium.

    A step that both snaps and stalls or jams is reported by how it ended. A small snap that a single increment carries
    past, with no node moving more than 0.5 mm + 16 times the increment and 8.5 mm at most, is not told from ordinary
    motion.
    """

    CONVERGED = 0
    """The commanded cable displacement was reached along the branch."""
    SNAPPED = 1
    """The equilibrium turned unstable on the way; the robot moved to the one it reaches physically."""
    STALLED = 2
    """The cable tension reached the robot's limit, or would exceed it in a snap; the cable moved as far as that.

    Where a release ends in a snap to more tension than the motor holds, it yields: the cable goes farther than asked.
    """
    JAMMED = 3
    """Geometry blocks the robot; the largest feasible part of the increment was applied."""
    FAILED = 4
    """No equilibrium was found; the previous one is returned."""
