"""A command ends on the same branch in one step and in many small ones, however the robot meets an obstacle's edges."""

import numpy as np
import pytest

from solver import Polygon, Robot, Scene, Solver
from solver.spatial import Box, SpatialRobot, SpatialSolver

STEPS = 60

SLANTED = Box(
    center=(56.998438669314325, 2.124548072769457, 68.08847995246933),
    sizes=(48.22139961577648, 31.676526051853426, 47.841619144674695),
    edge=1.0,
    axis=(-0.9121626763585283, 0.3385019434814108, 0.23103178594677082),
    second=(0.0721453082414248, 0.6875534246520293, -0.7225408934780205),
)
UPRIGHT = Box(
    center=(31.50927248377853, 32.34614712407004, 135.33880032352704),
    sizes=(33.542728605556675, 47.64902325932181, 41.83680103878952),
    edge=1.0,
    axis=(0.9625303410148262, -0.2675609737347245, -0.04411879372794028),
    second=(0.1456410911490863, 0.6473035413538768, -0.7481890121617889),
)
SHARP = Polygon(
    corners=(
        (75.55520573748137, 134.0408621717999),
        (84.99857815787426, 115.33314503887127),
        (105.7088370042656, 118.53332339505353),
        (109.06510846675077, 139.21885952216456),
        (90.42913945964656, 148.8030455680508),
    ),
    radius=0.027512794144296245,
)


def assert_same_branch(solver, step, start, end):
    """Compare the nodes after one step from a command to another and after small ones."""
    reached = step(solver.rest(), start)
    at_once = step(reached, end)
    for command in np.linspace(start, end, STEPS + 1)[1:].tolist():
        reached = step(reached, command)
    np.testing.assert_allclose(at_once.nodes, reached.nodes, rtol=0, atol=1e-4 * solver.robot.longest_mm)


@pytest.mark.parametrize(
    ("box", "start", "end"),
    [(SLANTED, (8.9032, -8.5757), (11.1882, -10.0)), (UPRIGHT, (-2.7779, -0.3566), (2.1424, -1.1119))],
)
def test_an_edge_in_space(box, start, end):
    """The robot meets it from afar, or slides along one side until the next point comes to it."""
    solver = SpatialSolver(SpatialRobot.prototype(between=1), Scene([box]))
    assert_same_branch(solver, lambda state, cables: solver.step(state, tuple(cables)), start, end)


def test_a_corner_in_the_plane():
    """The robot is drawn back over it while it bends."""
    solver = Solver(Robot.prototype(between=1, length_mm=200.0, length_range_mm=(40.0, 200.0)), Scene([SHARP]))
    assert_same_branch(solver, lambda state, command: solver.step(state, *command), (2.92, 200.0), (10.7163, 182.9922))
