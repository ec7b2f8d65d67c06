"""Cases in space that went wrong once, with the values that other ways to the same command give."""

import json
import time
from pathlib import Path

import numpy as np
import pytest

from solver import Scene, Status
from solver.spatial import Box, SpatialRobot, SpatialSolver, Sphere

TARGET = np.array([4.427, 8.855])
WAYS = {  # each with the steps that snap: two go round the sphere and do not touch it
    "one step": ([TARGET], [0]),
    "ten steps": (np.linspace((0, 0), TARGET, 11)[1:], [9]),
    "400 steps": (np.linspace((0, 0), TARGET, 401)[1:], [386]),
    "first cable first": ([(4.427, 0), TARGET], []),
    "second cable first": ([(0, 8.855), TARGET], []),
}


@pytest.mark.parametrize("way", WAYS)
def test_a_robot_slips_off_a_sphere_by_every_way(way):
    solver = SpatialSolver(SpatialRobot.prototype(model="paper"), Scene([Sphere(center=(20, 40, 160), radius=12)]))
    state, (commands, snaps) = solver.rest(), WAYS[way]
    for k, cables in enumerate(commands):
        state = solver.step(state, cables)
        assert state.status is (Status.SNAPPED if k in snaps else Status.CONVERGED)
        assert state.cables_mm == pytest.approx(cables)
    assert state.nodes[-1] == pytest.approx((43.77868, 87.56725, 137.46190), abs=1e-3)
    assert state.tensions == pytest.approx((1.92174, 3.84574), abs=1e-4)


@pytest.mark.parametrize("model", ["paper", "rod"])
@pytest.mark.parametrize("edge", [1e-3, 1e-4])
def test_a_sharp_edge_costs_no_more_than_a_round_one(edge, model):
    def cost(edge):
        box = Box(center=(45, 0, 100), sizes=(20, 20, 20), edge=edge)
        solver, times = SpatialSolver(SpatialRobot.prototype(model=model), Scene([box])), []
        for _ in range(8):
            began = time.thread_time()
            solver.step(solver.rest(), (10.0, 0.0))
            times.append(time.thread_time() - began)
        return min(times)

    assert cost(edge) <= 3 * cost(1.0)


@pytest.mark.parametrize(
    ("center", "radius", "cables"),
    [
        ((-53.38524317875361, 7.5417771509344975, 164.1778276218874), 6.8916836565247666, (-5.5397466, 1.46007529)),
        (
            (31.58650833487242, -48.89395350346166, 115.31998095294595),
            7.54523181151059,
            (4.967132041982063, -7.948860686),
        ),
    ],
)
def test_large_steps_end_where_small_ones_do(center, radius, cables):
    """Which of two neighbouring points meets a narrow obstacle does not depend on the size of the steps."""
    solver = SpatialSolver(SpatialRobot.prototype(model="paper"), Scene([Sphere(center=center, radius=radius)]))
    ends = []
    for steps in (400, 1, 2, 5, 12, 20, 50):
        state = solver.rest()
        for part in np.arange(1, steps + 1) / steps:
            state = solver.step(state, part * np.array(cables))
            assert state.status is Status.CONVERGED
        ends.append(state.nodes)
    assert ends[1:] == [pytest.approx(ends[0], abs=1e-6)] * len(ends[1:])


def test_a_motor_never_ends_above_its_limit_where_a_release_snaps_twice():
    """What is kept of a step that ends above the limit is the last state that the motor held, not one before a snap."""
    recorded = json.loads((Path(__file__).parents[2] / "data" / "spatial_yield.json").read_text())
    robot = SpatialRobot.prototype(model="paper", between=1)
    spheres = [Sphere(center=(x, y, z), radius=radius) for x, y, z, radius in recorded["spheres"]]
    solver = SpatialSolver(robot, Scene(spheres))
    state = solver.rest()
    for cables in recorded["commands_mm"]:
        state = solver.step(state, cables)
        assert state.tensions.max() <= robot.max_tension


@pytest.mark.parametrize("command", [(6.5, -9.8), (-7.7, -5.0), (12.0, 4.6), (4.4, 12.0)])
def test_each_cable_of_a_free_robot_goes_to_its_own_limit_at_once(command):
    """Where one is held at the limit already, the other is still followed up to it."""
    solver = SpatialSolver(SpatialRobot.prototype(model="paper", max_tension=1.87), Scene())
    stalled = solver.step(solver.rest(), command)
    assert stalled.status is Status.STALLED
    assert stalled.tensions == pytest.approx(np.full(2, 1.87), rel=1e-5)


@pytest.mark.parametrize("seed", [54, 71, 121, 126, 127, 140, 149])
def test_a_stalled_step_stays_where_it_is_when_its_command_is_repeated(seed, random_solver):
    generator, stalls = np.random.default_rng(seed), 0
    limit = float(generator.uniform(1.5, 6))
    solver = random_solver(generator, SpatialRobot.prototype(model="paper", max_tension=limit))
    state = solver.rest()
    for command in generator.uniform(-12, 12, (6, 2)):
        state = solver.step(state, command)
        if state.status is Status.STALLED:
            again = solver.step(state, command)
            assert again.status is Status.STALLED
            assert again.cables_mm == pytest.approx(state.cables_mm, abs=1e-4 * solver.robot.offset_mm)
            stalls += 1
    assert stalls
