"""Check that no edge between neighbouring points of the robot swept over the core of an obstacle.

For a line of points that can touch, the core of an obstacle is the part deeper than half of the longest edge that the
line can have: a robot whose points stay outside and move continuously never gets there. Between two accepted shapes all
points move in straight lines. For obstacles on springs, points are taken relative to their displacement.
"""

import math

import numpy as np

from soak.shapes import depth, distance
from solver import Robot

DIRECTIONS, RINGS = 6, 16
ZOOMS = 8
SLACK = 1e-9  # of the longest edge, for roundoff


def line_points(robot, nodes, frames=None):
    """Return the points that can touch, of many shapes, ``(k, p, positions, d)``.

    Args:
        robot: The robot.
        nodes: Poses ``(k, n+1, 3)`` in the plane, points in space.
        frames: Frames of the disks in space, ``(k, n+1, 3, 3)``.
    """
    if isinstance(robot, Robot):
        levers = np.stack([np.cos(nodes[..., 2]), np.sin(nodes[..., 2])], axis=-1)
        lines = nodes[:, None, :, :2] + np.array(robot.lines_mm)[:, None, None] * levers[:, None]
    else:
        lines = nodes[:, None] + np.einsum("knij,pj->kpni", frames[..., :2], robot.lines_mm)
    return _subdivide(lines, robot.between)


def _subdivide(lines, between):
    parts = np.arange(between + 1) / (between + 1)
    start, way = lines[:, :, :-1, None], np.diff(lines, axis=2)[:, :, :, None]
    inner = start + parts[:, None] * way
    flat = inner.reshape(*lines.shape[:2], -1, lines.shape[-1])
    return np.concatenate([flat, lines[:, :, -1:]], axis=2)


class CoreCheck:
    """Finds swept cores of the obstacles of one scene.

    Obstacles that only some nodes touch have no core, and a point that is outside a wall at both ends of a straight
    line stays outside.
    """

    def __init__(self, robot, scene):
        self.edges = np.array(robot.edges_mm)
        cored = [obstacle.nodes is None and math.isfinite(obstacle.extent.radius) for obstacle in scene]
        self.obstacles = [(j, obstacle) for j, obstacle in enumerate(scene) if cored[j]]
        self.planar = not scene.obstacles or scene.obstacles[0].space == 2
        self._candidates = {j: _candidates(obstacle) for j, obstacle in self.obstacles} if self.planar else {}

    def swept(self, points, displacements, linked=True):
        """Return which obstacles' cores were swept between consecutive shapes, ``(k-1, m)`` bool.

        Args:
            points: The points that can touch, ``(k, p, positions, d)`` [mm].
            displacements: Displacements of the obstacles, ``(k, m, d)`` [mm].
            linked: Which neighbouring shapes belong to the same motion, ``(k-1,)`` bool.
        """
        swept = np.zeros((len(points) - 1, displacements.shape[1]), bool)
        low, high = points.min(axis=2), points.max(axis=2)
        for j, obstacle in self.obstacles:
            moved = displacements[:, j]
            near = _reaches(obstacle, low - moved[:, None], high - moved[:, None]) & np.transpose([linked])
            for line in np.flatnonzero(near.any(axis=0)):
                steps = np.flatnonzero(near[:, line])
                before, after = (points[k, line] - moved[k, None] for k in (steps, steps + 1))
                swept[steps, j] |= self._is_swept(j, obstacle, before, after, self.edges[line])
        return swept

    def _is_swept(self, j, obstacle, before, after, longest):
        if not self.planar:
            return _deepest_patch(obstacle, before, after, longest)
        points, depths = self._candidates[j]
        core = (depths > longest * (0.5 + SLACK)).reshape(RINGS, -1)
        outermost = core & (np.cumsum(core, axis=0) == 1)
        seen_from = np.unique(points[outermost.ravel()], axis=0)
        return (windings(before, after, seen_from) != 0).any(axis=-1)


def windings(before, after, points):
    """Return how often edges of lines ``(k, n, 2)`` crossed points ``(s, 2)`` in a straight motion, ``(k, s)``.

    It is the winding number, about the point, of the closed path along the line before, with its end to the line
    after, back along that line, and with its start to the first one: an edge that sweeps over the point adds a turn.
    """
    way = np.concatenate([before, after[:, ::-1], before[:, :1]], axis=1)
    x, y = (way[:, None, :, axis] - points[:, None, axis] for axis in (0, 1))
    below, above = y[..., :-1] <= 0, y[..., 1:] > 0
    left = x[..., :-1] * y[..., 1:] - x[..., 1:] * y[..., :-1] > 0
    return np.sum(below & above & left, axis=-1) - np.sum(~below & ~above & ~left, axis=-1)


def _candidates(obstacle):
    """Return points in an obstacle, from its outline inwards, ``(RINGS * k, 2)``, and their depths."""
    center, outline = np.array(obstacle.extent.center), obstacle.outline()
    rays = outline[:: max(1, len(outline) // DIRECTIONS)] - center
    shares = np.linspace(1, 0, RINGS + 1)[1:, None, None]
    points = (center + shares * rays).reshape(-1, 2)
    return points, depth(obstacle, points)


def _reaches(obstacle, low, high):
    """Return whether the box around lines before and after a motion meets the ball around an obstacle, ``(k-1, p)``.

    In a straight motion, points stay in the box.

    Args:
        obstacle: The obstacle.
        low: Least coordinates of lines, ``(k, p, d)`` [mm].
        high: Largest ones.
    """
    center, radius = obstacle.extent[:2]
    below = np.minimum(low[:-1], low[1:]) - np.array(center)
    above = np.array(center) - np.maximum(high[:-1], high[1:])
    outside = np.maximum(np.maximum(below, above), 0)
    return (outside * outside).sum(axis=-1) <= radius * radius


def _deepest_patch(obstacle, before, after, longest):
    """Return whether any edge of lines ``(k, n, 3)`` got deeper than half of the longest one, ``(k,)``.

    The depth is concave on the patch that an edge sweeps, as long as the patch is flat, so zooming in finds its
    largest value.
    """
    swept = np.zeros(len(before), bool)
    corners = np.stack([before[:, :-1], before[:, 1:], after[:, :-1], after[:, 1:]], axis=2)  # (k, n-1, 4, 3)
    middle = corners.mean(axis=2)
    reach = np.linalg.norm(corners - middle[:, :, None], axis=-1).max(axis=-1)
    where = np.argwhere(distance(obstacle, middle) < reach - longest / 2)
    if len(where):
        deepest = _zoom(obstacle, corners[tuple(where.T)])
        swept[where[deepest > longest * (0.5 + SLACK), 0]] = True
    return swept


def _zoom(obstacle, corners):
    """Return the largest depth on each patch ``(c, 4, 3)``, ``(c,)``."""
    center, width = np.full((len(corners), 2), 0.5), 0.5
    grid = np.stack(np.meshgrid(*2 * [np.linspace(-1, 1, 5)], indexing="ij"), axis=-1).reshape(-1, 2)
    for _ in range(ZOOMS):
        uv = np.clip(center[:, None] + width * grid, 0, 1)
        u, v = uv[..., :1], uv[..., 1:]
        a, b, c, d = (corners[:, None, k] for k in range(4))
        depths = -distance(obstacle, (1 - u) * ((1 - v) * a + v * b) + u * ((1 - v) * c + v * d))
        best = depths.argmax(axis=1)
        center = np.take_along_axis(uv, best[:, None, None], axis=1)[:, 0]
        width *= 0.6
    return depths.max(axis=1)
