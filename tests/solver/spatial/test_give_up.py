"""Steps in space that used to be given up on, though the robot stalls."""

import pytest

from solver import Scene, Status
from solver.spatial import SpatialRobot, SpatialSolver, Sphere


def test_a_descent_that_loses_no_energy_leaves_a_wedged_robot_the_work_to_reach_its_tension_limit():
    """A segment caught between two spheres: the tension rises from 8 N to the limit within a micrometre."""
    robot = SpatialRobot.prototype(model="paper", segments=9, between=1)
    scene = Scene(
        [
            Sphere(center=(0.4980184451862861, -21.782172176641982, 103.13490804603079), radius=7.412391034398317),
            Sphere(center=(6.369342656127135, -39.23245352276464, 106.52391698418005), radius=8.130649013725897),
            Sphere(center=(-30.32368632200174, -22.249220305267425, 126.56065625842108), radius=7.539549173073781),
        ]
    )
    solver = SpatialSolver(robot, scene)
    state = solver.rest()
    for command in (
        (8.08782539161514, -12.566370614359172),
        (-11.915122168526647, 3.6035652771738294),
        (-7.623056093213194, 7.478140311929766),
        (-8.148664837969664, 7.4336744889432245),
    ):
        state = solver.step(state, command)
    assert state.status is Status.STALLED
    assert state.tensions.max() == pytest.approx(15, rel=1e-6)
    residuals = state.residuals()
    assert max(residuals.stationarity * robot.length_mm, residuals.gaps / robot.length_mm) < 1e-8
