"""The paper's results again: what its figures and its table show, and which of its claims hold."""

import json
import math
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from agents.benchmark.figures import draw_shape
from agents.files import replacing, write_text
from agents.paper import published as paper
from solver import Equilibrium, Robot, Scene, Solver, VirtualWork, fitted_slopes, free_nodes, tip_slopes
from solver.spatial import SpatialEquilibrium, SpatialRobot, SpatialSolver

ROBOT = Robot.prototype(max_tension=math.inf)
FIT_RANGE = (0.0, 8.0)  # cable displacements the straight lines of Fig. 7 are fitted over [mm]


@dataclass(frozen=True, slots=True)
class Claim:
    """A sentence of the paper, and what was found.

    Attributes:
        sentence: What the paper says.
        holds: Whether it does here.
        found: The numbers.
    """

    sentence: str
    holds: bool
    found: str


def pulled(scene: Scene, cable_mm: float, step_mm: float = 0.05) -> Equilibrium:
    """The equilibrium reached by pulling from rest in small steps."""
    solver = Solver(ROBOT, scene)
    equilibrium = solver.rest()
    for cable in np.arange(step_mm, cable_mm + step_mm / 2, step_mm):
        equilibrium = solver.step(equilibrium, float(cable))
    return equilibrium


def calibrated() -> tuple[VirtualWork, np.ndarray]:
    """The estimator with μ from the paper's calibration point, and the fitted slopes it uses."""
    distance, load = paper.CALIBRATION
    force = paper.MEASURED[distance][paper.LOADS.index(load)]
    slopes = fitted_slopes(ROBOT, *FIT_RANGE)
    return VirtualWork.calibrated(force, load, slopes, ROBOT.offset_mm), slopes


def table_1(estimator: VirtualWork, slopes: np.ndarray) -> np.ndarray:
    """The theoretical column of Table 1 by eq. 11, ``(7,)`` [g]."""
    per_load = -ROBOT.offset_mm * slopes[2] / (estimator.friction * slopes[1] + slopes[0])
    return np.asarray(per_load * np.array(paper.LOADS))


def claims() -> list[Claim]:
    """Every claim in numbers, checked."""
    estimator, slopes = calibrated()
    column = table_1(estimator, slopes)
    deviation = np.abs(column - paper.THEORETICAL).max()
    errors = np.abs(np.array(list(paper.MEASURED.values())) - column)
    printed = np.abs(np.array(list(paper.MEASURED.values())) - paper.THEORETICAL)
    contact = pulled(paper.FIG_4B, 5.0).contact
    touching = np.flatnonzero(contact.any(axis=(0, 1))).tolist()
    exact = np.array([_gain(estimator, cable) for cable in (2.2, 7.0)])
    between = bent((5.0, 5.0)).points[0] @ [math.sqrt(0.5), -math.sqrt(0.5), 0.0]
    seconds = {name: _seconds(scene) for name, scene in (("one", paper.FIG_4A), ("two", paper.FIG_4B))}
    return [
        Claim(
            "The multipliers peak at nodes 11 and 17, the contacts of Fig. 4b (Fig. 5).",
            touching == list(paper.FIG_5_NODES) and bool(contact[:, 1].any()),
            f"at l = 5.00 mm the cable points of nodes {[node + 1 for node in touching]} carry multipliers",
        ),
        Claim(
            "Theoretical column of Table 1.",
            bool(deviation <= 0.1),
            f"{column.round(1).tolist()} g, at most {deviation:.2f} g off; μ = {estimator.friction:.2f} from d = "
            f"{paper.CALIBRATION[0]} mm, {paper.CALIBRATION[1]} g, straight-line slopes {slopes.round(3).tolist()}",
        ),
        Claim(
            f"The average error is less than {paper.CLAIMED_MEAN_ERROR} g.",
            bool(errors.mean() < paper.CLAIMED_MEAN_ERROR),
            f"{errors.mean():.2f} g over {errors.size} measurements",
        ),
        Claim(
            f"The maximum error is less than {paper.CLAIMED_MAX_ERROR} g (at d = 26 mm, which Table 1 does not list).",
            bool(printed.max() < paper.CLAIMED_MAX_ERROR),
            f"Table 1 as printed shows up to {printed.max():.1f} g; here {errors.max():.1f} g",
        ),
        Claim(
            "The force does not appreciably change with the offset d.",
            bool(abs(exact[1] / exact[0] - 1) < 0.05),
            f"with exact slopes the force per load is {exact[0]:.4f} where d = 24 mm touches, {exact[1]:.4f} at 51 mm; "
            "with one straight line it cannot change",
        ),
        Claim(
            "Two cables pulled at once bend the robot in a plane between those of each alone (Fig. 11).",
            bool(np.ptp(between) < 1e-9),
            f"pulled by 5 mm each, the backbone stays within {np.ptp(between):.0e} mm of the plane at 45°; "
            f"eq. 13 is met to {bent((5.0, 5.0)).residuals()[0]:.0e} rad²/mm",
        ),
        Claim(
            "By specifying the gradient, the convergence time could be further reduced.",
            seconds["one"] < paper.SECONDS_PER_SOLVE,
            f"a whole pull from rest to 5 mm, 100 equilibria, takes {1e3 * seconds['one']:.1f} ms; the paper's fmincon "
            f"took {paper.SECONDS_PER_ITERATION} s an iteration without obstacles and {paper.SECONDS_PER_SOLVE} s with",
        ),
        Claim(
            "One and two obstacles take almost the same time.",
            0.5 < seconds["two"] / seconds["one"] < 2,
            f"two take {seconds['two'] / seconds['one']:.2f} times as long as one",
        ),
    ]


