"""Every preset builds, rests, bends within its tension limit, touches an obstacle and scales, in plane and in space."""

import math
from pathlib import Path

import numpy as np
import pytest

from solver import PRESETS, Circle, Robot, Scene, Solver, Status, spatial

KINDS = {"plane": (Robot, Solver), "space": (spatial.SpatialRobot, spatial.SpatialSolver)}
EVERY = pytest.mark.parametrize("name", PRESETS)
EVERY_KIND = pytest.mark.parametrize("kind", KINDS)
SIDES = [(name, side) for name, row in PRESETS.items() for side in ((0.0, math.pi) if row.cables else (0.0,))]
TURN = math.pi / 3  # of a section
STEPS = 30


def reaches(robot, direction=0.0):
    """How far the cables lie from the backbone in a direction [mm]."""
    cables = [(cable.offset_mm or robot.offset_mm, cable.angle) for cable in robot.cables]
    return np.array([offset * math.cos(angle - direction) for offset, angle in cables])


def pulls(robot, turn, direction=0.0, end=None):
    """Pulls that turn the free robot up to an end in a direction by the cables that end there, others paid out [mm]."""
    wanted = reaches(robot, direction) * turn
    works = np.array([cable.end == end for cable in robot.cables]) & (wanted > 1e-9)
    return np.where(works, wanted, np.maximum(-1.1 * robot.offset_mm * turn, robot.least_cable_mm))


def pulled(solver, commands, steps=STEPS):
    """The equilibria of a straight pull from rest."""
    states = [solver.rest()]
    for k in range(1, steps + 1):
        states.append(solver.step(states[-1], tuple(commands * k / steps)))
    return states


def turned(state):
    """How far the tip has turned towards +x [rad]."""
    if isinstance(state.robot, Robot):
        return -state.nodes[-1, 2]
    return math.atan2(state.frames[-1, 0, 2], state.frames[-1, 2, 2])


def obstacle(robot, kind):
    """A circle or sphere of a tenth of the length, which the robot bends into."""
    length = robot.length_mm
    radius, x, along = 0.1 * length, 0.22 * length, 0.65 * length
    return Circle(center=(x, along), radius=radius) if kind == "plane" else _sphere(x, 0.01 * length, along, radius)


def _sphere(x, y, z, radius):
    return spatial.Sphere(center=(x, y, z), radius=radius)


@EVERY
@EVERY_KIND
def test_rests_straight(name, kind):
    robot_class, solver_class = KINDS[kind]
    state = solver_class(robot_class.preset(name, model="rod"), Scene()).rest()
    assert state.robot.model == "rod"
    assert state.energy == 0
    assert state.nodes[-1, 2 if kind == "space" else 1] == state.robot.length_mm
    assert not state.tensions.any()


@pytest.mark.parametrize(("name", "direction"), SIDES)
@EVERY_KIND
def test_sections_bend_by_60_degrees_within_the_tension_limit(name, kind, direction):
    robot_class, solver_class = KINDS[kind]
    robot = robot_class.preset(name, model="rod")
    turn = PRESETS[name].sections * TURN
    *_, state = pulled(solver_class(robot, Scene()), pulls(robot, turn, direction))
    assert state.status is Status.CONVERGED
    assert turned(state) == pytest.approx(math.cos(direction) * turn, rel=0.03)
    # An even curvature κ takes the moment EI·κ; a straight cable between holes lies κ·l0²/12 nearer to the inside.
    curvature = turned(state) / robot.length_mm
    arms = reaches(robot) + curvature * robot.segment_mm**2 / 12
    assert state.tensions @ arms == pytest.approx(robot.rigidity * curvature, rel=2e-3)
    assert state.tensions.max() < 0.9 * robot.max_tension


@pytest.mark.parametrize("name", [name for name, row in PRESETS.items() if row.sections == 2])
@EVERY_KIND
def test_sections_bend_against_each_other(name, kind):
    robot_class, solver_class = KINDS[kind]
    robot = robot_class.preset(name, model="rod")
    middle = robot.segments // 2
    first, back = pulls(robot, TURN, end=middle), reaches(robot) < -1e-9
    # The section at the base turns by 60°, the other one back until the tip points along the base.
    last = np.where(back, 0.0, -0.1 * robot.offset_mm)
    commands = np.where([cable.end == middle for cable in robot.cables], first, last)
    *_, state = pulled(solver_class(robot, Scene()), commands)
    angle = -state.nodes[middle, 2] if kind == "plane" else math.atan2(*state.frames[middle, [0, 2], 2])
    assert angle == pytest.approx(TURN, rel=0.03)
    assert abs(turned(state)) < 0.06


@EVERY
@EVERY_KIND
def test_touches_an_obstacle_of_a_tenth_of_its_length(name, kind):
    robot_class, solver_class = KINDS[kind]
    robot = robot_class.preset(name, model="rod")
    solver = solver_class(robot, Scene([obstacle(robot, kind)]))
    states = pulled(solver, pulls(robot, PRESETS[name].sections * TURN))
    unit = robot.rigidity / robot.length_mm**2
    assert any(state.contact.any() for state in states)
    for state in states:
        assert state.status in (Status.CONVERGED, Status.SNAPPED, Status.STALLED)
        assert state.gaps.min() > -1e-8 * robot.length_mm
        assert max(solver.optimality(state)) < 1e-7
    touching = next(state for state in states if state.contact.any())
    assert touching.forces[0, 0] < 0  # pushes the robot back
    assert np.linalg.norm(touching.forces) < 100 * unit


