"""The comparison with Table 1, and the paper's figures on one page."""

import math
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from agents.benchmark.shapes import Axes3D, draw_shape
from agents.files import replacing
from agents.paper import published
from agents.paper.comparison import predictions
from agents.paper.model import FIT_RANGE_MM, ROBOT, calibrate, force_per_load, pull, pull_in_space, table_1
from agents.paper.published import LOADS_G, MEASURED_G
from solver import Scene, fitted_slopes, free_nodes

STYLES = {  # of the four predictions: colour, and dashes by the estimate
    "paper model, energy force": ("#c0662b", "-"),
    "paper model, virtual work, μ = 0": ("#c0662b", "--"),
    "rod, energy force": ("#1f3a7a", "-"),
    "rod, virtual work, μ = 0": ("#1f3a7a", "--"),
}


def draw_comparison(path: Path) -> None:
    """Draw the measured forces of Table 1 and the four predictions of them, a panel for each distance."""
    figure, axes = plt.subplots(1, len(MEASURED_G), figsize=(15, 4.6), sharex=True, sharey=True, layout="constrained")
    forces = predictions()
    for row, (axis, (distance, measured)) in enumerate(zip(axes, MEASURED_G.items(), strict=True)):
        for name, (color, dashes) in STYLES.items():
            axis.plot([0, *LOADS_G], [0, *forces[name][row]], dashes, color=color, label=name)
        axis.plot(LOADS_G, measured, "o", color="black", ms=5, label="measured (Table 1)", zorder=3)
        axis.set(title=f"d = {distance} mm", xlabel="cable load P_l [gf]", xlim=(0, 360))
        axis.grid(alpha=0.3)
    axes[0].set(ylabel="force on the load cell [gf]", ylim=(0, None))
    figure.suptitle("Table 1 and four predictions without any fitted constant, read at T = T_onset + P_l")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    _save(figure, path)


def draw_figures(path: Path) -> None:
    """Draw Fig. 3b, 4a, 4b, 5, 7, 9, 10a, 10b, 11 and the errors of Table 1."""
    figure = plt.figure(figsize=(22, 9), layout="constrained")
    axes = [figure.add_subplot(2, 5, k + 1) for k in range(9)]
    _draw_profiles(axes[0])
    _draw_shape(axes[1], "Fig. 4a: l = 8 mm", published.FIG_4A, 8.0)
    _draw_shape(axes[2], "Fig. 4b: l = 5 mm", published.FIG_4B, 5.0)
    _draw_multipliers(axes[3])
    _draw_tip(axes[4])
    _draw_shape(axes[5], "Fig. 9: load cell at 26 mm, l = 5 mm", published.load_cell(26.0), 5.0)
    _draw_forces(axes[6])
    _draw_contact_points(axes[7])
    _draw_errors(axes[8])
    _draw_space(figure.add_subplot(2, 5, 10, projection="3d"))
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    with replacing(path) as partial:
        figure.savefig(partial, dpi=100)
    plt.close(figure)


def _draw_profiles(axis: Axes) -> None:
    for cable in (2.0, 5.0, 8.0, 12.0):
        draw_shape(axis, pull(Scene(), cable))
    axis.set_title("Fig. 3b: free profiles, l = 2, 5, 8, 12 mm")


def _draw_shape(axis: Axes, title: str, scene: Scene, cable_mm: float) -> None:
    draw_shape(axis, pull(scene, cable_mm))
    axis.set_title(title)


def _draw_multipliers(axis: Axes) -> None:
    multipliers = pull(published.FIG_4B, 5.0).multipliers[:, 1]
    for obstacle, row in enumerate(multipliers):
        axis.plot(np.arange(1, row.size + 1), 1e6 * row, "o-", label=f"obstacle {obstacle + 1}")
    axis.set(title="Fig. 5: multipliers of the cable points", xlabel="node, counted from 1", ylabel="λ [10⁻⁶ rad²/mm]")
    axis.legend()


