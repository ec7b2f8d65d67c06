"""Surfaces of obstacles and disks as triangles, in units of the robot's length."""

from typing import NamedTuple

import numpy as np

from agents.play.shapes import to_page
from solver import HalfPlane, Obstacle
from solver.spatial import HalfSpace

DEPTH = 0.06  # half the thickness at which obstacles of the plane are shown [L]
WALL, PLATE = 0.45, 0.07  # half the side of the shown part of a wall, and of a load cell [L]
THICKNESS = 0.03  # of either [L]
SIDES = 24  # of a disk
LINE = 0.0012  # half the width of a line of the grid [L]
BOX = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
BOX_QUADS = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])


class Mesh(NamedTuple):
    """Triangles about an obstacle's middle.

    Attributes:
        vertices: Corners, ``(k, 3)`` [L].
        faces: Indices of the corners of each triangle, ``(f, 3)``.
    """

    vertices: np.ndarray
    faces: np.ndarray


def mesh_of(obstacle: Obstacle, length_mm: float) -> Mesh:
    """Return the surface of an obstacle about :func:`middle_of`."""
    if isinstance(obstacle, HalfPlane | HalfSpace):
        return _slab(obstacle)
    outline = to_page(obstacle.outline() - np.array(obstacle.extent.center), length_mm)
    return _prism(outline) if outline.ndim == 2 else _grid(outline)


def middle_of(obstacle: Obstacle, length_mm: float) -> np.ndarray:
    """Return the point of an obstacle that is dragged: its middle, of a wall the given point, ``(3,)`` [L]."""
    return to_page(np.array(obstacle.extent.center), length_mm)


def sizes_of(obstacle: Obstacle) -> tuple[object, ...]:
    """Return what tells surfaces of an obstacle apart that is moved and resized."""
    return tuple(getattr(obstacle, name) for name in obstacle.size_fields)


def disk(radius: float, thickness: float) -> Mesh:
    """Return a disk whose axis is z."""
    angles = np.linspace(0, 2 * np.pi, SIDES, endpoint=False)
    rim = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    ends = [np.column_stack([rim, np.full(SIDES, height)]) for height in (-thickness / 2, thickness / 2)]
    return _closed(*ends)


def grid(planar: bool) -> Mesh:
    """Return a square grid a tenth of the length wide, behind a planar robot or below one in space.

    Thin strips are drawn several times faster than lines, or than the grid of the library, which shades every pixel.
    """
    corners = np.array([(-1.0, -LINE), (1.0, -LINE), (1.0, LINE), (-1.0, LINE)])
    along = np.concatenate([corners + np.array([0.0, place]) for place in np.arange(-10, 11) / 10])
    flat = np.concatenate([along, along[:, ::-1]])
    faces = _triangles(np.arange(len(flat)).reshape(-1, 4))
    if planar:
        return Mesh(np.column_stack([flat[:, 0], np.full(len(flat), 0.3), 0.4 + flat[:, 1]]), faces)
    return Mesh(np.column_stack([flat, np.zeros(len(flat))]), faces)


def _prism(outline: np.ndarray) -> Mesh:
    """Return the convex outline in the page's plane of x and z, ``(k, 3)``, as a body."""
    depth = np.array([0.0, DEPTH, 0.0])
    return _closed(outline + depth, outline - depth)


def _closed(low: np.ndarray, high: np.ndarray) -> Mesh:
    """Return a body between two convex polygons ``(k, 3)``, counter-clockwise seen from the second."""
    count = len(low)
    here = np.arange(count)
    after = np.roll(here, -1)
    sides = [np.column_stack([here, after, after + count]), np.column_stack([here, after + count, here + count])]
    fan = np.column_stack([np.zeros(count - 2, int), here[1:-1], here[2:]])
    return Mesh(np.concatenate([low, high]), np.concatenate([*sides, fan[:, ::-1], fan + count]))


def _grid(surface: np.ndarray) -> Mesh:
    """Return a surface given as a grid of points, ``(u, v, 3)``."""
    rows, columns = surface.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    corners = [index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]]
    return Mesh(surface.reshape(-1, 3), _triangles(np.stack(corners, axis=-1).reshape(-1, 4)))


def _slab(wall: HalfPlane | HalfSpace) -> Mesh:
    """Return a piece of a wall behind its surface, of a load cell its plate."""
    normal = to_page(np.array(wall.normal), 1.0)
    helper = np.array([0.0, 1.0, 0.0]) if abs(normal[1]) < 0.9 else np.array([1.0, 0.0, 0.0])
    across = np.cross(normal, helper)
    across /= np.linalg.norm(across)
    along = np.cross(normal, across)
    half = WALL if wall.nodes is None else PLATE
    deep = half if wall.space == 3 else 2 * DEPTH
    halves = np.array([half, deep, THICKNESS / 2])
    vertices = (BOX * halves) @ np.stack([across, along, normal]) - THICKNESS / 2 * normal
    return Mesh(vertices, _triangles(BOX_QUADS))


def _triangles(quads: np.ndarray) -> np.ndarray:
    """Return two triangles for each quadrilateral ``(k, 4)``."""
    return np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
