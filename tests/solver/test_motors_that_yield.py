"""Motors that cannot hold their cables: these are let out until they can, at once or in a snap."""

import math

import numpy as np
import pytest

from solver import Cable, Ellipse, Robot, Scene, Solver, Status
from solver.spatial import SpatialRobot, SpatialSolver

LIMIT = 15.0  # [N]
PAIR = Robot(
    length_mm=18,
    segments=30,
    offset_mm=0.8,
    rigidity=50,
    max_tension=LIMIT,
    between=1,
    touch=("backbone", "cable", "rim"),
    cables=(Cable(), Cable(angle=math.pi)),
)
FLAT_SIDE = Ellipse(center=(4.402454285836872, 18.124936708140847), radii=(0.387, 2.992), axis=(-0.84267, 0.53844))
FIVE_CABLES = SpatialRobot.prototype(
    max_tension=LIMIT,
    cables=tuple(Cable(angle=angle) for angle in (0.6, 2.45, 2.05, 4.68, 5.73)),
    segment_rigidity=(
        *(4467, 13514, 6269, 2877, 5416, 3493, 13212, 3558, 9945),
        *(11257, 3424, 3499, 3694, 1810, 15097, 6378, 12407, 12120),
    ),
    torsion_ratio=0.9,
)


def test_a_cable_snaps_out_that_its_motor_cannot_hold_while_it_is_let_out():
    """Its tension rises as it is let out along a flat side: no length is held there, nor is the limit kept."""
    solver, command = Solver(PAIR, Scene([FLAT_SIDE])), np.array([0.64, -1.28])
    stalled = solver.step(solver.step(solver.rest(), (1.18, -2.36)), command)
    assert stalled.status is Status.STALLED
    assert stalled.tensions == pytest.approx([LIMIT, 0], rel=1e-6)
    assert stalled.cables_mm[1] == pytest.approx(command[1])
    assert stalled.cables_mm[0] < command[0] - 0.001
    assert max(solver.optimality(stalled)) < 1e-9


def test_a_cable_that_yields_is_let_out_no_farther_than_until_its_motor_holds_it():
    """The cables snap from limit to limit; left slack, they would touch nothing and be pulled in again."""
    solver, command = SpatialSolver(FIVE_CABLES, Scene()), (15.02159, 18.59994, 25.13274, -25.13274, -15.57599)
    stalled = solver.step(solver.step(solver.rest(), (10.72704, 12.72451, 17.57275, -19.5171, -10.5921)), command)
    again = solver.step(stalled, command)
    assert stalled.status is again.status is Status.STALLED
    assert stalled.tensions.max() == pytest.approx(LIMIT, rel=1e-6)
    assert again.cables_mm == pytest.approx(stalled.cables_mm, abs=1e-5 * FIVE_CABLES.offset_mm)
