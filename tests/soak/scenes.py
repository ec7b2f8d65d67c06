"""Sampled settings of episodes: robots of many kinds in scenes that are ordinary, or made to break the solver.

Everything is sampled around the paper's prototype and then scaled.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from soak.cores import line_points
from soak.robots import ROBOTS
from soak.scale import scale_robot, scale_scene
from soak.shapes import distance
from solver import Capsule, Circle, Custom, Ellipse, Family, HalfPlane, Polygon, Robot, Scene, Solver, spatial
from solver.spatial import SpatialSolver

MODELS = tuple(ROBOTS)
SPATIAL = ("space", "space rod")
SCALES = (0.1, 1.0, 1.0, 1.0, 10.0)
TRIES = 200
OVAL = Family.trace(lambda point, sizes: (point[0] / sizes[0]) ** 4 + (point[1] / sizes[1]) ** 2 - 1, sizes=2)


class Setting(NamedTuple):
    """Robot and scene of an episode.

    Attributes:
        kind: Name of the sampler of the scene.
        scale: Size of the robot, over that of the prototype.
        solver: Solver of robot and scene.
        refused: Number of scenes that the solver refused before this one.
    """

    kind: str
    scale: float
    solver: Solver | SpatialSolver
    refused: int


def sample_setting(generator, model, kinds=None, scales=SCALES):
    """Return a robot in a scene that is clear of it at rest, and whose obstacles all have a core."""
    samplers = SPATIAL_KINDS if model in SPATIAL else PLANAR_KINDS
    for refused in range(TRIES):
        kind = str(generator.choice(kinds or list(samplers)))
        robot = ROBOTS[model](generator)
        scene = Scene(samplers[kind](generator, robot))
        scale = float(generator.choice(scales))
        try:
            return Setting(kind, scale, make_solver(scale_robot(robot, scale), scale_scene(scene, scale)), refused)
        except ValueError:
            continue
    raise RuntimeError(f"{TRIES} sampled scenes in a row were refused")


def make_solver(robot, scene):
    """Return the solver of a robot in the plane or in space."""
    return (Solver if isinstance(robot, Robot) else SpatialSolver)(robot, scene)


def _clear(generator, robot, sample, count, margin=None):
    """Return ``count`` sampled obstacles that are clear of the straight robot, or fewer where there is no room."""
    margin = generator.choice([0.02, 1.0]) if margin is None else margin
    rest, kept = rest_points(robot), []
    for _ in range(8 * count):
        obstacle = sample()
        if distance(obstacle, rest).min() > margin:
            kept.append(obstacle)
        if len(kept) == count:
            break
    return kept


def rest_points(robot):
    """Return the points of the robot without loads, ``(p * positions, d)``."""
    if np.any(robot.precurvature):
        unloaded = replace(robot, loads=(), weight_per_length=len(robot.weight_per_length) * (0.0,))
        points = make_solver(unloaded, Scene()).rest().points
        return points.reshape(-1, points.shape[-1])
    along = np.linspace(0, robot.length_mm, robot.segments + 1)
    nodes, frames = np.zeros((1, len(along), 3)), np.broadcast_to(np.eye(3), (1, len(along), 3, 3))
    nodes[0, :, 1 if isinstance(robot, Robot) else 2] = along
    points = line_points(robot, nodes, frames)
    return points.reshape(-1, points.shape[-1])


def _spring(generator, chance=0.5, powers=(-4, 3)):
    return float(10 ** generator.uniform(*powers)) if generator.random() < chance else None


def _unit(generator, size):
    vector = generator.normal(size=size)
    return vector / np.linalg.norm(vector)


def _ahead(generator, low=20.0, high=80.0):
    """Return a point that the pulled robot comes to, or sometimes one behind it."""
    side = -0.3 if generator.random() < 0.1 else 1
    return np.array([side * generator.uniform(low, high), generator.uniform(45, 185)])


def _width(robot):
    """Return an inner radius that is large enough for a core."""
    return 0.66 * max(robot.edges_mm)


# The plane.


def _planar_shape(generator, thinnest, spring):
    center, axis = _ahead(generator), _unit(generator, 2)
    across, along = thinnest + generator.exponential(3, 2)
    common = {"center": tuple(center), "spring": spring}
    match generator.integers(6):
        case 0:
            return Circle(radius=across, **common)
        case 1:
            return Ellipse(radii=(across, along), axis=tuple(axis), **common)
        case 2:
            ends = {"start": tuple(center - along * axis), "end": tuple(center + along * axis)}
            return Capsule(radius=across, spring=spring, **ends)
        case 3:
            return _polygon(generator, center, along + 2, across / 2, spring)
        case 4:
            return Custom(
                family=OVAL, sizes=(across + 1, along + 1), axis=tuple(axis), reach=2.5 * (across + along), **common
            )
        case _:
            return HalfPlane(point=tuple(center), normal=(-1, generator.uniform(-1, 1)), spring=spring)


def _polygon(generator, center, size, radius, spring=None):
    count = int(generator.integers(3, 9))
    angles = 2 * np.pi / count * (np.arange(count) + generator.uniform(0, 0.4, count)) + generator.uniform(0, 6)
    ring = center + size * np.column_stack([np.cos(angles), np.sin(angles)])
    return Polygon(corners=tuple(map(tuple, ring)), radius=radius, spring=spring)


def circles(generator, robot):
    """Return one to three large circles."""
    low, high = (35, 75, 10), (75, 150, 16)

    def sample():
        x, y, radius = generator.uniform(low, high)
        return Circle(center=(x, y), radius=radius)

    return _clear(generator, robot, sample, int(generator.integers(1, 4)), margin=1.0)


def shapes(generator, robot):
    """Return one to five obstacles of any kind, half of them on springs."""
    return _planar_shapes(generator, robot, lambda: _spring(generator), int(generator.integers(1, 6)))


def crowd(generator, robot):
    """Return six to thirty-two small circles everywhere."""

    def sample():
        return Circle(center=tuple(_ahead(generator, 9, 110)), radius=_width(robot) * generator.uniform(1, 1.6))

    return _clear(generator, robot, sample, int(generator.integers(6, 33)))


def narrow(generator, robot):
    """Return circles and capsules barely wider than the distance between points, close to the robot."""

    def sample():
        radius = max(robot.edges_mm) * generator.uniform(0.5, 0.65)
        if generator.random() < 0.8:
            return Circle(center=tuple(_ahead(generator, 14, 50)), radius=radius)
        start, way = _ahead(generator, 14, 50), generator.uniform(1, 20) * _unit(generator, 2)
        return Capsule(start=tuple(start), end=tuple(start + way), radius=radius)

    return _clear(generator, robot, sample, int(generator.integers(1, 7)))


def channel(generator, robot):
    """Return two walls, or two rows of circles, with little room between them, sometimes with more obstacles ahead."""
    room = generator.uniform(0.05, 6, 2)
    low, high = min(robot.lines_mm) - room[0], max(robot.lines_mm) + room[1]
    ahead = [Circle(center=tuple(_ahead(generator, 30, 60)), radius=_width(robot) + generator.uniform(0, 6))]
    if generator.random() < 0.4:
        walls = [HalfPlane(point=(low, 0), normal=(1, 0)), HalfPlane(point=(high, 0), normal=(-1, 0))]
        return walls[generator.integers(2) :] if generator.random() < 0.5 else walls
    radius = _width(robot) * generator.uniform(1, 2)
    heights = np.arange(generator.uniform(20, 90), robot.length_mm + 10, radius * generator.uniform(1.6, 4))
    rows = [Circle(center=(low - radius, y), radius=radius) for y in heights]
    rows += [Circle(center=(high + radius, y + radius), radius=radius) for y in heights]
    return rows[:31] + [circle for circle in ahead if distance(circle, rest_points(robot)).min() > 0.1]


def sharp(generator, robot):
    """Return polygons with corners, and ellipses with ends, down to a millionth of the robot's length."""

    def sample():
        radius, size = robot.length_mm * 10 ** generator.uniform(-6, -1.3), generator.uniform(9, 20)
        if generator.random() < 0.8:
            return _polygon(generator, _ahead(generator), size, radius, _spring(generator, 0.2))
        return Ellipse(
            center=tuple(_ahead(generator)),
            radii=(_width(robot), max(size, _width(robot) ** 2 / max(radius, 0.5))),
            axis=tuple(_unit(generator, 2)),
        )

    return _clear(generator, robot, sample, int(generator.integers(1, 4)))


