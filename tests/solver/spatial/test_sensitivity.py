"""Sensitivities in space against central differences of the solver itself."""

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from solver import Cable, Load, Scene
from solver.spatial import (
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    SpatialRobot,
    SpatialSensitivity,
    SpatialSolver,
    Sphere,
    spatial_sensitivity,
)

ROBOT = SpatialRobot(model="paper", length_mm=180, segments=18, offset_mm=8, angle=1.8, max_tension=100, between=1)
SPRING = ((0.4, 0.1, 0.0), (0.1, 0.2, 0.05), (0.0, 0.05, 0.3))
PUSHED = [
    Sphere(center=(40, 18, 104), radius=15),
    Capsule(start=(38, 30, 100), end=(44, 0, 108), radius=12),
    Cylinder(start=(30, 35, 100), end=(48, -5, 108), radius=12, edge=3),
    Box(center=(40, 18, 104), sizes=(26, 30, 28), edge=6, axis=(1, 0.3, 0.2)),
    HalfSpace(point=(31, 12, 127), normal=(-1, -0.3, 0.2), nodes=(14,)),
]
SCENES = [*([o] for o in PUSHED), *([replace(o, spring=SPRING)] for o in PUSHED)]
COMMAND, STEP = np.array([7.0, 3.0]), 1e-4
THIRDS = tuple(2 * math.pi / 3 * k for k in range(3))
LOADED = replace(
    ROBOT,
    model="rod",
    cables=(*(Cable(angle=angle + 0.3) for angle in THIRDS), *(Cable(angle=angle, end=10) for angle in THIRDS)),
    torsion_ratio=0.7,
    segment_rigidity=(6000.0,) * 9 + (3000.0,) * 9,
    precurvature=(0.01, -0.005, 0.008),
    weight_per_length=(1e-4, 1e-4, -2e-4),
    loads=(Load(node=18, force=(0.02, -0.01, 0.03), at=(8.0, 1.0)), Load(node=7, force=(0.0, -0.02, 0.0))),
)
SEVERAL = np.array([8.0, 1.0, -12.0, 4.0, 1.5, -9.0])  # displacements of the cables of that robot; two are slack


def solve(obstacles, command=COMMAND, length=180.0, robot=ROBOT):
    solver = SpatialSolver(replace(robot, length_mm=length), Scene(obstacles))
    equilibrium = solver.rest()
    for part in np.linspace(0, 1, 31)[1:]:
        equilibrium = solver.step(equilibrium, (1 - part) * solver.rest().cables_mm + part * np.asarray(command))
    return equilibrium


def outputs(equilibrium):
    parts = (equilibrium.nodes, equilibrium.tensions, equilibrium.forces, equilibrium.displacements)
    return np.concatenate([*map(np.ravel, parts), 1e3 * equilibrium.multipliers.ravel()])


def predicted(slopes, row):
    parts = (slopes.nodes[row], slopes.tensions[row], slopes.forces[row], slopes.displacements[row])
    return np.concatenate([*map(np.ravel, parts), 1e3 * slopes.multipliers[row].ravel()])


def moved(obstacle, shift=(0, 0, 0), axis=0, turn=0.0, growth=0.0):
    """The obstacle shifted, turned about an axis through its centre, and grown."""
    cosine, sine = math.cos(turn), math.sin(turn)
    rotation = np.eye(3)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    rotation[[a, a, b, b], [a, b, a, b]] = cosine, -sine, sine, cosine
    centre = np.array(obstacle.extent.center)
    place = lambda point: centre + rotation @ (np.array(point) - centre) + shift  # noqa: E731
    places = {name: place(getattr(obstacle, name)) for name in obstacle.point_fields}
    match obstacle:
        case Sphere() | Capsule():
            return replace(obstacle, **places, radius=obstacle.radius + growth)
        case Cylinder():
            longer = growth * np.subtract(places["end"], places["start"]) / math.dist(places["end"], places["start"])
            ends = {"start": places["start"] - longer, "end": places["end"] + longer}
            return replace(obstacle, **ends, radius=obstacle.radius + growth, edge=obstacle.edge + growth)
        case Box():
            axes = {"axis": rotation @ obstacle.axis, "second": rotation @ obstacle.second}
            sizes = np.array(obstacle.sizes) + 2 * growth
            return replace(obstacle, **places, **axes, sizes=sizes, edge=obstacle.edge + growth)
        case HalfSpace():
            normal = rotation @ obstacle.normal
            return replace(obstacle, point=places["point"] + growth * normal, normal=normal)


