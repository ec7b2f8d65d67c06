"""All speed benchmarks in one run, as tables and JSON."""

import json

from rich.console import Console
from rich.table import Table

from agents.bench import kernel, peers, space, throughput
from agents.config import BenchConfig
from agents.files import JsonObject, check_writable, write_text


def bench(config: BenchConfig) -> JsonObject:
    """Measure, print the tables and, if a file is given, write the results."""
    if config.json is not None:
        check_writable(config.json)
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


def show(title: str, numbers: JsonObject) -> None:
    """Print one table of the report."""
    table = Table(title=title, show_header=False)
    for name, value in _flat(numbers):
        table.add_row(name, _text(value))
    Console().print(table)


def _text(value: object) -> str:
    if isinstance(value, list):
        return ", ".join(map(_text, value))
    return f"{value:,.4g}" if isinstance(value, float) else str(value)


def _flat(numbers: JsonObject) -> list[tuple[str, object]]:
    """Return nested numbers with their names joined."""
    rows: list[tuple[str, object]] = []
    for name, value in numbers.items():
        inner = [(f"{name} {key}", number) for key, number in _flat(value)] if isinstance(value, dict) else []
        rows += inner or [(name, value)]
    return rows
