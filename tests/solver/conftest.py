"""Helpers of the solver's tests, as fixtures, since test folders are not packages."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest

from solver import Capsule, Circle, Custom, Ellipse, Family, HalfPlane, Obstacle, Polygon, Robot, Scene
from solver.planar import free


def make_circles(*circles: tuple[float, float, float]) -> Scene:
    return Scene(Circle(center=(x, y), radius=r) for x, y, r in circles)


def cable_points(poses: np.ndarray, offset: float) -> np.ndarray:
    """Return the cable points of poses, (..., 3) → (..., 2) [mm]."""
    angle = poses[..., 2]
    return poses[..., :2] + offset * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def inside(points: np.ndarray, polygons: np.ndarray) -> np.ndarray:
    """Return which points lie inside polygons by the even-odd rule, (m, 2), (..., k, 2) → (..., m) bool."""
    start, end = polygons[..., None, :, :], np.roll(polygons, -1, axis=-2)[..., None, :, :]
    x, y = points[:, None, 0], points[:, None, 1]
    above, rise = start[..., 1] > y, end[..., 1] - start[..., 1]
    straddles = above != (end[..., 1] > y)
    crossing = start[..., 0] + (y - start[..., 1]) / np.where(straddles, rise, 1.0) * (end[..., 0] - start[..., 0])
    return np.sum(straddles & (x < crossing), axis=-1) % 2 == 1


def swept_centres(shapes: np.ndarray, robot: Robot, scene: Scene) -> np.ndarray:
    """Return whether backbone or cable swept over the centre of a fixed obstacle between consecutive shapes.

    Args:
        shapes: Node poses (k, n+1, 3).

    Returns:
        (k-1, m) bool.
    """
    centres = np.array([obstacle.extent.center for obstacle in scene if _still_disc(obstacle)])
    centres = centres.reshape(-1, 2)
    swept = np.zeros((len(shapes) - 1, len(centres)), dtype=bool)
    for line in (shapes[..., :2], cable_points(shapes, robot.offset_mm)):
        before, after = line[:-1], line[1:]
        quads = np.stack([before[:, :-1], before[:, 1:], after[:, 1:], after[:, :-1]], axis=2)
        swept |= inside(centres, quads).any(axis=1)
    return swept


def _still_disc(obstacle: Obstacle) -> bool:
    return bool(np.isfinite(obstacle.extent.radius)) and obstacle.spring is None


def clearance(shapes: np.ndarray, robot: Robot, scene: Scene) -> np.ndarray:
    """Return the smallest gap of each shape to the obstacles that every node can touch, (k,) [mm]."""
    points = np.concatenate([shapes[..., :2], cable_points(shapes, robot.offset_mm)], axis=1)
    return np.min([obstacle.gap(points) for obstacle in scene if obstacle.nodes is None], axis=(0, 2))


OVAL = Family.trace(lambda point, sizes: (point[0] / sizes[0]) ** 4 + (point[1] / sizes[1]) ** 2 - 1, sizes=2)


def random_spring(generator: np.random.Generator) -> float | None:
    """Return None for half of the obstacles, a stiffness from very soft to very stiff for the others [N/mm]."""
    return 10 ** generator.uniform(-2.5, 1.5) if generator.random() < 0.5 else None


def random_shape(generator: np.random.Generator) -> Obstacle:
    """Return an obstacle of any kind in front of the robot."""
    x, y = generator.uniform((40, 75), (75, 150))
    axis, across, along = generator.normal(size=2), generator.uniform(6, 12), generator.uniform(6, 20)
    axis /= np.linalg.norm(axis)
    match generator.integers(6):
        case 0:
            return Circle(center=(x, y), radius=across)
        case 1:
            return Ellipse(center=(x, y), radii=(across + 1, along), axis=tuple(axis))
        case 2:
            return Capsule(start=tuple((x, y) - along * axis), end=tuple((x, y) + along * axis), radius=across)
        case 3:
            count = generator.integers(4, 9)
            angles = 2 * np.pi / count * (np.arange(count) + generator.uniform(0, 0.4, count))
            ring = (x, y) + 12 * np.column_stack([np.cos(angles), np.sin(angles)])
            return Polygon(corners=tuple(map(tuple, ring)), radius=generator.uniform(1, 5))
        case 4:
            return Custom(
                family=OVAL, sizes=(across + 2, along), center=(x, y), axis=tuple(axis), reach=1.2 * (across + along)
            )
        case _:
            return HalfPlane(point=(x, y), normal=(-1, generator.uniform(-1, 1)))


def random_shapes(generator: np.random.Generator, robot: Robot) -> Scene:
    """Return one to four obstacles of any kind, fixed or on springs, with a core, clear of the straight robot."""
    while True:
        shapes = [random_shape(generator) for _ in range(generator.integers(1, 5))]
        scene = Scene(replace(shape, spring=random_spring(generator)) for shape in shapes)
        cored = all(2 * shape.extent.inradius > max(robot.edges_mm) for shape in shapes)
        if cored and free.clearance(robot, scene, 0.0) > 1:
            return scene


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


@pytest.fixture(name="random_shapes")
def random_shapes_fixture() -> Callable[[np.random.Generator, Robot], Scene]:
    return random_shapes


@pytest.fixture(name="pulls")
def pulls_fixture() -> Callable[[float, float], Iterable[float]]:
    """Cable displacements up to a target in equal steps, without accumulated rounding."""
    return lambda target, step: (round(step * k, 9) for k in range(1, round(target / step) + 1))
