"""Figures of an evaluation."""

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from agents.benchmark.evaluate import Episode
from agents.benchmark.shapes import draw_shape, draw_shape_in_space
from agents.benchmark.statistics import profile
from agents.config import POLICIES
from agents.files import JsonObject, replacing
from agents.learning.actor import LearningCurve
from solver.spatial import SpatialEquilibrium

FORCE, ESTIMATE, GOAL = "C0", "C1", "0.3"
COLUMNS = 4
NARROW = 0.02  # intervals that cannot be seen, over the largest error of the axes: they get a diamond


def draw_episodes(episodes: dict[str, tuple[Episode, ...]], path: Path) -> None:
    """Draw the force over each policy's first episodes, and the last policy's shape at four instants."""
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
    for axis, step in zip(axes[-1], instants(episode), strict=True):
        _draw_instant(figure, axis, name, episode, step)
    _save(figure, path)


def _draw_instant(figure: Figure, axis: Axes, name: str, episode: Episode, step: int) -> None:
    """Draw the shape after a step of an episode, on axes in space where the robot is."""
    equilibrium = episode.equilibria[step]
    title = f"{name}, step {step + 1}: {1e3 * episode.force[step]:.0f} of {1e3 * episode.goal[step]:.0f} mN"
    if isinstance(equilibrium, SpatialEquilibrium):
        spec = axis.get_subplotspec()
        axis.remove()
        axis = figure.add_subplot(spec, projection="3d")
        draw_shape_in_space(axis, equilibrium)
    else:
        draw_shape(axis, equilibrium)
    axis.set_title(title, fontsize=10)


def draw_scores(summaries: dict[str, dict[str, JsonObject]], out: Path) -> None:
    """Draw the interquartile means of the force error with their intervals, on axes for each environment."""
    figure, axes = _grid(len(summaries))
    for axis, (env_id, policies) in zip(axes, summaries.items(), strict=False):
        largest = max(summary["rmse_interval_mn"][1] for summary in policies.values())
        for row, (name, summary) in enumerate(policies.items()):
            middle, (low, high) = summary["rmse_iqm_mn"], summary["rmse_interval_mn"]
            axis.barh(row, high - low, left=low, color=_color(name), alpha=0.6)
            axis.plot([middle, middle], [row - 0.4, row + 0.4], color="k", lw=1.5)
            if high - low <= NARROW * largest:
                axis.plot(middle, row, "D", color=_color(name), mec="k", ms=6, clip_on=False, zorder=5)
        axis.set_yticks(range(len(policies)), list(policies), fontsize=8)
        axis.set(title=env_id, xlabel="force error [mN]", xlim=(0, None))
        axis.invert_yaxis()
        axis.grid(alpha=0.3, axis="x")
    _save(figure, out / "scores.png")


def draw_profiles(errors: dict[str, dict[str, np.ndarray]], out: Path) -> None:
    """Draw the performance profiles: the share of episodes whose force error is at most a level."""
    figure, axes = _grid(len(errors))
    levels = np.geomspace(0.1, 200.0, 200)
    for axis, (env_id, policies) in zip(axes, errors.items(), strict=False):
        for name, samples in policies.items():
            axis.plot(levels, profile(samples, levels), color=_color(name), label=name, lw=1.5)
        axis.set(title=env_id, xlabel="force error [mN]", ylabel="share of episodes", xscale="log", ylim=(0, 1))
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=7)
    _save(figure, out / "profiles.png")


def draw_curves(curves: dict[str, dict[str, list[LearningCurve]]], out: Path) -> None:
    """Draw the learning curves: the mean over training seeds, and the band between the smallest and the largest."""
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


def _grid(count: int) -> tuple[Figure, list[Axes]]:
    """Return a figure with a number of axes."""
    columns = min(count, COLUMNS)
    rows = -(-count // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(4 * columns, 3.2 * rows), layout="constrained", squeeze=False)
    for axis in axes.flat[count:]:
        axis.remove()
    return figure, list(axes.flat[:count])


def _save(figure: Figure, path: Path) -> None:
    with replacing(path) as partial:
        figure.savefig(partial, dpi=130)
    plt.close(figure)


def _color(policy: str) -> str:
    """Return the colour of a policy, the same in every figure."""
    return f"C{POLICIES.index(policy)}"


def instants(episode: Episode) -> list[int]:
    """Return four characteristic steps: on the way, first contact, half of the set-point, and the end."""
    touch = int(np.argmax(episode.force > 0))
    half = int(np.argmax(episode.force > episode.goal / 2))
    return [touch // 2, touch, half, len(episode.force) - 1]


def draw_force(axis: Axes, episode: Episode) -> None:
    """Draw regulated and estimated force over the steps of an episode."""
    steps = np.arange(1, len(episode.force) + 1)
    goal = 1e3 * episode.goal
    axis.fill_between(steps, 0.95 * goal, 1.05 * goal, color=GOAL, alpha=0.15, lw=0)
    axis.plot(steps, goal, color=GOAL, ls="--", lw=1, label="set-point ± 5 %")
    axis.plot(steps, 1e3 * episode.estimated, color=ESTIMATE, lw=1, ls="--", alpha=0.7, label="virtual-work estimate")
    axis.plot(steps, 1e3 * episode.force, color=FORCE, lw=2, label="regulated force")
    axis.set_ylim(0, 1.1e3 * min(max(episode.estimated.max(), 1.3 * episode.goal.max()), 4 * episode.goal.max()))
    axis.set_xlabel("step")
    axis.grid(alpha=0.3)
