"""Where the parts of a picture are."""

from typing import NamedTuple

from ccr_gym.rendering.palette import LAYOUT


class Region(NamedTuple):
    """A rectangle of the canvas, y down."""

    left: float
    top: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """Its right side."""
        return self.left + self.width

    @property
    def bottom(self) -> float:
        """Its lower side."""
        return self.top + self.height


class Page(NamedTuple):
    """The parts of a picture; those that are not drawn have no height.

    Attributes:
        title: Line with title, step and reward, at the top.
        legend: Line of the legend, below.
        world: The robot among its obstacles.
        panel: Forces and tensions, at the right of the world and the chart.
        chart: Forces over time, below the world.
        footer: Line with cable displacements and status, at the bottom.
    """

    title: Region
    legend: Region
    world: Region
    panel: Region
    chart: Region
    footer: Region

    @classmethod
    def divide(cls, width: float, height: float, titled: bool, charted: bool) -> "Page":
        """Divide a canvas of some size, with or without a title and a strip chart; a narrow one has no legend."""
        title, chart = titled * LAYOUT.title, charted * LAYOUT.chart
        legend = (width >= LAYOUT.legend_width) * LAYOUT.legend
        top, bottom, inner = title + legend, height - LAYOUT.footer, width - LAYOUT.panel
        return cls(
            title=Region(0, 0, width, title),
            legend=Region(0, title, width, legend),
            world=Region(0, top, inner, bottom - chart - top),
            panel=Region(inner, top, LAYOUT.panel, bottom - top),
            chart=Region(0, bottom - chart, inner, chart),
            footer=Region(0, bottom, width, LAYOUT.footer),
        )
