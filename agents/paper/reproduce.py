"""The paper put to the test: a verdict on each of its claims, its Table 1 beside four predictions, and its figures."""

import json
from dataclasses import asdict
from pathlib import Path

from agents.arguments import check_kind
from agents.files import check_writable, write_text
from agents.paper.claims import claims
from agents.paper.comparison import scores
from agents.paper.figures import draw_comparison, draw_figures
from agents.paper.report import markdown, show
from agents.paper.two_models import write_two_models
from agents.paper.verdict import Claim


def reproduce(folder: Path) -> list[Claim]:
    """Write the page ``paper.md``, its figures and ``paper.json`` into a folder, print it, and return the claims.

    Beside it stands ``two_models.md``, six scenes in both models.

    Raises:
        UserError: If a file cannot be written.
        TypeError: If ``folder`` is no path.
    """
    check_kind("folder", folder, Path, "give a pathlib.Path")
    check_writable(*(folder / name for name in ("paper.json", "paper.md", "two_models.md")))
    found, scored = claims(), scores()
    draw_comparison(folder / "table_1.png")
    draw_figures(folder / "paper.png")
    write_two_models(folder)
    values = {
        "claims": [asdict(claim) for claim in found],
        "table_1": {name: asdict(score) for name, score in scored.items()},
    }
    write_text(folder / "paper.json", json.dumps(_without_nan(values), indent=2, ensure_ascii=False) + "\n")
    write_text(folder / "paper.md", markdown(found, scored))
    show(found, scored)
    return found


def _without_nan(values: object) -> object:
    """Return JSON values with None in the place of numbers that do not exist."""
    if isinstance(values, dict):
        return {key: _without_nan(value) for key, value in values.items()}
    if isinstance(values, list):
        return [_without_nan(value) for value in values]
    return None if values != values else values