def _gain(estimator: VirtualWork, cable_mm: float) -> float:
    x, y, turn = tip_slopes(ROBOT, cable_mm)
    return float(-ROBOT.offset_mm * turn / (estimator.friction * y + x))


def _seconds(scene: Scene) -> float:
    def once() -> float:
        begin = time.perf_counter()
        pulled(scene, 5.0)
        return time.perf_counter() - begin

    return float(np.median([once() for _ in range(9)]))


def draw(path: Path) -> None:
    """Fig. 3b, 4a, 4b, 5, 7, 9, 10a, 10b, 11 and Table 1 on one page."""
    figure = plt.figure(figsize=(22, 9), layout="constrained")
    axes = [figure.add_subplot(2, 5, k + 1) for k in range(9)]
    for cable in (2.0, 5.0, 8.0, 12.0):
        draw_shape(axes[0], pulled(Scene(), cable))
    axes[0].set_title("Fig. 3b: free profiles, l = 2, 5, 8, 12 mm")
    for axis, name, scene in ((axes[1], "Fig. 4a", paper.FIG_4A), (axes[2], "Fig. 4b", paper.FIG_4B)):
        cable = 8.0 if scene is paper.FIG_4A else 5.0
        draw_shape(axis, pulled(scene, cable))
        axis.set_title(f"{name}: l = {cable:.0f} mm")
    _draw_multipliers(axes[3])
    _draw_tip(axes[4])
    draw_shape(axes[5], pulled(paper.load_cell(26.0), 5.0))
    axes[5].set_title("Fig. 9: load cell at 26 mm, l = 5 mm")
    _draw_forces(axes[6])
    _draw_contact_points(axes[7])
    _draw_errors(axes[8])
    _draw_space(figure.add_subplot(2, 5, 10, projection="3d"))
    with replacing(path) as partial:
        figure.savefig(partial, dpi=100)
    plt.close(figure)


def _draw_multipliers(axis: Axes) -> None:
    multipliers = pulled(paper.FIG_4B, 5.0).multipliers[:, 1]
    for obstacle, row in enumerate(multipliers):
        axis.plot(np.arange(1, row.size + 1), 1e6 * row, "o-", label=f"obstacle {obstacle + 1}")
    axis.set(title="Fig. 5: multipliers of the cable points", xlabel="node, counted from 1", ylabel="λ [10⁻⁶ rad²/mm]")
    axis.legend()


