"""The closed form of the free robot against the solver."""

import math
from dataclasses import replace

import numpy as np
import pytest

from solver import Circle, HalfPlane, Robot, Scene, Solver
from solver.common.robot import MODELS
from solver.planar.free import clearance, fitted_slopes, free_nodes, free_tension, tip_slopes

EVERY_MODEL = pytest.mark.parametrize("model", MODELS)


def robot_with(model):
    return replace(Robot.prototype(model="paper"), model=model, length_range_mm=(100, 200))


@EVERY_MODEL
@pytest.mark.parametrize("length", [180.0, 130.0])
def test_free_robot_in_closed_form(model, length):
    solver = Solver(robot_with(model), Scene())
    for pulled in (0.0, 0.5, 5.0, 12.0):
        robot, equilibrium = solver.robot.at(length), solver.step(solver.rest(), pulled, length)
        assert free_nodes(robot, pulled) == pytest.approx(equilibrium.nodes, abs=1e-11)
        assert free_tension(robot, pulled) == pytest.approx(equilibrium.tension, abs=1e-11)


@EVERY_MODEL
def test_slopes_of_the_tip(model):
    robot, h = robot_with(model), 1e-5
    slopes = (free_nodes(robot, 5 + h)[-1] - free_nodes(robot, 5 - h)[-1]) / (2 * h)
    assert tip_slopes(robot, 5.0) == pytest.approx(slopes, rel=1e-7)
    slopes = (free_nodes(robot, 5 + h)[14] - free_nodes(robot, 5 - h)[14]) / (2 * h)
    assert tip_slopes(robot, 5.0, node=14) == pytest.approx(slopes, rel=1e-7)


@EVERY_MODEL
def test_fitted_slopes_lie_between_and_tend_to_the_exact_ones(model):
    robot = robot_with(model)
    fitted, low, high = fitted_slopes(robot, 2.0, 6.0), tip_slopes(robot, 2.0), tip_slopes(robot, 6.0)
    assert np.all((np.minimum(low, high) <= fitted) & (fitted <= np.maximum(low, high)))
    assert fitted_slopes(robot, 3.999, 4.001) == pytest.approx(tip_slopes(robot, 4.0), rel=1e-6)
    assert fitted_slopes(robot, 3.999, 4.001, node=9) == pytest.approx(tip_slopes(robot, 4.0, node=9), rel=1e-6)
    with pytest.raises(ValueError, match="range from low_mm to high_mm is 5 to 2"):
        fitted_slopes(robot, 5, 2)


@EVERY_MODEL
def test_clearance_is_the_smallest_gap_of_the_free_robot(model):
    scene = Scene([Circle(center=(44, 104), radius=15), HalfPlane(point=(31, 127), normal=(-1, 0), nodes=(14,))])
    rest = Solver(robot_with(model), scene).rest()
    assert clearance(rest.robot, scene, 0.0) == pytest.approx(rest.gaps.min(), abs=1e-12)
    assert clearance(rest.robot, Scene(), 3.0) == math.inf


@pytest.mark.parametrize("high", [1e-320, 1e-12])
def test_a_line_is_not_fitted_to_roundoff(high):
    with pytest.raises(ValueError, match=r"must grow within 0 to .* mm, by at least"):
        fitted_slopes(Robot.prototype(model="paper"), 0.0, high)
