"""Every claim of the paper, judged."""

from agents.paper import kinematics, statics, times
from agents.paper.verdict import Claim


def claims() -> list[Claim]:
    """Return every claim of the paper with its verdict, in the order of shapes, forces and times."""
    return [*kinematics.claims(), *statics.claims(), *times.claims()]
