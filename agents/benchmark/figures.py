"""Figures of an evaluation."""

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from agents.benchmark.evaluate import Episode
from agents.benchmark.statistics import profile
from agents.config import POLICIES
from agents.files import replacing
from agents.learning.actor import Curve
from solver import Equilibrium, HalfPlane
from solver.spatial import SpatialEquilibrium

TRUE, ESTIMATE, GOAL, BACKBONE, CABLE, OBSTACLE = "C0", "C1", "0.3", "#1f3a7a", "#a06a4a", "#c9d1de"
COLUMNS = 4


def draw_episodes(episodes: dict[str, tuple[Episode, ...]], path: Path) -> None:
    """Force against set-point of each policy's first episodes, and the last policy's shape at four instants."""
    rows = len(episodes) + 1
    figure, axes = plt.subplots(rows, COLUMNS, figsize=(13, 3.1 * rows), layout="constrained")
    for row, (name, played) in zip(axes, episodes.items(), strict=False):
        for column, axis in enumerate(row):
            if column >= len(played):
                axis.remove()
                continue
            draw_force(axis, played[column])
            axis.set_title(f"{name}, episode {column + 1}", fontsize=10)
        row[0].set_ylabel("contact force [mN]")
    axes[0, 0].legend(fontsize=8, loc="best")
    name, (episode, *_) = list(episodes.items())[-1]
    for column, step in enumerate(instants(episode)):
        axis, equilibrium = axes[-1, column], episode.equilibria[step]
        if isinstance(equilibrium, SpatialEquilibrium):
            axis.remove()
            axis = axes[-1, column] = figure.add_subplot(
                rows, COLUMNS, (rows - 1) * COLUMNS + column + 1, projection="3d"
            )
            draw_shape_in_space(axis, equilibrium)
        else:
            draw_shape(axis, equilibrium)
        axis.set_title(
            f"{name}, step {step + 1}: {1e3 * episode.true[step]:.0f} of {1e3 * episode.goal[step]:.0f} mN", fontsize=10
        )
    _save(figure, path)


def draw_scores(summaries: dict[str, dict[str, dict[str, Any]]], out: Path) -> None:
    """Interquartile means of the force error with their intervals, an axis for each environment."""
    figure, axes = _grid(len(summaries))
    for axis, (env_id, policies) in zip(axes, summaries.items(), strict=False):
        for place, (name, summary) in enumerate(policies.items()):
            middle, (low, high) = summary["rmse_iqm_mn"], summary["rmse_interval_mn"]
            axis.barh(place, high - low, left=low, color=_color(name), alpha=0.6)
            axis.plot([middle, middle], [place - 0.4, place + 0.4], color="k", lw=1.5)
        axis.set_yticks(range(len(policies)), policies, fontsize=8)
        axis.set(title=env_id, xlabel="force error [mN]", xlim=(0, None))
        axis.invert_yaxis()
        axis.grid(alpha=0.3, axis="x")
    _save(figure, out / "scores.png")


def draw_profiles(errors: dict[str, dict[str, np.ndarray]], out: Path) -> None:
    """Performance profiles: the share of episodes whose force error is at most a level."""
    figure, axes = _grid(len(errors))
    levels = np.geomspace(0.1, 200.0, 200)
    for axis, (env_id, policies) in zip(axes, errors.items(), strict=False):
        for name, samples in policies.items():
            axis.plot(levels, profile(samples, levels), color=_color(name), label=name, lw=1.5)
        axis.set(title=env_id, xlabel="force error [mN]", ylabel="share of episodes", xscale="log", ylim=(0, 1))
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=7)
    _save(figure, out / "profiles.png")


def draw_curves(curves: dict[str, dict[str, list[Curve]]], out: Path) -> None:
    """Learning curves: the mean of the training seeds, and the band between the least and the largest of them."""
    figure, axes = _grid(len(curves))
    for axis, (env_id, learners) in zip(axes, curves.items(), strict=False):
        for name, seeds in learners.items():
            count = min(len(curve.steps) for curve in seeds)
            steps = np.array(seeds[0].steps[:count]) / 1e3
            returns = np.array([curve.returns[:count] for curve in seeds])
            axis.plot(steps, returns.mean(axis=0), color=_color(name), label=name, lw=1.5)
            axis.fill_between(steps, returns.min(axis=0), returns.max(axis=0), color=_color(name), alpha=0.25, lw=0)
        axis.set(title=env_id, xlabel="thousand steps", ylabel="return")
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=7)
    _save(figure, out / "curves.png")


