"""Whether scenes leave a straight robot clear: told without its gaps where they are far enough beside it."""

import numpy as np
import pytest

from solver import Capsule, Circle, Ellipse, HalfPlane, Polygon, Robot, Scene
from solver.common.geometry import StraightRobot
from solver.spatial import Cylinder, SpatialRobot, Sphere

TRIANGLE = np.array([(-1.0, -0.6), (1.0, -0.6), (0.0, 1.2)])


def shapes_at(center, size):
    """Obstacles of some size around a point of the plane or of space, and a wall beside it."""
    along = np.eye(len(center))[0] * size
    ends = {"start": center - along, "end": center + along}
    if len(center) == 3:
        return [Sphere(center=center, radius=size), Cylinder(**ends, radius=0.4 * size, edge=0.1 * size)]
    return [
        Circle(center=center, radius=size),
        Ellipse(center=center, radii=(size, 0.5 * size), axis=(0.6, 0.8)),
        Capsule(**ends, radius=0.5 * size),
        Polygon(corners=tuple(map(tuple, center + size * TRIANGLE)), radius=0.2 * size),
        HalfPlane(point=center, normal=(-1.0, 0.0)),
    ]


@pytest.mark.parametrize("robot", [Robot.prototype(), SpatialRobot.prototype()], ids=["plane", "space"])
def test_scenes_that_leave_a_straight_robot_clear_are_those_without_negative_gaps(robot):
    space = 2 if isinstance(robot, Robot) else 3
    generator, found = np.random.default_rng(1), []
    points = generator.uniform(-8.0, 8.0, (2, 19, space))
    points[..., -1] = np.linspace(0.0, 180.0, 19)
    straight = StraightRobot.of(robot, points)
    for _ in range(400):
        center = np.append(generator.uniform(-60.0, 60.0, space - 1), generator.uniform(-60.0, 240.0))
        for shape in shapes_at(center, 10 ** generator.uniform(0.3, 1.9)):
            scene = Scene([shape])
            found.append(straight.is_clear_of(scene))
            assert found[-1] == (straight.gaps(scene).min() >= 0)
    assert 0.1 < np.mean(found) < 0.95


def test_nodes_that_a_robot_does_not_have_are_refused_far_from_it_too():
    straight = StraightRobot.of(Robot.prototype(), np.zeros((2, 19, 2)))
    with pytest.raises(ValueError, match="names node 40"):
        straight.is_clear_of(Scene([Circle(center=(90.0, 90.0), radius=9.0, nodes=(40,))]))