def _draw_tip(axis: Axes) -> None:
    cables = np.linspace(0, 12, 100)
    tips = np.array([free_nodes(ROBOT, cable)[-1] for cable in cables])
    slopes = fitted_slopes(ROBOT, *FIT_RANGE_MM)
    for column, (name, scale) in enumerate((("x [mm]", 1.0), ("y − L0 [mm]", 1.0), ("φ [°]", 180 / math.pi))):
        values = scale * (tips[:, column] - tips[0, column])
        axis.plot(cables, values, label=f"{name}, slope {scale * slopes[column]:.2f}")
        fit = np.polyfit(cables[cables <= FIT_RANGE_MM[1]], values[cables <= FIT_RANGE_MM[1]], 1)
        axis.plot(cables, np.polyval(fit, cables), "k--", lw=0.7)
    axis.set(title="Fig. 7: tip displacement and straight lines", xlabel="cable displacement [mm]")
    axis.legend()


def _draw_forces(axis: Axes) -> None:
    for distance, measured in MEASURED_G.items():
        axis.plot(LOADS_G, measured, "o", ms=4, label=f"measured, d = {distance} mm")
    axis.plot(LOADS_G, table_1(*calibrate()), "k-", label="eq. 11, μ fitted: c·P_l")
    axis.set(title="Table 1: contact force", xlabel="cable load [g]", ylabel="force [g]")
    axis.legend(fontsize=8)


def _draw_contact_points(axis: Axes) -> None:
    """Draw eq. 11 with the slopes of several nodes that touch, for which the paper prints no numbers.

    The load cell's disk gets another force than in Table 1.
    """
    estimator, tip = calibrate()
    loads = np.array([0, *LOADS_G])
    ratio = force_per_load(estimator, tip)
    axis.plot(
        loads, ratio * loads, "k--", lw=1, label=f"Fig. 10a, node {published.CELL_NODE + 1}: {ratio:.3f} per load"
    )
    for node in published.FIG_10B_NODES:
        ratio = force_per_load(estimator, fitted_slopes(ROBOT, *FIT_RANGE_MM, node=node))
        axis.plot(loads, ratio * loads, "o-", ms=3, label=f"node {node + 1}: {ratio:.3f} per load")
    axis.set(title="Fig. 10b: eq. 11 at several contact points", xlabel="cable load [g]", ylabel="force [g]")
    axis.legend(fontsize=8)


def _draw_errors(axis: Axes) -> None:
    column, claimed = table_1(*calibrate()), published.CLAIMED_MEAN_ERROR_G
    for distance, measured in MEASURED_G.items():
        axis.plot(LOADS_G, column - measured, "o-", ms=4, label=f"d = {distance} mm")
    axis.axhspan(-claimed, claimed, color="0.9", label=f"± {claimed} g")
    axis.set(title="Table 1: eq. 11 minus measured", xlabel="cable load [g]", ylabel="error [g]")
    axis.legend(fontsize=8)


def _draw_space(axis: Axes3D) -> None:
    for cables in ((5.0, 0.0), (0.0, 5.0), (5.0, 5.0)):
        equilibrium = pull_in_space(cables)
        axis.plot(*equilibrium.nodes.T, lw=2.5, label=f"pulls {cables[0]:.0f} and {cables[1]:.0f} mm")
        for hole in equilibrium.pulled:
            axis.plot(*hole.T, color="0.6", lw=0.8)
    axis.set(title="Fig. 11: two cables in space", xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    axis.set(xlim=(-10, 80), ylim=(-10, 80), zlim=(0, 180), xticks=(0, 40, 80), yticks=(0, 40, 80))
    axis.set_box_aspect((1, 1, 2), zoom=0.85)
    axis.view_init(elev=25, azim=-60)
    axis.legend(fontsize=8, loc="lower left", bbox_to_anchor=(-0.25, 0.0))
