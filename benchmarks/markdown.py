"""Numbers and tables in Markdown."""

import math
from collections.abc import Iterable, Mapping


def digits(value: float, count: int | None = None) -> str:
    """Return a number with some significant digits, by default two below a hundred, in groups of three."""
    count = count or (2 if abs(value) < 100 else 3)
    places = count - 1 - math.floor(math.log10(abs(value)))
    return f"{round(value, places):,.{max(places, 0)}f}".replace(",", " ")


def listed(values: Mapping[str, float], count: int | None = None) -> str:
    """Return numbers with some significant digits, separated by commas."""
    return ", ".join(digits(value, count) for value in values.values())


def line(*cells: object) -> str:
    """Return a row of a table in Markdown."""
    return "| " + " | ".join(map(str, cells)) + " |"


def rule(columns: int) -> str:
    """Return the line below the head of a table."""
    return "| --- " * columns + "|"


def table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """Return a table in Markdown."""
    return "\n".join([line(*head), rule(len(head)), *(line(*row) for row in rows)])
