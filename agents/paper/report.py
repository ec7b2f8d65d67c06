"""The verdicts and the comparison with Table 1 in plain words, as Markdown and as tables of the terminal."""

import math
from collections import Counter

from rich.console import Console
from rich.table import Table

from agents.paper.comparison import COLUMN, NULL, RIGIDITIES, Score, energy_scores_by_rigidity
from agents.paper.model import ROBOT, ROD
from agents.paper.verdict import Claim, Verdict

COLORS = {Verdict.HOLDS: "green", Verdict.FAILS: "red", Verdict.UNTESTABLE: "yellow"}
HEADINGS = (
    "prediction",
    "mean F/P_l",
    "error [gf]",
    "best factor",
    "error with it [gf]",
    "leave one out [gf]",
    "leave one distance out [gf]",
)


def markdown(found: list[Claim], scored: dict[str, Score]) -> str:
    """Return the page: what Table 1 says, its figure, every verdict, and the paper's figures."""
    verdicts = [f"| {claim.verdict} | {claim.sentence} ({claim.where}) | {claim.found} |" for claim in found]
    return "\n".join(
        [
            "# The paper, claim by claim",
            "",
            f"{tally(found)}. No claim is judged on what it was calibrated with.",
            "",
            "## Table 1 and four predictions",
            "",
            "![Measured forces and four predictions](table_1.png)",
            "",
            *_table(HEADINGS, [row(name, score) for name, score in scored.items()]),
            "",
            words(scored),
            "",
            "## Verdicts",
            "",
            *_table(("verdict", "claim", "found"), []),
            *verdicts,
            "",
            "## Figures",
            "",
            "![Figures of the paper](paper.png)",
            "",
        ]
    )


def _table(headings: tuple[str, ...], rows: list[list[str]]) -> list[str]:
    lines = [list(headings), ["---"] * len(headings), *rows]
    return ["| " + " | ".join(line) + " |" for line in lines]


def row(name: str, score: Score) -> list[str]:
    """Return a row of the comparison; what does not exist is a dash."""
    errors = (score.fitted, score.left_out, score.left_out_distance)
    return [
        name,
        f"{score.ratio:.3f}",
        _number(score.error, 2),
        _number(score.factor, 3),
        *(_number(error, 2) for error in errors),
    ]


def _number(value: float, digits: int) -> str:
    return "–" if math.isnan(value) else f"{value:.{digits}f}"


def tally(found: list[Claim]) -> str:
    """Return how many claims there are of each verdict, in words."""
    counts = Counter(claim.verdict for claim in found)
    return f"Of {len(found)} claims, " + ", ".join(f"{counts[verdict]} {_plural(verdict)}" for verdict in Verdict)


def _plural(verdict: Verdict) -> str:
    return {Verdict.HOLDS: "hold", Verdict.FAILS: "do not hold"}.get(verdict, verdict)


def words(scored: dict[str, Score]) -> str:
    """Return what Table 1 supports, and what it does not."""
    rod, null, column = scored["rod, energy force"], scored[NULL], scored[COLUMN]
    return f"{_supported(rod)} {_ruled_out()} {_not_supported(rod, null, column)}"


def _supported(rod: Score) -> str:
    ratios = [score.ratio for score in energy_scores_by_rigidity(ROD)]
    return (
        "Table 1 supports a force in proportion to the load, and roughly its level. Of the four predictions, none of "
        f"which has a fitted constant, the rod's energy force comes closest, {rod.error:.1f} gf off on average: the "
        f"measured forces are {1 - rod.factor:.0%} below it. Loss of cable load and friction at the cell could both "
        f"explain that, and nothing in the table tells them apart. The paper prints no rigidity, and "
        f"{ROD.rigidity:.0f} N·mm² is assumed; from {RIGIDITIES[0]:.0f} to {RIGIDITIES[-1]:.0f} N·mm² the rod's F/P_l "
        f"is {min(ratios):.3f} to {max(ratios):.3f}."
    )


def _ruled_out() -> str:
    fitted, ratios = zip(*((score.fitted, score.ratio) for score in energy_scores_by_rigidity(ROBOT)), strict=True)
    return (
        "Table 1 rules out the energy force of the paper's model, by its form: it is not in proportion to the load and "
        f"grows over d, so that no factor brings it below {min(fitted):.1f} gf at any of these rigidities. Its level "
        f"alone proves nothing: a softer robot meets it, as F/P_l runs from {min(ratios):.3f} to {max(ratios):.3f}."
    )


def _not_supported(rod: Score, null: Score, column: Score) -> str:
    return (
        "Table 1 does not support the kinematics of either model. A line through the origin, which knows no robot, is "
        f"{null.left_out:.2f} gf off, each measurement left out in turn; the rod with one factor is "
        f"{rod.left_out:.2f} gf off, and the paper's column, calibrated with one measurement, {column.error:.2f} gf "
        "over the other 27. Nor does the table show that the force grows over d, as both models say."
    )


def show(found: list[Claim], scored: dict[str, Score]) -> None:
    """Print the comparison and the verdicts."""
    console = Console()
    console.print(_comparison_table(scored), words(scored), "", _verdict_table(found), f"{tally(found)}.", sep="\n")


def _comparison_table(scored: dict[str, Score]) -> Table:
    table = Table(title="Table 1, 28 measured forces: mean absolute errors")
    for heading in HEADINGS:
        table.add_column(heading, justify="left" if heading == HEADINGS[0] else "right")
    for name, score in scored.items():
        table.add_row(*row(name, score))
    return table


def _verdict_table(found: list[Claim]) -> Table:
    table = Table("verdict", "claim", "found", title="The paper, claim by claim", show_lines=True)
    for claim in found:
        table.add_row(f"[{COLORS[claim.verdict]}]{claim.verdict}", f"{claim.sentence} ({claim.where})", claim.found)
    return table
