"""Rest under loads: in equilibrium with all of them, and no cable beyond its tension limit where it can be paid out."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from solver import PRESETS, BatchSolver, Cable, Load, Robot, Scene, Solver, Status, spatial

KINDS = {"plane": (Robot, Solver), "space": (spatial.SpatialRobot, spatial.SpatialSolver)}
PULLING = [case for case in product(PRESETS, KINDS) if case != ("prototype", "plane")]  # the one that pays nothing out
RESTS = [Status.CONVERGED, Status.SNAPPED]  # in space a load may tip the robot over on the way to all of it


def loaded(name, kind):
    """A robot whose weight and dead forces, of 3 EI/L² together, bend it away from a cable."""
    robot = KINDS[kind][0].preset(name, model="rod", max_tension=np.inf)
    across = np.eye(2 if kind == "plane" else 3)[0]
    down = np.roll(across, -1)
    load = (-across - 0.5 * down) * robot.rigidity / robot.length_mm**2
    tip, middle = Load(node=robot.segments, force=tuple(load)), Load(node=robot.segments // 2, force=tuple(0.5 * load))
    return replace(robot, weight_per_length=tuple(1.5 * load / robot.length_mm), loads=(tip, middle))


def rest(robot, limit, kind):
    return KINDS[kind][1](replace(robot, max_tension=limit), Scene()).rest()


def unbalanced(state):
    """The residuals of the node-coordinate problem, all loads included, in natural units."""
    length = state.length_mm
    return max(np.array(state.residuals()) * [length, 1 / length, 1 / length, 1.0, length])


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("kind", KINDS)
def test_rests_right_below_the_tension_limit(name, kind):
    robot = loaded(name, kind)
    free = rest(robot, np.inf, kind)
    held = rest(robot, free.tensions.max() * (1 + 1e-7), kind)
    assert free.tensions.max() > 0
    for state in (free, held):
        assert state.status in (RESTS if kind == "space" else RESTS[:1])
        assert unbalanced(state) < 1e-9
    assert held.nodes == pytest.approx(free.nodes, abs=1e-9 * robot.length_mm)


@pytest.mark.parametrize(("name", "kind"), PULLING)
@pytest.mark.parametrize("share", [0.999, 0.5])
def test_pays_out_what_the_motors_cannot_hold(name, kind, share):
    robot = loaded(name, kind)
    limit = share * rest(robot, np.inf, kind).tensions.max()
    state = rest(robot, limit, kind)
    assert state.status is Status.STALLED
    assert state.tensions.max() <= limit
    assert unbalanced(state) < 1e-9


@pytest.mark.parametrize("limit", [1.0, 2.0, 2.1, 2.2])
def test_the_only_cable_of_a_robot_in_space_is_paid_out_as_one_of_two_is(limit):
    alone = spatial.SpatialRobot.prototype(
        cables=(Cable(),), max_tension=limit, loads=(Load(node=18, force=(-0.2, 0.05, 0.0)),)
    )
    solver = spatial.SpatialSolver(alone, Scene())
    state = solver.rest()
    other = rest(replace(alone, cables=(Cable(), Cable(angle=np.pi / 2))), limit, "space")
    assert state.status is other.status is Status.STALLED
    assert limit * (1 - 1e-6) <= state.tensions[0] <= limit
    assert unbalanced(state) < 1e-9
    assert state.cables_mm[0] < 0
    assert state.cables_mm[0] == pytest.approx(other.cables_mm[0], abs=1e-6)
    assert state.nodes == pytest.approx(other.nodes, abs=1e-6)
    assert solver.step(state, (-5.0,)).status is Status.CONVERGED


def test_a_cable_that_cannot_be_paid_out_holds_the_robot_or_there_is_no_rest():
    robot = Robot.prototype(loads=(Load(node=18, force=(-0.2, 0.0)),))
    needed = rest(robot, np.inf, "plane").tensions[0]
    for share in np.linspace(0.97, 0.9999, 21).tolist():
        with pytest.raises(ValueError, match=r"max_tension is .*, its cables paid out to 0 mm at most, or .*: raise "):
            rest(robot, share * needed, "plane")
    batch, weak = BatchSolver(robot, 2, 0), replace(robot, max_tension=0.99 * needed)
    batch.assign(0, Scene(), weak)
    batch.assign(1, Scene())
    with pytest.raises(ValueError, match="at rest its loads cannot all be carried"):
        batch.rest([0, 1])
    with pytest.raises(ValueError, match="before it moves"):
        batch.step(np.zeros(2))
    batch.step(np.ones(1), [1])
    assert batch.equilibrium(1).status is Status.CONVERGED


@pytest.mark.parametrize("kind", KINDS)
def test_no_rest_where_paying_out_as_far_as_allowed_does_not_help(kind):
    robot = replace(loaded("prototype", kind), max_cable_mm=0.1, cables=(Cable(), Cable(angle=np.pi)))
    with pytest.raises(ValueError, match=r"its cables paid out to -0\.1 mm at most"):
        rest(robot, 0.1 * rest(robot, np.inf, kind).tensions.max(), kind)


@pytest.mark.parametrize("share", [4.5, 9.0, 30.0])
def test_a_robot_in_line_with_a_load_that_buckles_it_falls_over(share):
    """Its cable keeps the tip upright on one side, where Euler's load is four times the cantilever's."""
    euler = np.pi**2 * 5000 / (4 * 180**2)
    state = rest(Robot.prototype(loads=(Load(node=18, force=(0.0, -share * euler)),)), np.inf, "plane")
    aside = rest(Robot.prototype(loads=(Load(node=18, force=(1e-4, -share * euler)),)), np.inf, "plane")
    assert state.status is Status.SNAPPED
    assert unbalanced(state) < 1e-8
    assert state.nodes == pytest.approx(aside.nodes, abs=0.02)


def test_a_column_stands_up_to_the_length_at_which_its_weight_buckles_it():
    """Greenhill: w L³ = 7.837 EI; both cables are paid out."""
    weight = 7.837 * 5000 / 100**3
    pair = (Cable(), Cable(angle=np.pi))
    robot = Robot.prototype(length_mm=50.0, length_range_mm=(20, 200), weight_per_length=(0.0, -weight), cables=pair)
    solver = Solver(robot, Scene())
    state = solver.step(solver.rest(), (-5.0, -5.0))
    for length in (80.0, 99.0):
        state = solver.step(state, (-5.0, -5.0), length)
        assert state.status is Status.CONVERGED
        assert state.nodes[-1, 0] == pytest.approx(0.0, abs=1e-9)
    state = solver.step(state, (-5.0, -5.0), 101.0)
    assert state.status is Status.SNAPPED
    assert abs(state.nodes[-1, 0]) > 5
