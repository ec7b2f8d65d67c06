"""Disks of the rod in space that meet."""

import numpy as np
import pytest

from solver import Cable, Scene, Status
from solver.spatial import SpatialRobot, SpatialSolver, Sphere


def test_wide_disks_meet_one_after_the_other_until_the_motor_stalls():
    cables = Cable(), Cable(angle=1.5)
    robot = SpatialRobot.prototype(model="rod", disk_radius_mm=120, max_tension=100, cables=cables)
    solver = SpatialSolver(robot, Scene([Sphere(center=(40, 8, 100), radius=12)]))
    states = [solver.rest()]
    for pull in np.arange(0.25, 13, 0.25):
        states.append(solver.step(states[-1], (pull, 0.44 * pull)))
        assert states[-1].status in (Status.CONVERGED, Status.STALLED)
        assert states[-1].factorizations < 200  # steps end within Newton's method, not by a descent
        assert max(solver.optimality(states[-1])) < 1e-9
    assert states[-1].tensions.max() == pytest.approx(100, rel=1e-6)
