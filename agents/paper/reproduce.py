"""Reproduction of the paper: its figures and Table 1, and which of its claims hold."""

import json
from dataclasses import asdict
from pathlib import Path

from agents.files import write_text
from agents.paper.claims import Claim, claims
from agents.paper.figures import draw


def reproduce(folder: Path) -> list[Claim]:
    """Write ``paper.png`` and ``paper.json`` into a folder; return the claims."""
    folder.mkdir(parents=True, exist_ok=True)
    found = claims()
    draw(folder / "paper.png")
    write_text(folder / "paper.json", json.dumps([asdict(claim) for claim in found], indent=2) + "\n")
    return found
