"""Cables of the rod in space that pull against each other."""

import math

import pytest

from solver import Cable, Scene, Status
from solver.spatial import SpatialRobot, SpatialSolver


@pytest.mark.parametrize("count", [3, 4, 6])
def test_cables_all_around_stall_at_the_tension_limit(count):
    cables = tuple(Cable(angle=2 * math.pi * k / count) for k in range(count))
    solver = SpatialSolver(SpatialRobot.prototype(model="rod", cables=cables), Scene())
    bent = solver.step(solver.rest(), [4 * math.cos(cable.angle) for cable in cables])
    tight = solver.step(bent, [4 * math.cos(cable.angle) + 0.5 for cable in cables])
    again = solver.step(tight, [4 * math.cos(cable.angle) + 0.5 for cable in cables])
    for state in (tight, again):
        assert state.status is Status.STALLED
        assert state.tensions.max() == pytest.approx(15, rel=1e-6)
        assert max(solver.optimality(state)) < 1e-10
    assert again.cables_mm == pytest.approx(tight.cables_mm, abs=1e-9)
    free = solver.step(again, bent.cables_mm)
    assert free.status is Status.CONVERGED
    assert free.nodes == pytest.approx(bent.nodes, abs=1e-7)


def test_cables_go_slack_on_a_robot_that_is_straight_then():
    cables = tuple(Cable(angle=math.pi / 2 * k) for k in range(4))
    solver = SpatialSolver(SpatialRobot.prototype(model="rod", cables=cables), Scene())
    state = solver.rest()
    for pull in (0.094, 0.012, -0.07):
        state = solver.step(state, (pull, -1.3, -4.0, -2.0))
        assert state.status is Status.CONVERGED
    assert not state.tensions.any()
    assert state.nodes == pytest.approx(solver.rest().nodes, abs=1e-12)
