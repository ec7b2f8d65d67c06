"""Outcome of a step of the solver, as data."""

from enum import IntEnum


class Status(IntEnum):
    """How a step of the solver ended; every step returns a valid equilibrium.

    Where several things happened in one step, the highest value is reported.
    """

    CONVERGED = 0
    """The commanded cable displacement was reached along the branch."""
    SNAPPED = 1
    """The equilibrium became unstable on the way, and the robot moved, against what the slope of its branch predicts,
    to the one that is reached physically."""
    STALLED = 2
    """The cable tension reached the robot's limit, or would exceed it in a snap; the cable moved as far as the limit.

    A step in space may end below the limit with this status, where its motors would be overloaded on the way;
    the same command may then lead farther in a further step.

    Where a release ends in a snap to more tension than the motor holds, it yields: the cable goes farther than asked.
    """
    BLOCKED = 3
    """The obstacles block the robot below its tension limit: to first order, no motion that respects all of them
    follows the command.

    The tension grows without bound on the way there, so a finite limit stalls the robot first.
    """
    GAVE_UP = 4
    """No further equilibrium was found; the last valid one on the way is kept.

    A bound on work or motion ended the search. In the paper's models a snap may also lead to where a segment would fold
    over; there is no equilibrium short of that.
    """
