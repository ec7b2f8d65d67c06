"""Pictures of the six scenes: both models side by side, with their contact forces in newton."""

from pathlib import Path
from typing import NamedTuple

import matplotlib
import numpy as np
from PIL import Image

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from agents.benchmark.shapes import BACKBONE, CABLE, OBSTACLE, Axes3D, draw_shape_in_space, plate
from agents.files import replacing, write_text
from agents.paper.scenes import CASES, AnyEquilibrium, Case, page, read, states
from solver import Equilibrium, HalfPlane
from solver.spatial import SpatialEquilibrium

FORCE, DISK = "#c81e3a", "#8a93a6"
LONGEST_MM = 42.0  # arrow of the largest force of a picture
POINTS_PER_MM, HEAD = 1.5, 12.0  # size of a picture in the plane, and of the head of an arrow that is long enough [pt]
LABEL_X_MM, LABEL_MM = -58.0, 25.0  # where forces are written: from x on in the plane, before the arrow in space
ZOOM_MM = 21.0  # half of the window around a contact
COLORS = 96  # of the palette, which makes files a third as large


def write_two_models(folder: Path) -> None:
    """Write the page ``two_models.md`` and its pictures, in ``two_models/``, into a folder."""
    (folder / "two_models").mkdir(parents=True, exist_ok=True)
    readings = {}
    for case in CASES:
        both = states(case)
        readings[case.name] = {model: read(state) for model, state in both.items()}
        draw_case(folder / "two_models" / f"{case.name}.png", case, both)
    write_text(folder / "two_models.md", page(readings))


def draw_case(path: Path, case: Case, both: dict[str, AnyEquilibrium]) -> None:
    """Draw one scene in both models."""
    projection = None if len(case.pulls_mm) == 1 else "3d"
    figure, axes = plt.subplots(1, 2, figsize=(9.0, 5.3), subplot_kw={"projection": projection}, layout="constrained")
    strongest = max(float(np.linalg.norm(state.forces, axis=1).max()) for state in both.values())
    zoomed = int(np.linalg.norm(both["paper"].forces, axis=1).argmax())  # the same obstacle in both
    for axis, (model, state) in zip(axes, both.items(), strict=True):
        axis.set_title(f'model="{model}"', fontsize=11, family="monospace")
        if isinstance(state, SpatialEquilibrium):
            _draw_in_space(axis, state, LONGEST_MM / strongest)
        else:
            _draw_in_plane(axis, state, LONGEST_MM / strongest, zoomed)
    figure.supxlabel(f"arrows: force on the obstacle, 10 mm long for {10 * strongest / LONGEST_MM:.2g} N", fontsize=10)
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    """Write a figure with few colours."""
    figure.set_dpi(100)
    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())[..., :3]  # type: ignore[attr-defined]
    with replacing(path) as partial:
        Image.fromarray(np.ascontiguousarray(pixels)).quantize(COLORS).save(partial, optimize=True)
    plt.close(figure)


class Arrow(NamedTuple):
    """A contact force as it is drawn.

    Attributes:
        obstacle: Index of the obstacle.
        place: Point that touches, of several their mean by multipliers [mm].
        vector: The arrow from there, along the force on the obstacle [mm].
        force: The force [N].
    """

    obstacle: int
    place: np.ndarray
    vector: np.ndarray
    force: float


def arrows(state: AnyEquilibrium, scale: float) -> list[Arrow]:
    """Return the forces on all obstacles that are pushed, as arrows to a scale in mm/N."""
    shown = []
    for obstacle, (multipliers, force) in enumerate(zip(state.multipliers, state.forces, strict=True)):
        size = float(np.linalg.norm(force))
        if size > 0:
            place = np.tensordot(multipliers / multipliers.sum(), state.points, axes=2)
            shown.append(Arrow(obstacle, place, -scale * force, size))
    return shown


