"""Sampled robots of all families: the paper's models, and rods with cables, sections and loads of many kinds.

Everything is sampled around the paper's prototype.
"""

import math
from dataclasses import replace

import numpy as np

from solver import Cable, Load, Robot
from solver.planar.robot import LINES
from solver.spatial import SpatialRobot

SHORT = (1.0, 200.0)  # range of insertion from near zero [mm]
BENDING, WEIGHT = 5000 / 180**2, 5000 / 180**3  # EI/L² [N], EI/L³ [N/mm]


def planar_robot(generator, model):
    """Return the prototype, or a robot with other segments, lines and points, and a base that inserts it."""
    robot = replace(Robot.prototype(segments=int(generator.choice([9, 18, 18, 18, 30]))), model=model)
    if generator.random() < 0.5:
        robot = replace(robot, between=int(generator.integers(4)))
    if generator.random() < 0.3:
        robot = replace(robot, touch=LINES)
    if generator.random() < 0.3:
        robot = replace(robot, length_range_mm=(100.0, 180.0), length_mm=float(generator.uniform(100, 180)))
    return robot


def spatial_robot(generator, model="paper"):
    """Return the prototype, or a robot with fewer segments, other lines, points and angles."""
    robot = SpatialRobot.prototype(
        model=model,
        segments=int(generator.choice([9, 18, 18, 18])),
        angle=float(generator.choice([math.pi / 2, 2 * math.pi / 3])),
    )
    if generator.random() < 0.3:
        robot = replace(robot, between=1)
    if generator.random() < 0.2:
        robot = replace(robot, touch=("backbone", "rim"), rim_points=8)
    return robot


def pair_robot(generator):
    """Return a planar rod with two opposing cables, one in ten inserted from near zero."""
    robot = planar_robot(generator, "rod")
    if generator.random() < 0.1:
        robot = replace(robot, length_range_mm=SHORT, length_mm=float(10 ** generator.uniform(0, 2)))
    return replace(robot, cables=_opposing(generator), max_tension=_limit(generator))


def sections_robot(generator):
    """Return a planar rod of two sections, each with a pair of opposing cables or with one."""
    robot = planar_robot(generator, "rod")
    middle = int(generator.integers(2, robot.segments - 1))
    first, second = _opposing(generator, middle), _opposing(generator)
    match generator.integers(3):
        case 0:
            cables = first + second
        case 1:
            cables = first[:1] + second[:1]
        case _:
            cables = first[:1] + second[1:]
    return replace(robot, cables=cables, max_tension=_limit(generator))


def gravity_robot(generator):
    """Return a planar rod with one or two cables that bears its weight and dead loads."""
    robot = planar_robot(generator, "rod")
    cables = _opposing(generator) if generator.random() < 0.5 else (Cable(),)
    return replace(_loaded(generator, _unlike(generator, robot), 2), cables=cables)


def spatial_rod(generator):
    """Return a rod in space with one to six cables, sometimes of two sections, loaded or precurved."""
    robot = _unlike(generator, replace(spatial_robot(generator, "rod"), cables=_around(generator)))
    robot = replace(robot, torsion_ratio=float(generator.uniform(0.5, 2)), max_tension=_limit(generator))
    if generator.random() < 0.25:
        middle = int(generator.integers(2, robot.segments - 1))
        ends = [None if k % 2 else middle for k in range(len(robot.cables))]
        robot = replace(robot, cables=tuple(map(_ending, robot.cables, ends)))
    return _loaded(generator, robot, 3) if generator.random() < 0.25 else robot


def _ending(cable, end):
    return replace(cable, end=end)


def _opposing(generator, end=None):
    """Return two cables on opposite sides, half of them at the same distance from the backbone."""
    offsets = (None, None) if generator.random() < 0.5 else generator.uniform(2, 8, 2).tolist()
    return tuple(
        Cable(angle=angle, offset_mm=offset, end=end) for angle, offset in zip((0, math.pi), offsets, strict=True)
    )


def _around(generator):
    """Return one to six cables in space: at multiples of 90° or 120°, or anywhere."""
    count = int(generator.integers(1, 7))
    match generator.integers(3):
        case 0:
            angles = math.pi / 2 * np.arange(count)
        case 1:
            angles = 2 * math.pi / 3 * np.arange(count)
        case _:
            angles = generator.uniform(0, 2 * math.pi, count)
    offsets = count * [None] if generator.random() < 0.6 else generator.uniform(2, 8, count).tolist()
    return tuple(Cable(angle=angle, offset_mm=offset) for angle, offset in zip(angles.tolist(), offsets, strict=True))


def _limit(generator):
    """Return a tension limit: mostly that of the prototype, sometimes a high one or none [N]."""
    return float(generator.choice([15.0, 100.0, math.inf], p=[0.88, 0.1, 0.02]))


def _unlike(generator, robot):
    """Return the rod, or one whose segments differ in rigidity, or which is precurved."""
    if generator.random() < 0.2:
        robot = replace(robot, segment_rigidity=tuple(5000 * 10 ** generator.uniform(-0.5, 0.5, robot.segments)))
    if generator.random() < 0.2:
        turn = 3 / robot.segments * generator.uniform(-1, 1, 3)
        robot = replace(robot, precurvature=tuple(turn) if isinstance(robot, SpatialRobot) else float(turn[0]))
    return robot


def _loaded(generator, robot, space):
    """Return the rod with weight in any direction, up to one that bends it far, and up to two dead loads."""
    if generator.random() < 0.8:
        weight = WEIGHT * 10 ** generator.uniform(-1, 1.3) * _unit(generator, space)
        robot = replace(robot, weight_per_length=tuple(weight))
    loads = []
    for _ in range(generator.integers(3)):
        force = BENDING * 10 ** generator.uniform(-1, 0.7) * _unit(generator, space)
        moment = float(180 * BENDING * generator.normal()) if space == 2 and generator.random() < 0.3 else 0.0
        at = (8.0, float(generator.choice([0.0, math.pi])))
        loads.append(
            Load(node=int(generator.integers(1, robot.segments + 1)), force=tuple(force), moment=moment, at=at)
        )
    return replace(robot, loads=tuple(loads))


def _unit(generator, size):
    vector = generator.normal(size=size)
    return vector / np.linalg.norm(vector)


ROBOTS = {
    "paper": lambda generator: planar_robot(generator, "paper"),
    "rod": lambda generator: planar_robot(generator, "rod"),
    "space": spatial_robot,
    "pair": pair_robot,
    "sections": sections_robot,
    "gravity": gravity_robot,
    "space rod": spatial_rod,
}
