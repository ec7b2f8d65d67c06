"""Sensitivities against central differences of the solver itself."""

import math
from dataclasses import replace

import numpy as np
import pytest

from solver import (
    Cable,
    Capsule,
    Circle,
    Custom,
    Ellipse,
    Family,
    HalfPlane,
    Load,
    Polygon,
    Robot,
    Scene,
    Sensitivity,
    Solver,
    sensitivity,
)
from solver.common.robot import MODELS
from solver.planar.forces import force_true
from solver.planar.robot import LINES

ROBOT = Robot(
    length_mm=180,
    segments=18,
    offset_mm=8,
    touch=LINES,
    between=1,
    max_tension=100,
    length_range_mm=(170, 190),
    model="paper",
)
LOADED = replace(
    ROBOT,
    model="rod",
    cables=(Cable(), Cable(angle=math.pi), Cable(end=11, offset_mm=6.0)),
    segment_rigidity=(6000.0,) * 9 + (3000.0,) * 9,
    precurvature=0.01,
    weight_per_length=(1e-4, -2e-4),
    loads=(Load(node=18, force=(0.02, 0.03), moment=1.5, at=(8.0, math.pi)), Load(node=7, force=(0.0, -0.02))),
)
ROBOTS = [*(replace(ROBOT, model=model) for model in MODELS), LOADED]
NAMES = [*MODELS, "loaded"]
EVERY_ROBOT = pytest.mark.parametrize("robot", ROBOTS, ids=NAMES)
OVAL = Family.trace(lambda point, sizes: (point[0] / sizes[0]) ** 4 + (point[1] / sizes[1]) ** 2 - 1, sizes=2)
PUSHED = [
    Circle(center=(44, 104), radius=15),
    Ellipse(center=(44, 104), radii=(15, 9), axis=(1, 2)),
    Capsule(start=(40, 100), end=(52, 112), radius=8),
    Polygon(corners=((36, 98), (52, 98), (52, 110), (40, 112)), radius=4),
    HalfPlane(point=(31, 127), normal=(-1, 0.2), nodes=(14,)),
    Custom(family=OVAL, sizes=(16, 11), center=(44, 104), axis=(1, 2), reach=20),
]
SCENES = [
    *([obstacle] for obstacle in PUSHED),
    [Circle(center=(33, 89), radius=12.5), Circle(center=(59, 140), radius=15)],
    *([replace(obstacle, spring=((0.4, 0.1), (0.1, 0.2)))] for obstacle in PUSHED),
    [Circle(center=(33, 89), radius=12.5, spring=1.0), Circle(center=(59, 140), radius=15)],
]
STEP = 1e-4
ONE, SEVERAL = np.array([9.0]), np.array([9.0, -12.0, 4.5])  # displacements of cables; of several, the second is slack


def solve(robot, obstacles, change=0.0, length=180.0, pulled=None):
    """The equilibrium of a freshly inserted and pulled robot, with a change of its displacements."""
    solver = Solver(robot, Scene(obstacles))
    end = (ONE if len(robot.cables) == 1 else SEVERAL) if pulled is None else pulled
    equilibrium = solver.step(solver.rest(), solver.rest().cables_mm, length)
    for part in np.linspace(0, 1, 31)[1:]:
        equilibrium = solver.step(equilibrium, solver.rest().cables_mm * (1 - part) + part * (end + change))
    return equilibrium


def outputs(equilibrium):
    parts = (
        equilibrium.nodes,
        1e3 * equilibrium.multipliers,
        equilibrium.tensions,
        force_true(equilibrium),
        equilibrium.displacements,
    )
    return np.concatenate([np.ravel(part) for part in parts])


def predicted(slopes, row):
    parts = (
        slopes.nodes[row],
        1e3 * slopes.multipliers[row],
        slopes.tensions[row],
        slopes.forces[row],
        slopes.displacements[row],
    )
    return np.concatenate([np.ravel(part) for part in parts])


def moved(obstacle, x=0.0, y=0.0, turn=0.0, growth=0.0):
    """The obstacle shifted, turned about its centre and grown."""
    centre, rotation = (
        np.array(obstacle.extent.center),
        np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]),
    )
    move = lambda point: tuple(centre + rotation @ (np.array(point) - centre) + (x, y))  # noqa: E731
    match obstacle:
        case Circle():
            return replace(obstacle, center=move(obstacle.center), radius=obstacle.radius + growth)
        case Ellipse():
            radii, axis = tuple(np.array(obstacle.radii) + growth), tuple(rotation @ obstacle.axis)
            return replace(obstacle, center=move(obstacle.center), radii=radii, axis=axis)
        case Capsule():
            ends = {"start": move(obstacle.start), "end": move(obstacle.end)}
            return replace(obstacle, **ends, radius=obstacle.radius + growth)
        case Polygon():
            return replace(obstacle, corners=tuple(map(move, obstacle.corners)), radius=obstacle.radius + growth)
        case Custom():
            assert growth == 0
            return replace(obstacle, center=move(obstacle.center), axis=tuple(rotation @ obstacle.axis))
        case HalfPlane():
            normal = rotation @ obstacle.normal
            return replace(obstacle, point=tuple(move(obstacle.point) + growth * normal), normal=tuple(normal))


