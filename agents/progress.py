"""Progress of long commands: a bar on a terminal, lines elsewhere."""

from collections.abc import Iterable, Iterator
from typing import TypeVar

from rich.console import Console
from rich.progress import track

T = TypeVar("T")


def followed(items: Iterable[T], title: str, total: int) -> Iterator[T]:
    """Yield items, and show how many have come: a bar on a terminal, a line for each in files and pipes."""
    if Console().is_terminal:
        yield from track(items, title, total)
        return
    for count, item in enumerate(items, start=1):
        print(f"{title}: {count} of {total}", flush=True)
        yield item
