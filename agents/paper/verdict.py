"""Claims of the paper, and the three verdicts on them."""

from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """What is found of a claim.

    A claim that a number was calibrated to meet is never said to hold: it cannot be tested.
    """

    HOLDS = "holds"
    FAILS = "does not hold"
    UNTESTABLE = "cannot be tested from the text"


@dataclass(frozen=True, slots=True)
class Claim:
    """A claim of the paper, and what is found.

    Attributes:
        sentence: What the paper says.
        where: Where it says so.
        verdict: The verdict.
        found: The numbers that it rests on, in words.
    """

    sentence: str
    where: str
    verdict: Verdict
    found: str


def judged(holds: bool) -> Verdict:
    """Return the verdict on a claim that can be tested."""
    return Verdict.HOLDS if holds else Verdict.FAILS
