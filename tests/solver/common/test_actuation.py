"""Commands of sections: each bends its own section, whatever the cables are."""

import math

import numpy as np
import pytest

from solver import PRESETS, Actuation, Cable, Robot, Scene, Solver, Status
from solver.spatial import SpatialRobot, SpatialSolver

SURROUNDED = [name for name, row in PRESETS.items() if row.cables]


def bent(robot, commands, steps=10):
    """Return the free robot after a command, in steps."""
    space = 2 if isinstance(robot, Robot) else 3
    actuation, solver = Actuation.of(robot, space), (Solver if space == 2 else SpatialSolver)(robot, Scene())
    state = solver.rest()
    for k in range(steps):
        state = solver.step(state, actuation.cables_mm(np.array(commands) * robot.offset_mm * (k + 1) / steps))
        assert state.status == Status.CONVERGED
    return state


@pytest.mark.parametrize("name", SURROUNDED)
def test_a_planar_command_is_the_angle_of_its_section(name):
    robot = Robot.preset(name)
    sections = PRESETS[name].sections
    commands = [0.4, -0.3][:sections]
    angles = -bent(robot, commands).nodes[:: robot.segments // sections, 2]
    assert np.diff(angles) == pytest.approx(commands, rel=0.02)  # the chords of the cables are a little shorter


@pytest.mark.parametrize("name", SURROUNDED)
def test_a_command_in_space_bends_its_section_in_its_direction(name):
    robot, sections = SpatialRobot.preset(name), PRESETS[name].sections
    commands = np.array([0.3, 0.2, -0.2, 0.1])[: 2 * sections]
    frames = bent(robot, commands).frames[:: robot.segments // sections]
    for first, last, command in zip(frames, frames[1:], commands.reshape(-1, 2), strict=False):
        axis = (first.T @ last)[:2, 2]  # where the section's end points, seen from its beginning
        assert axis / np.linalg.norm(axis) == pytest.approx(command / np.linalg.norm(command), abs=0.05)
        assert math.asin(np.linalg.norm(axis)) == pytest.approx(np.linalg.norm(command), rel=0.03)


@pytest.mark.parametrize("name", SURROUNDED)
@pytest.mark.parametrize("kind", [Robot, SpatialRobot])
def test_what_is_reached_is_what_was_commanded_unless_a_pulled_cable_stops(name, kind):
    robot = kind.preset(name)
    actuation = Actuation.of(robot, 2 if kind is Robot else 3)
    generator = np.random.default_rng(0)
    for _ in range(20):
        commands = generator.normal(size=actuation.matrix.shape[1])
        cables = actuation.cables_mm(commands)
        assert np.array_equal(actuation.reached(commands, cables), commands)
        pulled = int(np.argmax(cables))
        short = cables - 0.1 * (np.arange(len(cables)) == pulled)
        assert actuation.cables_mm(actuation.reached(commands, short))[pulled] == pytest.approx(short[pulled])
        paid_out = int(np.argmin(cables))
        slack = cables - 0.1 * (np.arange(len(cables)) == paid_out)
        assert np.array_equal(actuation.reached(commands, slack), commands)


def test_commands_are_cables_where_nothing_opposes():
    single = Actuation.of(Robot.prototype(), 2)
    assert single.matrix.tolist() == [[1.0]]
    assert (single.low.tolist(), single.high.tolist()) == ([0.0], [1.0])
    away = Actuation.of(Robot.prototype(cables=(Cable(angle=math.pi),)), 2)
    assert (away.low.tolist(), away.high.tolist()) == ([-1.0], [0.0])
    pairs = Actuation.of(SpatialRobot.prototype(model="paper", angle=2.0), 3)
    assert pairs.matrix.tolist() == np.eye(2).tolist()
    assert pairs.steady(np.array([1.0, 0.0])) == pytest.approx([1.0, math.cos(2.0)])


@pytest.mark.parametrize("side", [0.0, math.pi])
def test_a_single_cable_nearer_than_the_offset_reaches_what_was_commanded(side):
    actuation = Actuation.of(Robot.prototype(cables=(Cable(angle=side, offset_mm=6.0),)), 2)
    command = np.array([4.0 * math.cos(side)])
    cables = actuation.cables_mm(command)
    assert cables == pytest.approx([3.0])
    assert actuation.reached(command, cables) == pytest.approx(command)
    assert actuation.cables_mm(actuation.reached(command, cables - 0.5)) == pytest.approx(cables - 0.5)


def test_a_single_cable_in_space_reaches_the_commands_of_both_axes():
    actuation = Actuation.of(SpatialRobot.prototype(cables=(Cable(angle=0.5),)), 3)
    commands = np.array([1.0, 0.5])
    cables = actuation.cables_mm(commands)
    assert actuation.reached(commands, cables).tolist() == commands.tolist()
    assert actuation.cables_mm(actuation.reached(commands, cables - 0.1)) == pytest.approx(cables - 0.1)


@pytest.mark.parametrize("name", SURROUNDED)
def test_the_work_of_tensions_is_that_of_the_cables(name):
    robot = SpatialRobot.preset(name)
    actuation, generator = Actuation.of(robot, 3), np.random.default_rng(1)
    tensions, commands = generator.random(len(robot.cables)), generator.normal(size=actuation.matrix.shape[1])
    assert actuation.forces(tensions) @ commands == pytest.approx(tensions @ actuation.cables_mm(commands))