def _grid(count: int) -> tuple[Any, list[Axes]]:
    """Axes for so many environments."""
    columns = min(count, COLUMNS)
    rows = -(-count // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(4 * columns, 3.2 * rows), layout="constrained", squeeze=False)
    for axis in axes.flat[count:]:
        axis.remove()
    return figure, list(axes.flat[:count])


def _save(figure: Any, path: Path) -> None:
    with replacing(path) as partial:
        figure.savefig(partial, dpi=130)
    plt.close(figure)


def _color(policy: str) -> str:
    """The colour of a policy, the same in every figure."""
    return f"C{POLICIES.index(policy)}"


def instants(episode: Episode) -> list[int]:
    """Four telling steps: on the way, the first touch, at half the set-point, the end."""
    touch = int(np.argmax(episode.true > 0))
    half = int(np.argmax(episode.true > episode.goal / 2))
    return [touch // 2, touch, half, len(episode.true) - 1]


def draw_force(axis: Axes, episode: Episode) -> None:
    """True and estimated force over the steps of an episode."""
    steps = np.arange(1, len(episode.true) + 1)
    goal = 1e3 * episode.goal
    axis.fill_between(steps, 0.95 * goal, 1.05 * goal, color=GOAL, alpha=0.15, lw=0)
    axis.plot(steps, goal, color=GOAL, ls="--", lw=1, label="set-point ± 5 %")
    axis.plot(steps, 1e3 * episode.estimated, color=ESTIMATE, lw=1, ls="--", alpha=0.7, label="virtual-work estimate")
    axis.plot(steps, 1e3 * episode.true, color=TRUE, lw=2, label="true")
    axis.set_ylim(0, 1.1e3 * min(max(episode.estimated.max(), 1.3 * episode.goal.max()), 4 * episode.goal.max()))
    axis.set_xlabel("step")
    axis.grid(alpha=0.3)


def draw_shape(axis: Axes, equilibrium: Equilibrium) -> None:
    """Backbone, cable, disks, obstacles and contacts."""
    nodes, cable = equilibrium.nodes, equilibrium.cable_nodes
    for obstacle in equilibrium.scene_now:
        if not isinstance(obstacle, HalfPlane):
            axis.fill(*obstacle.outline().T, facecolor=OBSTACLE, edgecolor="0.4")
        else:
            axis.plot(*_plate(obstacle, nodes[:, :2]).T, color="0.4", lw=4, solid_capstyle="butt")
    for node, hole in zip(nodes, cable, strict=True):
        axis.plot([node[0], hole[0]], [node[1], hole[1]], color="0.6", lw=1)
    axis.plot(nodes[:, 0], nodes[:, 1], color=BACKBONE, lw=2.5)
    axis.plot(cable[:, 0], cable[:, 1], color=CABLE, lw=1)
    touched: np.ndarray = np.asarray(equilibrium.contact.any(axis=0))
    axis.plot(*equilibrium.points[touched].T, "o", color="crimson", ms=6, mfc="none")
    axis.set(aspect="equal", xlim=(-25, 125), ylim=(-5, 190), xlabel="x [mm]", ylabel="y [mm]")
    axis.grid(alpha=0.3)


def draw_shape_in_space(axis: Any, equilibrium: SpatialEquilibrium) -> None:
    """Backbone, pulled cables, disks, obstacles and contacts."""
    for obstacle in equilibrium.scene_now:
        axis.plot_surface(*np.moveaxis(obstacle.outline(), -1, 0), color=OBSTACLE, alpha=0.6, lw=0)
    turns = np.linspace(0, 2 * np.pi, 25)
    circle = equilibrium.robot.offset_mm * np.column_stack([np.cos(turns), np.sin(turns)])
    for node, frame in zip(equilibrium.nodes, equilibrium.frames, strict=True):
        axis.plot(*(node + circle @ frame[:, :2].T).T, color="0.6", lw=0.8)
    axis.plot(*equilibrium.nodes.T, color=BACKBONE, lw=2.5)
    for cable in equilibrium.pulled:
        axis.plot(*cable.T, color=CABLE, lw=1)
    touched: np.ndarray = np.asarray(equilibrium.contact.any(axis=0))
    axis.plot(*equilibrium.points[touched].T, "o", color="crimson", ms=6, mfc="none")
    axis.set(xlim=(-90, 90), ylim=(-90, 90), zlim=(0, 180), xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    axis.set_box_aspect((1, 1, 1), zoom=0.85)
    axis.tick_params(labelsize=7)


def _plate(wall: HalfPlane, backbone: np.ndarray) -> np.ndarray:
    """Ends of the part of a wall that is drawn, ``(2, 2)`` [mm]: a plate if only some nodes touch it, else all."""
    half = 200.0 if wall.nodes is None else 15.0
    touching = backbone[list(wall.nodes or range(len(backbone)))]
    center = wall.nearest(touching.mean(axis=0))
    return np.asarray(center + half * np.array([[-1.0], [1.0]]) * wall.axes[1])
