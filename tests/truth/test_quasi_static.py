"""The largest quasi-static rate against beams and chains in motion."""

import math

import numpy as np
import pytest

from solver import Robot, natural_frequency, quasi_static_rate
from solver.spatial import SpatialRobot
from truth import beam


def unit(robot, mass_per_length):
    """Unit of time of the beams for a robot [s]."""
    metres, newtons = robot.length_mm / 1e3, robot.rigidity / 1e6  # EI in N·m²
    return metres**2 * math.sqrt(mass_per_length / newtons)


@pytest.mark.parametrize("robot", [Robot.prototype(), SpatialRobot.preset("guidewire"), Robot.preset("snake_arm")])
def test_the_natural_frequency_is_that_of_finite_elements(robot):
    expected = beam.frequency() / unit(robot, 0.05) / (2 * math.pi)
    assert natural_frequency(robot, 0.05) == pytest.approx(expected, rel=1e-6)


def test_a_soft_segment_lowers_it():
    soft = [5000.0] * 17 + [1250.0]
    robot = Robot.prototype(segment_rigidity=soft)
    assert natural_frequency(robot, 0.05) == pytest.approx(natural_frequency(Robot.prototype(), 0.05) / 2)


def tip_error(robot, mass_per_length, rate, prescribed):
    """Largest distance of the tip from the equilibrium over the length, for a cable rate [mm/s] and the worst stop."""
    turning = rate / robot.offset_mm * unit(robot, mass_per_length)
    times = np.linspace(0, 12, 600)
    stops = np.linspace(0.1, 4, 20)
    return turning * max(np.abs(beam.swing(prescribed, stop, times)).max() for stop in stops)


@pytest.mark.parametrize("prescribed", ["moment", "angle"])
@pytest.mark.parametrize("error", [0.002, 0.01, 0.05])
def test_at_the_largest_rate_the_tip_is_as_near_as_asked_for(error, prescribed):
    robot = Robot.prototype()
    found = tip_error(robot, 0.05, quasi_static_rate(robot, 0.05, error), prescribed)
    assert found < error
    assert found > (0.6 if prescribed == "moment" else 0.2) * error  # not by a needlessly slow rate


@pytest.mark.parametrize("bend", [0.3, 1.5])
def test_far_bends_keep_it(bend):
    error = 0.04
    assert beam.chain_error(6, error * beam.frequency(), bend, rest=2.0) < error


@pytest.mark.parametrize(("mass", "error"), [(0, 0.01), (math.nan, 0.01), (0.05, 0), (0.05, 0.2), (0.05, "1")])
def test_what_is_out_of_range_is_refused(mass, error):
    with pytest.raises(ValueError, match="it must be"):
        quasi_static_rate(Robot.prototype(), mass, error)