def compare(slopes, row, ahead, behind):
    assert np.array_equal(ahead.contact, behind.contact)
    difference = (outputs(ahead) - outputs(behind)) / (2 * STEP)
    assert predicted(slopes, row) == pytest.approx(difference, rel=1e-5, abs=1e-9 + 1e-5 * np.abs(difference).max())


def label(obstacles):
    return "+".join(o.kind + ("" if o.spring is None else " on a spring") for o in obstacles)


def marks(name, obstacles):
    """Without --long the loaded rod is among all obstacles, one model among the fixed ones, the other among springs."""
    on_springs = any(obstacle.spring for obstacle in obstacles)
    return pytest.mark.long if name == ("paper" if on_springs else "rod") else []


@pytest.fixture(
    scope="module",
    params=[
        pytest.param((robot, obstacles), id=f"{label(obstacles)}-{name}", marks=marks(name, obstacles))
        for obstacles in SCENES
        for robot, name in zip(ROBOTS, NAMES, strict=True)
    ],
)
def case(request):
    """Robot, obstacles, and the sensitivities of their equilibrium: most of the time goes to stating the problem."""
    equilibrium = solve(*request.param)
    assert equilibrium.contact.any()
    return *request.param, sensitivity(equilibrium)


def test_cable_and_length(case):
    robot, obstacles, slopes = case
    for row, change in enumerate(STEP * np.eye(len(robot.cables))):
        compare(slopes, row, solve(robot, obstacles, change), solve(robot, obstacles, -change))
    ahead, behind = (solve(robot, obstacles, length=length) for length in (180 + STEP, 180 - STEP))
    compare(slopes, Sensitivity.rows(robot).length, ahead, behind)


def test_obstacles(case):
    robot, obstacles, slopes = case
    for j, obstacle in enumerate(obstacles):
        motions = np.eye(3 if isinstance(obstacle, Custom) else 4)  # a family need not hold the grown shape
        for motion, one in enumerate(motions):
            scenes = ([moved(o, *by * one) if k == j else o for k, o in enumerate(obstacles)] for by in (STEP, -STEP))
            both = [solve(robot, scene) for scene in scenes]
            compare(slopes, Sensitivity.rows(robot).obstacle(j).start + motion, *both)


@EVERY_ROBOT
def test_free_robot(robot):
    pulled, first = np.array([5.0, -7.0, 1.0])[: len(robot.cables)], np.eye(len(robot.cables))[0]
    ahead, here, behind = (solve(robot, [], change * first, pulled=pulled) for change in (STEP, 0.0, -STEP))
    compare(sensitivity(here), 0, ahead, behind)
    assert sensitivity(here).tension[0] == sensitivity(here).tensions[0, 0]


def test_cables_that_pull_against_each_other():
    """One bends the robot, the other holds its lower half straight."""
    robot = replace(ROBOT, model="rod", cables=(Cable(), Cable(angle=math.pi, end=9)))
    pulled, obstacles = np.array([9.0, -0.5]), [Circle(center=(42, 140), radius=15)]
    equilibrium = solve(robot, obstacles, pulled=pulled)
    assert (equilibrium.tensions > 0.5).all()
    assert equilibrium.contact.any()
    slopes = sensitivity(equilibrium)
    for row, change in enumerate(STEP * np.eye(2)):
        compare(slopes, row, *(solve(robot, obstacles, by, pulled=pulled) for by in (change, -change)))


def test_contact_about_to_open_is_taken_from_either_side():
    """At the onset of contact the force grows on the pressed side only."""
    solver = Solver(ROBOT, Scene([Circle(center=(44, 104), radius=15)]))
    equilibrium = solver.step(solver.rest(), 3.0)
    nearest = np.unravel_index(equilibrium.gaps.argmin(), equilibrium.gaps.shape)
    pressed = np.zeros_like(equilibrium.contact)
    pressed[nearest] = True
    assert not sensitivity(equilibrium).forces[0].any()
    assert sensitivity(equilibrium, pressed).multipliers[0][nearest] > 0


def test_slack_cable_and_foreign_contacts_are_refused():
    solver = Solver(ROBOT, Scene(PUSHED[:1]))
    with pytest.raises(ValueError, match=r"cable_mm is 0.0; it must be positive"):
        sensitivity(solver.rest())
    with pytest.raises(ValueError, match="active has shape"):
        sensitivity(solver.step(solver.rest(), 1.0), np.ones((1, 2, 19), bool))
