"""Numbers as text, in units and with digits that suit their size."""

import math
from typing import NamedTuple

import numpy as np

ROUND_STEPS = (1.0, 2.0, 5.0, 10.0)
SLACK = 1e-9  # relative, by which rounded numbers may miss what they are compared with


class Unit(NamedTuple):
    """A unit of force: its name, and how many of it are a newton."""

    name: str
    per_newton: float

    def text(self, force: float, full_scale: float) -> str:
        """Return a force as text, with digits that suit a full scale [N]."""
        if not math.isfinite(force):
            return "?"
        return signed(f"{force * self.per_newton:.{decimals(full_scale * self.per_newton / 1000)}f}")


def force_unit(full_scale: float) -> Unit:
    """Return the unit of a scale up to a force [N]."""
    for unit in (Unit("N", 1.0), Unit("mN", 1e3)):
        if full_scale * unit.per_newton >= 2 * (1 - SLACK):
            return unit
    return Unit("µN", 1e6)


def round_step(full_scale: float, count: int) -> float:
    """Return the smallest step of 1, 2 or 5 times a power of ten of which at most ``count`` fit into a scale."""
    least = full_scale / count
    power = 10.0 ** math.floor(math.log10(least))
    return next(step * power for step in ROUND_STEPS if step * power >= least * (1 - SLACK))


def round_ticks(full_scale: float, count: int) -> np.ndarray:
    """Return multiples of a round step from 0 to a full scale, at most ``count`` beside the zero."""
    step = round_step(full_scale, count)
    return step * np.arange(math.floor(full_scale / step * (1 + SLACK)) + 1)


def decimals(resolution: float) -> int:
    """Return the number of decimals that show a resolution."""
    return min(max(0, math.ceil(-math.log10(resolution) - SLACK)), 9)


def short(number: float) -> str:
    """Return a number with three significant digits, and without an exponent."""
    return np.format_float_positional(number, 3, fractional=False, trim="-")


def signed(text: str) -> str:
    """Return the text of a number with a proper minus sign, none for a rounded zero."""
    if text.startswith("-") and not text.strip("-0."):
        text = text[1:]
    return text.replace("-", "−")


def length_text(length_mm: float, resolution_mm: float | None = None, unit: bool = True) -> str:
    """Return a length as text; every length in a picture is written here.

    Args:
        length_mm: The length [mm].
        resolution_mm: Smallest difference that is shown [mm]; ``None`` for three significant digits.
        unit: Whether the unit follows.
    """
    if resolution_mm is None:
        number = signed(short(length_mm) if 1e-3 <= abs(length_mm) < 1e5 or not length_mm else f"{length_mm:.2e}")
    else:
        number = signed(f"{length_mm:.{decimals(resolution_mm)}f}")
    return f"{number} mm" if unit else number
