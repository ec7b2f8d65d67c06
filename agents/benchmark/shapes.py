"""Figures of equilibria."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from solver import Equilibrium, HalfPlane
from solver.spatial import SpatialEquilibrium

BACKBONE, CABLE, OBSTACLE = "#1f3a7a", "#a06a4a", "#c9d1de"
Axes3D = Any  # matplotlib does not type its axes in space


def draw_shape(axis: Axes, equilibrium: Equilibrium) -> None:
    """Draw backbone, cable, disks, obstacles and contacts."""
    nodes, cable = equilibrium.nodes, equilibrium.cable_nodes
    for obstacle in equilibrium.scene_now:
        if not isinstance(obstacle, HalfPlane):
            axis.fill(*obstacle.outline().T, facecolor=OBSTACLE, edgecolor="0.4")
        else:
            axis.plot(*plate(obstacle, nodes[:, :2]).T, color="0.4", lw=4, solid_capstyle="butt")
    for node, hole in zip(nodes, cable, strict=True):
        axis.plot([node[0], hole[0]], [node[1], hole[1]], color="0.6", lw=1)
    axis.plot(nodes[:, 0], nodes[:, 1], color=BACKBONE, lw=2.5)
    axis.plot(cable[:, 0], cable[:, 1], color=CABLE, lw=1)
    axis.plot(*_contacts(equilibrium).T, "o", color="crimson", ms=6, mfc="none")
    length = equilibrium.robot.longest_mm
    axis.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    axis.set(xlim=(-0.14 * length, 0.7 * length), ylim=(-0.03 * length, 1.06 * length))
    axis.grid(alpha=0.3)


def draw_shape_in_space(axis: Axes3D, equilibrium: SpatialEquilibrium) -> None:
    """Draw backbone, pulled cables, disks, obstacles and contacts."""
    for obstacle in equilibrium.scene_now:
        axis.plot_surface(*np.moveaxis(obstacle.outline(), -1, 0), color=OBSTACLE, alpha=0.6, lw=0)
    turns = np.linspace(0, 2 * np.pi, 25)
    circle = equilibrium.robot.offset_mm * np.column_stack([np.cos(turns), np.sin(turns)])
    for node, frame in zip(equilibrium.nodes, equilibrium.frames, strict=True):
        axis.plot(*(node + circle @ frame[:, :2].T).T, color="0.6", lw=0.8)
    axis.plot(*equilibrium.nodes.T, color=BACKBONE, lw=2.5)
    for cable in equilibrium.pulled:
        axis.plot(*cable.T, color=CABLE, lw=1)
    axis.plot(*_contacts(equilibrium).T, "o", color="crimson", ms=6, mfc="none")
    length = equilibrium.robot.length_mm
    sideways = (-length / 2, length / 2)
    axis.set(xlim=sideways, ylim=sideways, zlim=(0, length), xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    axis.set_box_aspect((1, 1, 1), zoom=0.85)
    axis.tick_params(labelsize=7)


def _contacts(equilibrium: Equilibrium | SpatialEquilibrium) -> np.ndarray:
    """Return the points that touch, ``(k, d)`` [mm]."""
    touching: np.ndarray = np.asarray(equilibrium.contact.any(axis=0))
    return np.asarray(equilibrium.points[touching])


def plate(wall: HalfPlane, backbone: np.ndarray) -> np.ndarray:
    """Return the ends of the visible part of a wall, ``(2, 2)`` [mm]: a plate if only some nodes touch it."""
    length = np.linalg.norm(np.diff(backbone, axis=0), axis=1).sum()
    half = length if wall.nodes is None else length / 12
    touching = backbone[list(wall.nodes or range(len(backbone)))]
    center = wall.nearest(touching.mean(axis=0))
    return np.asarray(center + half * np.array([[-1.0], [1.0]]) * wall.axes[1])
