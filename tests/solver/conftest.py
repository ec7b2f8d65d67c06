"""Helpers of the solver's tests, as fixtures: test folders are not packages."""

from collections.abc import Callable, Iterable

import numpy as np
import pytest

from solver import Circle, Robot, Scene


def make_circles(*circles: tuple[float, float, float]) -> Scene:
    return Scene(Circle(center=(x, y), radius=r) for x, y, r in circles)


def cable_points(poses: np.ndarray, offset: float) -> np.ndarray:
    """(..., 3) → (..., 2) [mm]."""
    angle = poses[..., 2]
    return poses[..., :2] + offset * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def inside(points: np.ndarray, polygons: np.ndarray) -> np.ndarray:
    """Even-odd rule: points (m, 2), polygons (..., k, 2) → (..., m) bool."""
    start, end = polygons[..., None, :, :], np.roll(polygons, -1, axis=-2)[..., None, :, :]
    x, y = points[:, None, 0], points[:, None, 1]
    above, rise = start[..., 1] > y, end[..., 1] - start[..., 1]
    straddles = above != (end[..., 1] > y)
    crossing = start[..., 0] + (y - start[..., 1]) / np.where(straddles, rise, 1.0) * (end[..., 0] - start[..., 0])
    return np.sum(straddles & (x < crossing), axis=-1) % 2 == 1


def swept_centres(shapes: np.ndarray, robot: Robot, scene: Scene) -> np.ndarray:
    """Whether a circle's centre lies in what the backbone or the cable sweeps between consecutive shapes.

    Args:
        shapes: Node poses (k, n+1, 3).

    Returns:
        (k-1, m) bool.
    """
    centres = np.array([obstacle.center for obstacle in scene if isinstance(obstacle, Circle)])
    swept = np.zeros((len(shapes) - 1, len(centres)), dtype=bool)
    for line in (shapes[..., :2], cable_points(shapes, robot.offset_mm)):
        before, after = line[:-1], line[1:]
        quads = np.stack([before[:, :-1], before[:, 1:], after[:, 1:], after[:, :-1]], axis=2)
        swept |= inside(centres, quads).any(axis=1)
    return swept


def clearance(shapes: np.ndarray, robot: Robot, scene: Scene) -> np.ndarray:
    """Smallest gap of each shape to the circles of a scene, (k,) [mm]."""
    points = np.concatenate([shapes[..., :2], cable_points(shapes, robot.offset_mm)], axis=1)
    gaps = [
        (np.sum((points - obstacle.center) ** 2, axis=-1) - obstacle.radius**2) / (2 * obstacle.radius)
        for obstacle in scene
        if isinstance(obstacle, Circle)
    ]
    return np.min(gaps, axis=(0, 2))


def random_scene(generator: np.random.Generator) -> Scene:
    count = generator.integers(1, 4)
    low, high = (35, 75, 10), (75, 150, 16)
    return make_circles(*map(tuple, generator.uniform(low, high, (count, 3))))


@pytest.fixture(name="circles")
def circles_fixture() -> Callable[..., Scene]:
    return make_circles


@pytest.fixture(name="swept")
def swept_fixture() -> Callable[[np.ndarray, Robot, Scene], np.ndarray]:
    return swept_centres


@pytest.fixture(name="clearance")
def clearance_fixture() -> Callable[[np.ndarray, Robot, Scene], np.ndarray]:
    return clearance


@pytest.fixture(name="random_scene")
def random_scene_fixture() -> Callable[[np.random.Generator], Scene]:
    return random_scene


@pytest.fixture(name="pulls")
def pulls_fixture() -> Callable[[float, float], Iterable[float]]:
    """Cable displacements up to a target in equal steps, without accumulated rounding."""
    return lambda target, step: (round(step * k, 9) for k in range(1, round(target / step) + 1))
