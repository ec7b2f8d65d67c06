"""Cases in space that went wrong once, with the values that other ways to the same command give."""

import time

import numpy as np
import pytest

from solver import Scene, Status
from solver.spatial import Box, SpatialRobot, SpatialSolver, Sphere

TARGET = np.array([4.427, 8.855])
WAYS = {
    "one step": [TARGET],
    "ten steps": np.linspace((0, 0), TARGET, 11)[1:],
    "400 steps": np.linspace((0, 0), TARGET, 401)[1:],
    "first cable first": [(4.427, 0), TARGET],
    "second cable first": [(0, 8.855), TARGET],
}


@pytest.mark.parametrize("way", WAYS)
def test_a_robot_slips_off_a_sphere_by_every_way(way):
    solver = SpatialSolver(SpatialRobot.prototype(), Scene([Sphere(center=(20, 40, 160), radius=12)]))
    state = solver.rest()
    for cables in WAYS[way]:
        state = solver.step(state, cables)
        assert state.status in {Status.CONVERGED, Status.SNAPPED}
        assert state.cables_mm == pytest.approx(cables)
    assert state.nodes[-1] == pytest.approx((43.77868, 87.56725, 137.46190), abs=1e-3)
    assert state.tensions == pytest.approx((1.92174, 3.84574), abs=1e-4)


@pytest.mark.parametrize("edge", [1e-3, 1e-4])
def test_a_sharp_edge_costs_no_more_than_a_round_one(edge):
    def cost(edge):
        box = Box(center=(45, 0, 100), sizes=(20, 20, 20), edge=edge)
        solver, times = SpatialSolver(SpatialRobot.prototype(), Scene([box])), []
        for _ in range(8):
            began = time.thread_time()
            solver.step(solver.rest(), (10.0, 0.0))
            times.append(time.thread_time() - began)
        return min(times)

    assert cost(edge) <= 3 * cost(1.0)
