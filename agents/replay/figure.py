"""The figure of a replay."""

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from agents.benchmark.shapes import draw_shape, draw_shape_in_space
from agents.files import replacing
from agents.replay.estimate import Estimates
from solver import Equilibrium

FORCE, MEASURED, SHAPE = "C0", "C1", "#1f3a7a"
SHOWN = 5  # earlier shapes beside that of the largest force


def draw(found: Estimates, path: Path) -> None:
    """Draw shape, force, tensions and nodes that touch.

    Args:
        found: The estimates.
        path: File to write.

    Raises:
        UserError: If the file cannot be written.
    """
    planar = isinstance(found.shapes[0], Equilibrium)
    figure = plt.figure(figsize=(10.5, 5.6), layout="constrained")
    grid = figure.add_gridspec(3, 2, width_ratios=(1, 1.5), height_ratios=(2, 1, 1))
    _draw_shapes(figure.add_subplot(grid[:, 0], projection=None if planar else "3d"), found)
    force = figure.add_subplot(grid[0, 1])
    others = [figure.add_subplot(grid[row, 1], sharex=force) for row in (1, 2)]
    times, label = time_axis(found)
    _draw_force(force, times, found)
    _draw_tensions(others[0], times, found)
    _draw_contacts(others[1], times, found)
    others[1].set_xlabel(label)
    for axis in (force, others[0]):
        axis.tick_params(labelbottom=False)
    with replacing(path) as partial:
        figure.savefig(partial, dpi=130)
    plt.close(figure)


def time_axis(found: Estimates) -> tuple[np.ndarray, str]:
    """Return what is drawn along the horizontal axis, time or the row of the log, and its label."""
    log = found.log
    return (log.rows.astype(float), "row") if log.time_s is None else (log.time_s, "time [s]")


def _draw_shapes(axis: Axes, found: Estimates) -> None:
    """Draw the shape at the largest force, without any contact the last one, and the backbone at earlier rows."""
    pressed = int(found.force_n.argmax()) if found.force_n.any() else len(found.shapes) - 1
    shape = found.shapes[pressed]
    draw_shape(axis, shape) if isinstance(shape, Equilibrium) else draw_shape_in_space(axis, shape)
    space = found.obstacle_forces_n.shape[2]
    for row in np.linspace(0, pressed, SHOWN, endpoint=False).astype(int):
        axis.plot(*found.shapes[row].nodes[:, :space].T, color=SHAPE, lw=1, alpha=0.25)
    if found.log.nodes.size:
        late = min(pressed + found.latency_rows, len(found.shapes) - 1)
        axis.plot(*found.log.positions_mm[late].T, "x", color=MEASURED, label="measured")
        axis.legend(loc="lower right", fontsize=8)
    times, label = time_axis(found)
    when = f"row {times[pressed]:.0f}" if label == "row" else f"{times[pressed]:.6g} s"
    axis.set_title(f"shape at {when}, and before", fontsize=10)


def _draw_force(axis: Axes, times: np.ndarray, found: Estimates) -> None:
    force, deviation = found.force_n, found.force_std_n
    low, high = np.maximum(force - 2 * deviation, 0), force + 2 * deviation
    axis.fill_between(times, low, high, color=FORCE, alpha=0.25, lw=0, label="± 2 standard deviations")
    axis.plot(times, force, color=FORCE, label="estimated")
    axis.set(ylabel="contact force [N]", ylim=(0, None))
    axis.legend(loc="upper left", fontsize=8)
    axis.grid(alpha=0.3)


def _draw_tensions(axis: Axes, times: np.ndarray, found: Estimates) -> None:
    for cable, tensions in enumerate(found.log.tensions_n.T):
        axis.plot(times, tensions, color=f"C{cable + 1}", lw=1, label=f"cable {cable}")
    if found.log.tensions_n.shape[1] > 1:
        axis.legend(fontsize=7, ncols=4, loc="upper left")
    axis.set_ylabel("tension [N]")
    axis.grid(alpha=0.3)


def _draw_contacts(axis: Axes, times: np.ndarray, found: Estimates) -> None:
    """Draw the nodes that touch, in a colour for each obstacle."""
    for obstacle in range(found.obstacle_forces_n.shape[1]):
        touching = [np.argwhere(shape.contact[obstacle].any(axis=0))[:, 0] for shape in found.shapes]
        at = np.repeat(times, [len(nodes) for nodes in touching])
        axis.plot(at, np.concatenate(touching), ".", ms=3, color=f"C{3 + obstacle}", label=f"obstacle {obstacle}")
    if found.obstacle_forces_n.shape[1] > 1:
        axis.legend(fontsize=7, ncols=4, loc="lower left")
    robot = found.shapes[0].robot
    axis.set(ylabel="node in contact", ylim=(0, robot.segments * (robot.between + 1) + 1))
    axis.grid(alpha=0.3)
