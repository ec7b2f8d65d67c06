"""Normals and axes of obstacles keep their bits in copies, so that an obstacle that only shifts has not turned."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Capsule, Custom, Ellipse, Family, HalfPlane, spatial

SAMPLES = 2000
ROUND = Family.trace(lambda point, sizes: point[0] ** 2 + point[1] ** 2 - sizes[0] ** 2, sizes=1)


def along(direction):
    """The end of a bar of 30 mm in a direction."""
    start = [90.0, 0.0, 7.0] if len(direction) == 3 else [90.0, 7.0]
    return tuple((start + 30 * np.array(direction) / np.linalg.norm(direction)).tolist())


PLANE = {
    "half-plane": lambda a: HalfPlane(point=(90.0, 7.0), normal=a),
    "ellipse": lambda a: Ellipse(center=(90.0, 7.0), radii=(20.0, 10.0), axis=a),
    "capsule": lambda a: Capsule(start=(90.0, 7.0), end=along(a), radius=8.0),
}
SPACE = {
    "half-space": lambda a, b: spatial.HalfSpace(point=(90.0, 0.0, 7.0), normal=a),
    "box": lambda a, b: spatial.Box(center=(90.0, 0.0, 7.0), sizes=(30.0, 20.0, 10.0), axis=a, second=b),
    "cylinder": lambda a, b: spatial.Cylinder(start=(90.0, 0.0, 7.0), end=along(b), radius=8.0),
    "capsule": lambda a, b: spatial.Capsule(start=(90.0, 0.0, 7.0), end=along(b), radius=8.0),
}


def vectors(space, count):
    """Random vectors: of any length, of length one to roundoff, and for a second axis all but along the first."""
    generator = np.random.default_rng(space)
    for k in range(SAMPLES):
        several = generator.normal(size=(count, space)) * 10 ** generator.uniform(-3, 3, (count, 1))
        if k % 2:
            several /= np.linalg.norm(several, axis=1)[:, None]
        if k % 4 > 1 and count == 2:
            first, second = several / np.linalg.norm(several, axis=1)[:, None]
            several[1] = first + 10 ** generator.uniform(-5, 0) * second
        yield tuple(tuple(vector) for vector in several.tolist()), generator.normal(size=space)


def check_copies(obstacle, shift):
    moved = obstacle.shifted(shift)
    assert replace(obstacle) == obstacle
    assert replace(moved) == moved
    for part in (0.3, 1.0):
        between = obstacle.moved_towards(moved, part)
        assert between.check_motion(moved) <= (1 - part) * np.linalg.norm(shift) + 1e-12
    assert moved.shifted(-shift).check_motion(moved) == pytest.approx(np.linalg.norm(shift))


@pytest.mark.parametrize("name", PLANE)
def test_shapes_of_the_plane_shift_without_turning(name):
    for directions, shift in vectors(2, 1):
        check_copies(PLANE[name](*directions), shift)


@pytest.mark.parametrize("name", SPACE)
def test_shapes_of_space_shift_without_turning(name):
    for directions, shift in vectors(3, 2):
        check_copies(SPACE[name](*directions), shift)


def test_custom_shapes_shift_without_turning():
    for (axis,), shift in list(vectors(2, 1))[:40]:
        check_copies(Custom(family=ROUND, sizes=(9.0,), center=(90.0, 7.0), axis=axis, reach=20.0), shift)


def test_directions_are_unit_vectors_and_axes_perpendicular():
    for (first, second), _ in vectors(3, 2):
        axes = SPACE["box"](first, second).axes
        assert axes @ axes.T == pytest.approx(np.eye(3), abs=2e-15)
        assert axes[0] == pytest.approx(np.array(first) / np.linalg.norm(first), abs=1e-15)
        assert axes[1] @ np.array(second) > 0
