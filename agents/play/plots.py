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

    None is ever removed, for the reason that :class:`agents.play.controls.Controls` gives: robots with other numbers
    of cables have charts of their own, of which one is shown.

    Args:
        gui: Where the charts are added.
        cables: Number of cables.
    """

    def __init__(self, gui: viser.GuiApi, cables: int) -> None:
        self._gui = gui
        self._rows: deque[tuple[float, ...]] = deque(maxlen=SHOWN_STEPS)
        forces = [("desired", "#703eb8"), ("true", "#008c7e"), ("estimate", "#f4921e")]
        self._forces = _chart(gui, "Contact force [mN]", forces)
        self._tensions: dict[int, viser.GuiUplotHandle] = {}
        tensions = self._tensions_of(cables)
        self._residual = _chart(gui, "Residual, power of ten", [("log10", "#6c778c")])
        self._charts = [(self._forces, slice(1, 4)), (self._residual, slice(4, 5)), (tensions, slice(5, None))]

    def fit(self, cables: int) -> None:
        """Begin empty charts of another robot, in the panel where they were added."""
        self._rows.clear()
        tensions = self._tensions_of(cables)
        for chart in self._tensions.values():
            chart.visible = chart is tensions
        self._charts[-1] = tensions, slice(5, None)
        for chart, _ in self._charts:
            chart.data = _empty(len(chart.series) - 1)

    def add(self, numbers: Numbers) -> None:
        """Note a step; a new scene begins the charts anew."""
        if self._rows and numbers.step < self._rows[-1][0]:
            self._rows.clear()
        if not self._rows or numbers.step > self._rows[-1][0]:
            forces = (MILLI * force for force in (numbers.desired, numbers.true, numbers.estimate))
            residual = float(np.log10(max(numbers.residual, LEAST_RESIDUAL)))
            self._rows.append((float(numbers.step), *forces, residual, *numbers.tensions))

    def draw(self) -> None:
        """Send what was noted to the page."""
        if len(self._rows) < 2:
            return
        rows = np.array(self._rows).T
        for chart, columns in self._charts:
            chart.data = (rows[0] - rows[0, -1], *rows[columns])

    def _tensions_of(self, cables: int) -> viser.GuiUplotHandle:
        """Return the chart of a number of cables, below that of the forces."""
        if cables not in self._tensions:
            series = [(f"T{i + 1}", COLORS[i % len(COLORS)]) for i in range(cables)]
            self._tensions[cables] = _chart(self._gui, "Cable tension [N]", series, self._forces.order + 0.5)
        return self._tensions[cables]


def _empty(series: int) -> tuple[np.ndarray, ...]:
    """Return data with nothing to be seen; uPlot never returns from a range of no length."""
    return np.array([-1.0, 0.0]), *(np.zeros(2) for _ in range(series))


def _chart(
    gui: viser.GuiApi, title: str, series: list[tuple[str, str]], order: float | None = None
) -> viser.GuiUplotHandle:
    described = (uplot.Series(label="steps ago"), *(uplot.Series(label=n, stroke=c, width=2) for n, c in series))
    # A range that stays: viser carries that of the last data over to the next, and may miss the data.
    scales = {"x": uplot.Scale(time=False, range=(-SHOWN_STEPS, 0.0)), "y": uplot.Scale(auto=True)}
    return gui.add_uplot(_empty(len(series)), described, title=title, scales=scales, height=190, order=order)