def springs(generator, robot):
    """Return one to four obstacles of any kind, all on springs, from very soft to very stiff."""
    return _planar_shapes(generator, robot, lambda: _spring(generator, 1.0), int(generator.integers(1, 5)))


def _planar_shapes(generator, robot, spring, count):
    return _clear(generator, robot, lambda: _planar_shape(generator, _width(robot), spring()), count)


PLANAR_KINDS = {sampler.__name__: sampler for sampler in (circles, shapes, crowd, narrow, channel, sharp, springs)}


# Space.


def _around(generator, low=20.0, high=80.0):
    """Return a point around the robot."""
    azimuth, radius = generator.uniform(0, 2 * math.pi), generator.uniform(low, high)
    return np.array([radius * math.cos(azimuth), radius * math.sin(azimuth), generator.uniform(45, 185)])


def _spatial_shape(generator, robot, thinnest, spring, edge=None, low=20.0):
    center, axis, second = _around(generator, low), _unit(generator, 3), _unit(generator, 3)
    across, along = thinnest + generator.exponential(4, 2)
    edge = generator.uniform(0.2, 1) * thinnest if edge is None else edge
    ends = {"start": tuple(center - along * axis), "end": tuple(center + along * axis), "spring": spring}
    match generator.integers(5):
        case 0:
            return spatial.Sphere(center=tuple(center), radius=across, spring=spring)
        case 1:
            return spatial.Capsule(radius=across, **ends)
        case 2:
            return spatial.Cylinder(radius=across, edge=min(edge, across, along), **ends)
        case 3:
            sizes = 2 * thinnest + generator.exponential(8, 3)
            box = {"axis": tuple(axis), "second": tuple(second), "edge": min(edge, sizes.min() / 2)}
            return spatial.Box(center=tuple(center), sizes=tuple(sizes), spring=spring, **box)
        case _:
            inward = np.array([-center[0], -center[1], 0]) / math.hypot(*center[:2])
            return spatial.HalfSpace(point=tuple(center), normal=tuple(inward + 0.3 * axis), spring=spring)


