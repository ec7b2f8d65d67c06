"""Messages of the solvers in the words of the page."""

import re
from collections.abc import Iterable

from solver import Obstacle


def in_words(message: str, obstacles: Iterable[Obstacle]) -> str:
    """Return a message in which the obstacles are named as on the page, with rounded numbers.

    Args:
        message: Message of an error, which names an obstacle by its ``repr``.
        obstacles: Obstacles that it may name.
    """
    for obstacle in obstacles:
        message = message.replace(repr(obstacle), _words(obstacle))
    return message[:1].upper() + message[1:]


def _words(obstacle: Obstacle) -> str:
    kind = re.sub(r"(?<=[a-z])(?=[A-Z])", "-", type(obstacle).__name__).lower()
    sizes = [f"{name.replace('_', ' ')} {getattr(obstacle, name):.1f} mm" for name in obstacle.size_fields]
    of = f" of {' and '.join(sizes)}" if sizes else ""
    center = ", ".join(f"{value:.1f}" for value in getattr(obstacle, obstacle.point_fields[0]))
    return f"the {kind}{of} at ({center}) mm"
