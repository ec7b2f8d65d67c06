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
    """A motor at the robot's tension limit holds its cable short of the command, or a snap would exceed the limit.

    The cable moved as far as the limit. Where a rod has several, the others go on as far as commanded: a
    motor at its limit cannot hold, so it keeps its tension and its cable's length follows, in or out. Each motor then
    either has met its command, or is at its limit; only where one has let out all of its cable it holds, and others
    stop short. So do the motors of a rod, even a single one, while its base inserts it; the base of the paper's models
    stops with them. A command that every cable has met at the end is not reported as stalled, whatever happened on the
    way.

    In the paper's model of space, cables at the limit hold still, and a step may end below the limit with this status.

    Where a release ends in a snap to more tension than the motor holds, it yields: the cable goes farther than asked.
    """
    BLOCKED = 3
    """The obstacles block the robot below its tension limit: to first order, no motion that respects all of them
    follows the command.

    A force grows without bound on the way there. Of cables, a finite tension limit stalls the robot first; an insertion
    has no limit.
    """
    GAVE_UP = 4
    """No further equilibrium was found; the last valid one on the way is kept.

    A bound on work or motion ended the search. In the paper's models a snap may also lead to where a segment would fold
    over; there is no equilibrium short of that.
    """
