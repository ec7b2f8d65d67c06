"""Signed distances to obstacles, in numpy: negative inside, for points ``(..., d)``."""

from functools import singledispatch

import numpy as np

from solver import Capsule, Circle, Custom, Ellipse, HalfPlane, Obstacle, Polygon, spatial


@singledispatch
def distance(obstacle: Obstacle, points):
    """Return the signed distance; for Ellipse and Custom exact in sign, and of first order near the outline."""
    raise TypeError(f"no distance to {obstacle!r}")


@distance.register(Circle)
@distance.register(spatial.Sphere)
def _(obstacle, points):
    return np.linalg.norm(points - np.array(obstacle.center), axis=-1) - obstacle.radius


@distance.register(HalfPlane)
@distance.register(spatial.HalfSpace)
def _(obstacle, points):
    return (points - np.array(obstacle.point)) @ np.array(obstacle.normal)


@distance.register(Capsule)
@distance.register(spatial.Capsule)
def _(obstacle, points):
    return _to_segment(points, np.array(obstacle.start), np.array(obstacle.end)) - obstacle.radius


@distance.register
def _(obstacle: Ellipse, points):
    x, y = obstacle.axis
    local = (points - np.array(obstacle.center)) @ np.array([[x, -y], [y, x]])
    scaled = local / obstacle.radii
    size = np.linalg.norm(scaled, axis=-1)
    slope = np.linalg.norm(scaled / obstacle.radii, axis=-1)
    return (size - 1) * size / np.maximum(slope, np.finfo(float).tiny)


@distance.register
def _(obstacle: Polygon, points):
    corners = np.array(obstacle.corners)
    after = np.roll(corners, -1, axis=0)
    edges = (after - corners) / np.linalg.norm(after - corners, axis=1)[:, None]
    outward = np.column_stack([edges[:, 1], -edges[:, 0]])
    beyond = (points @ outward.T - (outward * corners).sum(axis=1)).max(axis=-1)
    outside = np.min([_to_segment(points, *ends) for ends in zip(corners, after, strict=True)], axis=0)
    return np.where(beyond > 0, outside, beyond) - obstacle.radius


@distance.register
def _(obstacle: Custom, points):
    return obstacle.gap(points)


@distance.register
def _(obstacle: spatial.Cylinder, points):
    start, end = np.array(obstacle.start), np.array(obstacle.end)
    length = np.linalg.norm(end - start)
    offset, axis = points - (start + end) / 2, (end - start) / length
    along = offset @ axis
    across = np.linalg.norm(offset - along[..., None] * axis, axis=-1)
    core = obstacle.radius - obstacle.edge, length / 2 - obstacle.edge
    return _beyond(np.stack([across - core[0], np.abs(along) - core[1]], axis=-1)) - obstacle.edge


@distance.register
def _(obstacle: spatial.Box, points):
    local = (points - np.array(obstacle.center)) @ obstacle.axes.T
    return _beyond(np.abs(local) - (np.array(obstacle.sizes) / 2 - obstacle.edge)) - obstacle.edge


def depth(obstacle, points):
    """Return the depth of points inside; for outlines without a closed form that of an inscribed polygon."""
    if not isinstance(obstacle, Ellipse | Custom):
        return -distance(obstacle, points)
    outline = obstacle.outline()
    ends = zip(outline, np.roll(outline, -1, axis=0), strict=True)
    to_outline = np.min([_to_segment(points, start, end) for start, end in ends], axis=0)
    return np.where(distance(obstacle, points) < 0, to_outline, -to_outline)


def _beyond(excess):
    outside = np.linalg.norm(np.maximum(excess, 0), axis=-1)
    return np.where(excess.max(axis=-1) > 0, outside, excess.max(axis=-1))


def _to_segment(points, start, end):
    way = end - start
    share = np.clip(((points - start) @ way) / (way @ way), 0, 1)
    return np.linalg.norm(points - start - share[..., None] * way, axis=-1)
