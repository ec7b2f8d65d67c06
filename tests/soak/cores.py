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
        self._seen_from = {j: _seen_from(obstacle, self.edges) for j, obstacle in self.obstacles} if self.planar else {}

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
            least, most = low - moved[:, None], high - moved[:, None]
            near = _reach(obstacle, np.minimum(least[:-1], least[1:]), np.maximum(most[:-1], most[1:]), self.edges)
            near &= np.transpose([linked])
            for line in np.flatnonzero(near.any(axis=0)):
                steps = np.flatnonzero(near[:, line])
                before, after = (points[k, line] - moved[k, None] for k in (steps, steps + 1))
                if self.planar:
                    swept[steps, j] |= _sweeps(before, after, self._seen_from[j][line]).any(axis=-1)
                else:
                    swept[steps, j] |= _deepest_patch(obstacle, before, after, self.edges[line])
        return swept


def _seen_from(obstacle, edges):
    """Return, for each line, the outermost points of an obstacle's core on some rays, a list of ``(s, 2)``."""
    points, depths = _candidates(obstacle)
    cores = [(depths > longest * (0.5 + SLACK)).reshape(RINGS, -1) for longest in edges]
    outermost = [core & (np.cumsum(core, axis=0) == 1) for core in cores]
    return [np.unique(points[chosen.ravel()], axis=0) for chosen in outermost]


def _sweeps(before, after, points):
    """Return the :func:`windings` of lines about points, as the sum of those of all edges, of which few come near."""
    corners = _corners(before, after)
    low, high = points.min(axis=0, initial=math.inf), points.max(axis=0, initial=-math.inf)
    near = ((corners.min(axis=0) <= high) & (corners.max(axis=0) >= low)).all(axis=-1)
    steps, edges = np.nonzero(near)
    ends = np.column_stack([edges, edges + 1])
    turns = np.zeros((len(before), len(points)), int)
    np.add.at(turns, steps, windings(before[steps[:, None], ends], after[steps[:, None], ends], points))
    return turns


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


def _reach(obstacle, low, high, longest):
    """Return whether boxes, given by their corners ``(..., d)``, reach the ball around an obstacle's core, ``(...)``.

    In a straight motion, edges stay in the box around them before and after.
    """
    center, radius = obstacle.extent[:2]
    outside = np.maximum(np.maximum(low - np.array(center), np.array(center) - high), 0)
    return (outside * outside).sum(axis=-1) <= np.maximum(radius - longest / 2, 0) ** 2


def _deepest_patch(obstacle, before, after, longest):
    """Return whether any edge of lines ``(k, n, 3)`` got deeper than half of the longest one, ``(k,)``.

    The depth is concave on the patch that an edge sweeps, as long as the patch is flat, so zooming in finds its
    largest value.
    """
    swept = np.zeros(len(before), bool)
    corners = _corners(before, after)
    steps, edges = np.nonzero(_reach(obstacle, corners.min(axis=0), corners.max(axis=0), longest))
    patches = np.moveaxis(corners[:, steps, edges], 0, 1)  # (c, 4, 3)
    middle = patches.mean(axis=1)
    reach = np.linalg.norm(patches - middle[:, None], axis=-1).max(axis=-1)
    deep = distance(obstacle, middle) < reach - longest / 2
    if deep.any():
        swept[steps[deep][_zoom(obstacle, patches[deep]) > longest * (0.5 + SLACK)]] = True
    return swept


def _corners(before, after):
    """Return the corners of the patches that edges of lines ``(k, n, d)`` sweep, ``(4, k, n-1, d)``."""
    return np.stack([before[:, :-1], before[:, 1:], after[:, :-1], after[:, 1:]])


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
