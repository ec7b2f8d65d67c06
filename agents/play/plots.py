"""Forces, tensions and the residual over the last steps."""

from collections import deque

import numpy as np
import viser
from viser import uplot

from agents.play.frame import Numbers

SHOWN_STEPS = 240
MILLI = 1e3
LEAST_RESIDUAL = 1e-17
COLORS = ("#80481c", "#21407a", "#5c428c", "#008c7e", "#b03060", "#7a8699", "#c9a200", "#444444")


class Plots:
    """Strip charts in a panel of the page.

    Args:
        gui: Where the charts are added.
        cables: Number of cables.
    """

    def __init__(self, gui: viser.GuiApi, cables: int) -> None:
        self._rows: deque[tuple[float, ...]] = deque(maxlen=SHOWN_STEPS)
        tensions = [(f"T{i + 1}", COLORS[i % len(COLORS)]) for i in range(cables)]
        forces = [("desired", "#703eb8"), ("true", "#008c7e"), ("estimate", "#f4921e")]
        self._charts = [
            _chart(gui, "Contact force [mN]", forces),
            _chart(gui, "Cable tension [N]", tensions),
            _chart(gui, "Residual, power of ten", [("log10", "#6c778c")]),
        ]
        self._columns = [slice(1, 4), slice(5, 5 + cables), slice(4, 5)]

    def add(self, numbers: Numbers) -> None:
        """Note a step; a new scene begins the charts anew."""
        if self._rows and numbers.step < self._rows[-1][0]:
            self._rows.clear()
        if not self._rows or numbers.step > self._rows[-1][0]:
            forces = (MILLI * force for force in (numbers.desired, numbers.true, numbers.estimate))
            residual = float(np.log10(max(numbers.residual, LEAST_RESIDUAL)))
            self._rows.append((float(numbers.step), *forces, residual, *numbers.tensions))

    def remove(self) -> None:
        """Remove the charts."""
        for chart in self._charts:
            chart.remove()

    def draw(self) -> None:
        """Send what was noted to the page."""
        if len(self._rows) < 2:
            return
        rows = np.array(self._rows).T
        for chart, columns in zip(self._charts, self._columns, strict=True):
            chart.data = (rows[0] - rows[0, -1], *rows[columns])


def _chart(gui: viser.GuiApi, title: str, series: list[tuple[str, str]]) -> viser.GuiUplotHandle:
    empty = (np.array([-1.0, 0.0]), *(np.zeros(2) for _ in series))  # uPlot never returns from a range of no length
    described = (uplot.Series(label="steps ago"), *(uplot.Series(label=n, stroke=c, width=2) for n, c in series))
    # A range that stays: viser carries that of the last data over to the next, and may miss the data.
    scales = {"x": uplot.Scale(time=False, range=(-SHOWN_STEPS, 0.0)), "y": uplot.Scale(auto=True)}
    return gui.add_uplot(empty, described, title=title, scales=scales, height=190)