def compare(slopes, row, ahead, behind):
    assert np.array_equal(ahead.contact, behind.contact)
    difference = (outputs(ahead) - outputs(behind)) / (2 * STEP)
    assert predicted(slopes, row) == pytest.approx(difference, rel=1e-5, abs=1e-8 + 1e-5 * np.abs(difference).max())
    turn = ahead.frames @ np.swapaxes(behind.frames, 1, 2)
    twisted = (turn - np.swapaxes(turn, 1, 2)) / (4 * STEP)
    turns = np.stack([twisted[:, 2, 1], twisted[:, 0, 2], twisted[:, 1, 0]], axis=1)
    assert slopes.turns[row] == pytest.approx(turns, rel=1e-5, abs=1e-8 + 1e-5 * np.abs(turns).max())


CASES = [(ROBOT, COMMAND, scene) for scene in SCENES] + [(LOADED, SEVERAL, SCENES[k]) for k in (0, 4, 6)]


EVERY_SECOND = (1, 3, 5, 7, 9)  # of the paper's robot, an obstacle fixed or on a spring, which are long


@pytest.mark.parametrize(
    ("robot", "command", "obstacles"),
    [
        pytest.param(
            *case,
            id=f"{case[0].model}-{case[2][0].kind}{'' if case[2][0].spring is None else ' on a spring'}",
            marks=pytest.mark.long if k in EVERY_SECOND else [],
        )
        for k, case in enumerate(CASES)
    ],
)
def test_everything(robot, command, obstacles):
    solved = partial(solve, robot=robot)
    equilibrium = solved(obstacles, command)
    assert equilibrium.contact.any()
    slopes, rows = spatial_sensitivity(equilibrium), SpatialSensitivity.rows(robot)
    for row, change in enumerate(STEP * np.eye(len(command))):
        compare(slopes, row, solved(obstacles, command + change), solved(obstacles, command - change))
    compare(slopes, rows.length, *(solved(obstacles, command, length=180 + change) for change in (STEP, -STEP)))
    motions = [
        *(lambda by, axis=axis: {"shift": by * axis} for axis in np.eye(3)),
        *(lambda by, axis=axis: {"axis": axis, "turn": by} for axis in range(3)),
        lambda by: {"growth": by},
    ]
    for row, motion in enumerate(motions):
        ahead, behind = (solved([moved(obstacles[0], **motion(change))], command) for change in (STEP, -STEP))
        compare(slopes, rows.obstacle(0).start + row, ahead, behind)


def test_a_rod_whose_cables_are_slack():
    """Loads alone press it to the sphere, which it follows; the cables have no slope."""
    robot = replace(LOADED, loads=(Load(node=18, force=(0.25, 0.1, 0.0)),))
    sphere, command = Sphere(center=(34, 12, 130), radius=15), np.full(6, -12.0)
    equilibrium = solve([sphere], command, robot=robot)
    assert equilibrium.contact.any()
    assert not equilibrium.tensions.any()
    slopes = spatial_sensitivity(equilibrium)
    assert not slopes.nodes[:6].any()
    ahead, behind = (solve([moved(sphere, shift=(by, 0, 0))], command, robot=robot) for by in (STEP, -STEP))
    compare(slopes, SpatialSensitivity.rows(robot).obstacle(0).start, ahead, behind)


def test_opposite_cables():
    sphere = Sphere(center=(-40, -18, 104), radius=15)
    equilibrium = solve([sphere], -COMMAND)
    assert equilibrium.contact.any()
    slopes = spatial_sensitivity(equilibrium)
    for row, change in enumerate(STEP * np.eye(2)):
        compare(slopes, row, solve([sphere], change - COMMAND), solve([sphere], -COMMAND - change))


def test_a_slack_robot_is_refused():
    solver = SpatialSolver(ROBOT, Scene(PUSHED[:1]))
    with pytest.raises(ValueError, match="one must be pulled"):
        spatial_sensitivity(solver.rest())
    with pytest.raises(ValueError, match="active has shape"):
        spatial_sensitivity(solver.step(solver.rest(), (1.0, 0.0)), np.ones((1, 2, 19), bool))