@EVERY
@EVERY_KIND
def test_scales(name, kind):
    robot_class, solver_class = KINDS[kind]
    row, s = PRESETS[name], 0.5
    robot = robot_class.preset(name, model="rod")
    lengths = {"length_mm": s * row.length_mm, "offset_mm": s * row.offset_mm, "rigidity": s * s * row.rigidity}
    small = robot_class.preset(name, model="rod", **lengths)
    commands = pulls(robot, row.sections * TURN)
    large = pulled(solver_class(robot, Scene([obstacle(robot, kind)])), commands)[-1]
    scaled = pulled(solver_class(small, Scene([obstacle(small, kind)])), s * commands)[-1]
    assert scaled.status is large.status
    np.testing.assert_array_equal(scaled.forces, large.forces)
    np.testing.assert_array_equal(scaled.tensions, large.tensions)
    np.testing.assert_array_equal(scaled.points, s * large.points)


@EVERY_KIND
def test_prototype_is_the_prototype(kind):
    robot_class, _ = KINDS[kind]
    for model in ("rod", "paper"):
        assert robot_class.preset("prototype", model=model) == robot_class.prototype(model=model)


@EVERY_KIND
def test_cables_follow_changed_segments_and_offset(kind):
    robot_class, _ = KINDS[kind]
    robot = robot_class.preset("rao_2021", model="rod", segments=40, offset_mm=6.0)
    assert {cable.end for cable in robot.cables} == {20, None}
    assert {cable.offset_mm for cable in robot.cables} == ({None, 3.0} if kind == "plane" else {None})


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("snake", {}, "name of a preset is 'snake'; it must be one of prototype, .*snake_arm"),
        (["guidewire"], {}, r"name of a preset is \['guidewire'\]; it must be one of"),
        ("rao_2021", {"segments": 21}, "segments is 21; it must be a multiple of 2"),
        ("guidewire", {"segments": 1.5}, "segments is 1.5; it must be a whole number"),
        ("guidewire", {"offset_mm": -1}, "offset_mm is -1; it must be positive"),
        ("guidewire", {"model": "paper"}, "cables is given; the paper's model has no choice of it"),
    ],
)
@EVERY_KIND
def test_refusals(kind, name, changes, message):
    with pytest.raises(ValueError, match=message):
        KINDS[kind][0].preset(name, **changes)


@EVERY_KIND
def test_unknown_fields_are_refused(kind):
    with pytest.raises(TypeError, match="stiffness"):
        KINDS[kind][0].preset("guidewire", stiffness=3)


def test_table_of_the_docs_is_this_table():
    page = (Path(__file__).parents[3] / "docs" / "model.md").read_text()
    for name in PRESETS:
        assert table_row(name) in page


def table_row(name):
    """The row of a preset in docs/model.md: what it is, and what was measured of it in the plane."""
    row = PRESETS[name]
    layout = {0: "1 (in space 2 at 90°)", 3: "3 at 120°", 4: "4 at 90°"}[row.cables]
    planar = {0: "one at 0", 3: "a at 0, a/2 at π", 4: "a at 0 and π"}[row.cables]
    bends = [largest_bend(name, side) for other, side in SIDES if other == name]
    needed = " / ".join(f"{tension_at_60_degrees(name, side):.3g}" for other, side in SIDES if other == name)
    reach = " / ".join(f"{turn:+.0f}° ({limit})".replace("-", "−") for turn, limit in bends)
    sections = f"{row.sections} × " if row.sections > 1 else ""
    cells = [
        f"`{name}`",
        f"{row.length_mm:g}",
        f"{row.offset_mm:g}",
        row.segments,
        f"{row.rigidity:.{0 if row.rigidity > 100 else 1}f}",
        row.torsion_ratio,
        sections + layout,
        planar,
        f"{row.max_tension:g}",
        needed,
        reach,
        row.source,
    ]
    return "| " + " | ".join(map(str, cells)) + " |"


def tension_at_60_degrees(name, side):
    """The largest tension where the planar robot's sections are bent by 60° each [N]."""
    robot = Robot.preset(name, model="rod")
    return pulled(Solver(robot, Scene()), pulls(robot, PRESETS[name].sections * TURN, side))[-1].tensions.max()


def largest_bend(name, side):
    """How far the tip of the planar robot turns by a pull of the last section's cable [°], and what stops it."""
    robot = Robot.preset(name, model="rod")
    limit, solver = robot.cable_limit_mm, Solver(robot, Scene())
    works = pulls(robot, 1.0, side) > 0
    state = solver.step(solver.rest(), tuple(np.where(works, 0.0, robot.least_cable_mm)))
    for k in range(1, 201):
        pull = limit * k / 200
        state = solver.step(state, tuple(np.where(works, pull, robot.least_cable_mm)))
        if state.status is Status.STALLED:
            return math.degrees(turned(state)), "tension"
        assert state.status is Status.CONVERGED
    return math.degrees(turned(state)), "cable"