def _draw_in_plane(axis: Axes, state: Equilibrium, scale: float, zoomed: int) -> None:
    axis.set(aspect="equal", xlim=(-62, 118), ylim=(-8, 184), xlabel="x [mm]", ylabel="y [mm]")
    axis.grid(alpha=0.2)
    _draw_bodies(axis, state)
    for arrow in arrows(state, scale):
        _draw_arrow(axis, arrow)
        if arrow.obstacle == zoomed:
            _draw_zoom(axis, state, arrow.place)


def _draw_zoom(axis: Axes, state: Equilibrium, place: np.ndarray) -> None:
    """Draw the surroundings of a contact, enlarged, where the picture is empty."""
    zoom = axis.inset_axes((0.59, 0.02, 0.39, 0.39))
    _draw_bodies(zoom, state, wide=2.0)
    (x, y), half = place, ZOOM_MM
    zoom.set(aspect="equal", xlim=(x - half, x + half), ylim=(y - half, y + half), xticks=[], yticks=[])
    axis.add_patch(Rectangle((x - half, y - half), 2 * half, 2 * half, fill=False, edgecolor="0.4", alpha=0.7))


def _draw_bodies(axis: Axes, state: Equilibrium, wide: float = 1.0) -> None:
    """Draw obstacles and robot, with disks across the backbone."""
    nodes, holes = state.nodes[:, :2], state.cable_nodes
    for obstacle in state.scene_now:
        if isinstance(obstacle, HalfPlane):
            axis.plot(*plate(obstacle, nodes).T, color="0.45", lw=4 * wide, solid_capstyle="butt")
        else:
            axis.fill(*obstacle.outline().T, facecolor=OBSTACLE, edgecolor="0.5", lw=0.8)
    rims = np.stack([2 * nodes - holes, holes], axis=1)
    for rim in rims:
        axis.plot(*rim.T, color=DISK, lw=1.3 * wide, solid_capstyle="round")
    axis.plot(*holes.T, color=CABLE, lw=0.9 * wide)
    axis.plot(*nodes.T, color=BACKBONE, lw=2.2 * wide, solid_joinstyle="round")
    touching = state.points[state.contact.any(axis=0)]
    axis.plot(*touching.T, "o", color=FORCE, ms=4 * wide, zorder=4)


def _draw_arrow(axis: Axes, arrow: Arrow) -> None:
    """Draw a force, and write it at the left edge, with a line to the arrow."""
    end = arrow.place + arrow.vector
    head = min(HEAD, POINTS_PER_MM * float(np.linalg.norm(arrow.vector)) / 0.6)
    style = {"arrowstyle": "-|>", "color": FORCE, "lw": 1.8, "mutation_scale": head, "shrinkA": 0, "shrinkB": 0}
    axis.annotate("", tuple(end), tuple(arrow.place), arrowprops=style, zorder=5)
    x, y = min(end.tolist(), arrow.place.tolist())
    line = {"arrowstyle": "-", "color": FORCE, "lw": 0.7, "ls": ":"}
    label = f"{arrow.force:.2g} N"
    axis.annotate(
        label, (x, y), (LABEL_X_MM, y), arrowprops=line, color=FORCE, va="center", fontsize=9.5, weight="bold"
    )


def _draw_in_space(axis: Axes3D, state: SpatialEquilibrium, scale: float) -> None:
    axis.computed_zorder = False  # the robot is in front of the obstacles
    draw_shape_in_space(axis, state)
    for arrow in arrows(state, scale):
        axis.quiver(*arrow.place, *arrow.vector, color=FORCE, lw=2.0, arrow_length_ratio=0.25, zorder=5)
        along = arrow.vector / np.linalg.norm(arrow.vector)
        label = arrow.place - LABEL_MM * along
        axis.text(*label, f"{arrow.force:.2g} N", color=FORCE, ha="right", fontsize=9.5, weight="bold", zorder=6)
    axis.set(xlim=(-30, 110), ylim=(-70, 70), zlim=(0, 180), xticks=(0, 50, 100), yticks=(-50, 0, 50))
    axis.set_box_aspect((140, 140, 180), zoom=1.05)
    axis.view_init(elev=18, azim=-65)
