"""Verdicts of the solver, as data."""

from enum import IntEnum


class Status(IntEnum):
    """How a step of the solver ended. Every verdict comes with a valid equilibrium.

    Where several things happened in one step, the highest value is reported.
    """

    CONVERGED = 0
    """The commanded cable displacement was reached along the branch."""
    SNAPPED = 1
    """The equilibrium turned unstable on the way and the robot moved, against what the slope of its branch predicts, to
    the one it reaches physically."""
    STALLED = 2
    """The cable tension reached the robot's limit, or would exceed it in a snap; the cable moved as far as that.

    Where a release ends in a snap to more tension than the motor holds, it yields: the cable goes farther than asked.
    """
    BLOCKED = 3
    """Geometry blocks the robot below its tension limit: to first order, no motion meets the command and all obstacles.

    The tension grows without bound on the way to such a place, so that a finite limit stalls the robot first.
    """
    GAVE_UP = 4
    """No equilibrium was found to go on to; the last valid one on the way is kept.

    A bound on work or motion ended the search. In the paper's models a snap may also lead to where a segment would fold
    over, short of which there is none.
    """
