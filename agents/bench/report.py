"""All benchmarks in one run: a table, and a JSON."""

import json
from typing import Any

from rich.console import Console
from rich.table import Table

from agents.bench import kernel, peers, space, throughput
from agents.config import BenchConfig
from agents.files import write_text


def bench(config: BenchConfig) -> dict[str, Any]:
    """Measure, print and, where it is asked for, write."""
    if config.json is not None:
        config.json.parent.mkdir(parents=True, exist_ok=True)
    found = {
        "kernel": kernel.measure(config.steps, config.rivals),
        "kernel_in_space": space.measure(config.steps),
        "environments": throughput.environments(),
        "learning": throughput.learning() | throughput.solving(config.seeds),
        "peers": peers.measure(),
    }
    for name, part in found.items():
        show(name, part)
    if config.json is not None:
        write_text(config.json, json.dumps(found, indent=2) + "\n")
    return found


def show(title: str, numbers: dict[str, Any]) -> None:
    """Print a part of the report."""
    table = Table(title=title, show_header=False)
    for name, value in _flat(numbers):
        table.add_row(name, _text(value))
    Console().print(table)


def _text(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(_text, value))
    return f"{value:,.4g}" if isinstance(value, float) else str(value)


def _flat(numbers: dict[str, Any]) -> list[tuple[str, Any]]:
    """Nested numbers with their names joined."""
    rows: list[tuple[str, Any]] = []
    for name, value in numbers.items():
        inner = [(f"{name} {key}", number) for key, number in _flat(value)] if isinstance(value, dict) else []
        rows += inner or [(name, value)]
    return rows