def spheres(generator, robot):
    """Return one to three large balls."""

    def sample():
        return spatial.Sphere(center=tuple(_around(generator, 35, 75)), radius=generator.uniform(10, 16))

    return _clear(generator, robot, sample, int(generator.integers(1, 4)), margin=1.0)


def spatial_shapes(generator, robot):
    """Return one to five obstacles of any kind, half of them on springs."""
    return _spatial_shapes(generator, robot, lambda: _spring(generator), int(generator.integers(1, 6)))


def spatial_springs(generator, robot):
    """Return one to four obstacles of any kind, all on springs, from very soft to very stiff."""
    return _spatial_shapes(generator, robot, lambda: _spring(generator, 1.0), int(generator.integers(1, 5)))


def _spatial_shapes(generator, robot, spring, count):
    return _clear(generator, robot, lambda: _spatial_shape(generator, robot, _width(robot), spring()), count)


def spatial_crowd(generator, robot):
    """Return six to thirty-two small balls all around."""

    def sample():
        return spatial.Sphere(
            center=tuple(_around(generator, 12, 90)), radius=_width(robot) * generator.uniform(1, 1.8)
        )

    return _clear(generator, robot, sample, int(generator.integers(6, 33)))


def spatial_narrow(generator, robot):
    """Return balls barely wider than the distance between points, close to the robot."""

    def sample():
        radius = max(robot.edges_mm) * generator.uniform(0.5, 0.65)
        return spatial.Sphere(center=tuple(_around(generator, 16, 45)), radius=radius)

    return _clear(generator, robot, sample, int(generator.integers(1, 7)))


def spatial_channel(generator, robot):
    """Return walls on up to four sides, or rings of balls, with little room for the robot between them."""
    room = generator.uniform(0.05, 5, 4)
    sides = [np.array(side, float) for side in ((1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0))]
    if generator.random() < 0.4:
        walls = [
            spatial.HalfSpace(point=tuple((8 + gap) * side), normal=tuple(-side))
            for gap, side in zip(room, sides, strict=True)
        ]
        return walls[: int(generator.integers(1, 5))]
    radius = _width(robot) * generator.uniform(1, 2)
    heights = np.arange(generator.uniform(30, 100), robot.length_mm + 10, radius * generator.uniform(1.6, 4))
    rings = [(8 + gap + radius) * side + [0, 0, z] for z in heights for gap, side in zip(room, sides, strict=True)]
    return [spatial.Sphere(center=tuple(center), radius=radius) for center in rings[:32]]


def spatial_sharp(generator, robot):
    """Return boxes and cylinders with edges down to a millionth of the robot's length."""

    def sample():
        edge = robot.length_mm * 10 ** generator.uniform(-6, -1.5)
        return _spatial_shape(generator, robot, _width(robot), _spring(generator, 0.2), edge)

    return _clear(generator, robot, sample, int(generator.integers(1, 4)))


SPATIAL_KINDS = {
    "spheres": spheres,
    "shapes": spatial_shapes,
    "crowd": spatial_crowd,
    "narrow": spatial_narrow,
    "channel": spatial_channel,
    "sharp": spatial_sharp,
    "springs": spatial_springs,
}
