"""Measurements of a soak, summed up as JSON and as a table."""

import math
from collections import Counter
from dataclasses import dataclass, field, fields

from soak.scenes import SPATIAL
from solver import Status


@dataclass
class Tally:
    """Counts and extremes over some steps; lengths are divided by the robot's, tensions by their limit.

    Attributes:
        certificates_each: Largest number of node-coordinate certificates at the events of an episode; slow in space.
    """

    steps: int = 0
    contact: int = 0
    statuses: Counter = field(default_factory=Counter)
    reasons: Counter = field(default_factory=Counter)
    kinds: Counter = field(default_factory=Counter)
    findings: Counter = field(default_factory=Counter)
    refused: int = 0
    least_gap: float = math.inf
    least_distance: float = math.inf
    most_tension: float = 0.0
    worst_optimality: float = 0.0
    worst_certificate: float = 0.0
    certified: int = 0
    events: int = 0
    most_factorizations: int = 0
    traced: int = 0
    cores_swept: int = 0
    blocked: int = 0
    blocked_unconfirmed: int = 0
    certificates_each: int = 1000

    LARGEST = ("most_tension", "worst_optimality", "worst_certificate", "most_factorizations", "certificates_each")

    @classmethod
    def of(cls, model, setting, walk):
        """Return the counts of an episode that need no checks."""
        states = walk.states[1:]
        return cls(
            steps=len(states),
            statuses=Counter(Status(state.status).name for state in states),
            kinds=Counter({setting.kind: len(states)}),
            refused=setting.refused,
            certificates_each=20 if model in SPATIAL else 1000,
        )

    @classmethod
    def load(cls, entries):
        """Return the tally of its attributes as stored in JSON."""
        return cls(**{name: Counter(entry) if isinstance(entry, dict) else entry for name, entry in entries.items()})

    def add(self, other):
        """Add another tally to this one."""
        for name in (entry.name for entry in fields(self)):
            mine, theirs = getattr(self, name), getattr(other, name)
            worse = max if name in self.LARGEST else min if name.startswith("least") else lambda a, b: a + b
            setattr(self, name, worse(mine, theirs))

    def as_dict(self):
        """Return the tally for JSON."""
        return vars(self) | {"contact_share": self.contact / max(1, self.steps)}


REASONS = (
    "folded",
    "slack",
    "crossing",
    "far",
    "pinched",
    "wedged",
    "holes meet",
    "buckled",
    "unexplained",
    "not looked at",
)
ROWS = {
    "steps": lambda t: f"{t.steps:,}",
    "in contact": lambda t: f"{t.contact / max(1, t.steps):.1%}",
    **{name.lower(): (lambda t, name=name: f"{t.statuses[name]:,}") for name in Status.__members__},
    **{f"gave up: {why}": (lambda t, why=why: f"{t.reasons[why]:,}") for why in REASONS},
    "cores swept": lambda t: f"{t.cores_swept}",
    "steps checked inside": lambda t: f"{t.traced:,}",
    "least gap / L": lambda t: f"{t.least_gap:.1e}",
    "least distance / L": lambda t: f"{t.least_distance:.1e}",
    "largest tension / limit": lambda t: f"{t.most_tension:.9f}",
    "worst optimality": lambda t: f"{t.worst_optimality:.1e}",
    "worst certificate": lambda t: f"{t.worst_certificate:.1e}" if t.certified else "not yet",
    "certified / events": lambda t: f"{t.certified:,} / {t.events:,}",
    "blocked, reached another way": lambda t: f"{t.blocked_unconfirmed} of {t.blocked}",
    "largest work of a step": lambda t: f"{t.most_factorizations:,}",
    "scenes refused": lambda t: f"{t.refused:,}",
}


def table(tallies):
    """Return a Markdown table, one column for each named tally."""
    lines = [["", *tallies], ["---"] * (1 + len(tallies))]
    lines += [[row, *(show(tally) for tally in tallies.values())] for row, show in ROWS.items()]
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    return "\n".join("| " + " | ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)) + " |" for line in lines)