def _draw_tip(axis: Axes) -> None:
    cables = np.linspace(0, 12, 100)
    tips = np.array([free_nodes(ROBOT, cable)[-1] for cable in cables])
    slopes = fitted_slopes(ROBOT, *FIT_RANGE)
    for column, (name, scale) in enumerate((("x [mm]", 1.0), ("y − L0 [mm]", 1.0), ("φ [°]", 180 / math.pi))):
        values = scale * (tips[:, column] - tips[0, column])
        axis.plot(cables, values, label=f"{name}, slope {scale * slopes[column]:.2f}")
        fit = np.polyfit(cables[cables <= FIT_RANGE[1]], values[cables <= FIT_RANGE[1]], 1)
        axis.plot(cables, np.polyval(fit, cables), "k--", lw=0.7)
    axis.set(title="Fig. 7: tip displacement and straight lines", xlabel="cable displacement [mm]")
    axis.legend()


def _draw_forces(axis: Axes) -> None:
    for distance, measured in paper.MEASURED.items():
        axis.plot(paper.LOADS, measured, "o", ms=4, label=f"measured, d = {distance} mm")
    axis.plot(paper.LOADS, table_1(*calibrated()), "k-", label="eq. 11")
    axis.set(title="Fig. 10, Table 1: contact force", xlabel="cable load [g]", ylabel="force [g]")
    axis.legend(fontsize=8)


def _draw_contact_points(axis: Axes) -> None:
    """Eq. 11 with the slopes of the node that touches, for which the paper prints no numbers."""
    estimator, _ = calibrated()
    loads = np.array([0, *paper.LOADS])
    for node in paper.FIG_10B_NODES:
        x, y, turn = fitted_slopes(ROBOT, *FIT_RANGE, node=node)
        per_load = -ROBOT.offset_mm * turn / (estimator.friction * y + x)
        axis.plot(loads, per_load * loads, "o-", ms=3, label=f"node {node + 1}: {per_load:.3f} per load")
    axis.set(title="Fig. 10b: eq. 11 at several contact points", xlabel="cable load [g]", ylabel="force [g]")
    axis.legend(fontsize=8)


def _draw_space(axis: Any) -> None:
    for cables in ((5.0, 0.0), (0.0, 5.0), (5.0, 5.0)):
        equilibrium = bent(cables)
        axis.plot(*equilibrium.nodes.T, lw=2.5, label=f"pulls {cables[0]:.0f} and {cables[1]:.0f} mm")
        for hole in equilibrium.pulled:
            axis.plot(*hole.T, color="0.6", lw=0.8)
    axis.set(title="Fig. 11: two cables in space", xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    axis.set(xlim=(-10, 80), ylim=(-10, 80), zlim=(0, 180), xticks=(0, 40, 80), yticks=(0, 40, 80))
    axis.set_box_aspect((1, 1, 2), zoom=0.85)
    axis.view_init(elev=25, azim=-60)
    axis.legend(fontsize=8, loc="lower left", bbox_to_anchor=(-0.25, 0.0))


def bent(cables_mm: tuple[float, float]) -> SpatialEquilibrium:
    """The robot in space with both cables pulled (eq. 13)."""
    solver = SpatialSolver(SpatialRobot.prototype(), Scene())
    return solver.step(solver.rest(), cables_mm)


def _draw_errors(axis: Axes) -> None:
    column = table_1(*calibrated())
    for distance, measured in paper.MEASURED.items():
        axis.plot(paper.LOADS, column - measured, "o-", ms=4, label=f"d = {distance} mm")
    axis.axhspan(-0.9, 0.9, color="0.9", label="± 0.9 g")
    axis.set(title="Table 1: eq. 11 minus measured", xlabel="cable load [g]", ylabel="error [g]")
    axis.legend(fontsize=8)


def reproduce(folder: Path) -> list[Claim]:
    """Write ``paper.png`` and ``paper.json`` into a folder and return the claims."""
    folder.mkdir(parents=True, exist_ok=True)
    found = claims()
    draw(folder / "paper.png")
    write_text(folder / "paper.json", json.dumps([asdict(claim) for claim in found], indent=2) + "\n")
    return found
