"""Loss between motor and cable: its two directions, reversals, standstill, the tension limit, and what a fit sees."""

import math
from dataclasses import replace

import numpy as np
import pytest

from solver import (
    HalfPlane,
    RigidityFit,
    Robot,
    Scene,
    Solver,
    Status,
    Transmission,
    contact_estimate,
    force_true,
    free_motion,
)

LOSS = 0.2


def test_tension_is_lost_by_the_direction_of_the_last_motion():
    """η = 0.2: 8 N in the robot are 10 N at a motor that pulls in, and 6.4 N at one that lets out."""
    pulled = Transmission.at_rest(1, LOSS).moved([0.0], [1.0])
    released = pulled.moved([1.0], [0.5])
    assert pulled.motor_tensions([8.0]) == pytest.approx([10.0], rel=1e-15)
    assert released.motor_tensions([8.0]) == pytest.approx([6.4], rel=1e-15)
    assert pulled.robot_tensions([10.0]) == pytest.approx([8.0], rel=1e-15)
    assert released.robot_tensions([6.4]) == pytest.approx([8.0], rel=1e-15)


def test_no_loss_is_no_change():
    tensions, resting = [3.0, 0.0, 0.1], Transmission.at_rest(3)
    for state in (resting, resting.moved([1.0, 2.0, 3.0], [0.0, 2.0, 4.0])):
        np.testing.assert_array_equal(state.motor_tensions(tensions), tensions)


def test_a_cable_that_stands_still_keeps_its_direction():
    state = Transmission.at_rest(1, LOSS)
    assert state.moved([0.0], [0.0]).moved_in.all()
    released = state.moved([1.0], [0.9])
    assert not released.moved([0.9], [0.9]).moved_in.any()
    assert released.moved([0.9], [0.9 + 1e-11]).moved_in.all()
    assert not released.moved([0.9], [0.9 + 1e-15]).moved_in.any()
    assert not released.moved([0.0], [0.0]).moved_in.any()
    assert released.moved([0.0], [1e-15]).moved_in.all()


def test_cables_and_robots_have_directions_of_their_own():
    losses = np.array([0.0, 0.1, 0.5])
    before, after = np.zeros((3, 2)), np.array([[1.0, -1.0], [1.0, 0.0], [-2.0, 0.5]])
    state = Transmission.at_rest(2, losses).moved(before, after)
    assert state.moved_in.tolist() == [[True, False], [True, True], [False, True]]
    expected = [[1, 1], [1 / 0.9, 1 / 0.9], [0.5, 2]]
    assert state.motor_tensions(np.ones((3, 2))) == pytest.approx(np.array(expected), rel=1e-15)
    one = Transmission.at_rest(2, 0.5).moved(before[2], after[2])
    np.testing.assert_array_equal(one.motor_tensions([1.0, 1.0]), state.motor_tensions(np.ones((3, 2)))[2])


def test_motor_tension_jumps_at_a_reversal_of_a_robot():
    solver = Solver(Robot.prototype(model="rod"), Scene())
    state, transmission = solver.rest(), Transmission.at_rest(1, LOSS)
    motor, robot = [], []
    for cable in (4.0, 5.0, 5.0, 4.999, 4.999, 4.0, 4.001):
        stepped = solver.step(state, cable)
        transmission = transmission.moved(state.cables_mm, stepped.cables_mm)
        state = stepped
        robot.append(state.tension)
        motor.append(transmission.motor_tensions(state.tensions).item())
    ratios = np.divide(motor, robot)
    assert ratios == pytest.approx([1.25, 1.25, 1.25, 0.8, 0.8, 0.8, 1.25], rel=1e-14)


def test_a_stalled_motor_holds_its_limit():
    """The limit is the motor's: the robot stalls at 0.8 of it, and stays so under further commands."""
    limit, transmission = 4.0, Transmission.at_rest(1, LOSS)
    (weaker,) = transmission.robot_tensions([limit])
    solver = Solver(replace(Robot.prototype(model="rod"), max_tension=float(weaker)), Scene())
    state = solver.rest()
    for _ in range(3):
        stepped = solver.step(state, 20.0)
        transmission = transmission.moved(state.cables_mm, stepped.cables_mm)
        state = stepped
        assert state.status is Status.STALLED
        assert transmission.motor_tensions(state.tensions) == pytest.approx([limit], rel=1e-6)


def estimate(path, scene, loss, stiffer):
    """Rigidity learnt from the motor's tension before contact, estimate and force at the end of a path."""
    nominal = Robot.prototype(model="rod", max_tension=math.inf)
    solver, truth = Solver(nominal, scene), Solver(replace(nominal, rigidity=stiffer * nominal.rigidity), scene)
    known, state = solver.rest(), truth.rest()
    fit, transmission = RigidityFit.prior(), Transmission.at_rest(1, loss)
    for cable in path:
        known, stepped = solver.step(known, cable), truth.step(state, cable)
        transmission = transmission.moved(state.cables_mm, stepped.cables_mm)
        state = stepped
        motor = transmission.motor_tensions(state.tensions)
        free = free_motion(nominal, np.array(cable), np.array(nominal.length_mm)).tensions
        fit = fit.updated(motor, free, state.contact.any(), tension_noise_n=1e-4)
    found = contact_estimate(known, motor.item(), float(fit.ratio))
    return float(fit.ratio), np.linalg.norm(found), np.linalg.norm(force_true(state))


def test_pulling_alone_shows_rigidity_over_what_arrives():
    """k is the rigidity ratio over 1 − η, and the contact force comes out as N over 1 − η (design, section 6)."""
    scene = Scene([HalfPlane(point=(26.0, 127.0), normal=(-1.0, 0.0), nodes=(14,))])
    path = np.arange(0.1, 6.01, 0.1)
    _, lossless, force = estimate(path, scene, 0.0, 1.5)
    ratio, lossy, same = estimate(path, scene, LOSS, 1.5)
    assert ratio == pytest.approx(1.5 / (1 - LOSS), rel=1e-4)
    assert force == same
    assert lossy == pytest.approx(lossless / (1 - LOSS), rel=1e-4)


def test_a_reversal_tells_loss_from_rigidity():
    """Over a pull and a release the tensions at one displacement have the ratio (1 − η)², whatever the rigidity."""
    free = Scene()
    for stiffer in (0.5, 2.0):
        pulled, *_ = estimate([2.0, 4.0], free, LOSS, stiffer)
        assert pulled == pytest.approx(stiffer / (1 - LOSS), rel=1e-4)
        solver = Solver(Robot.prototype(model="rod", rigidity=5000.0 * stiffer), free)
        up = solver.step(solver.rest(), 4.0)
        down = solver.step(solver.step(up, 5.0), 4.0)
        state = Transmission.at_rest(1, LOSS).moved([0.0], up.cables_mm)
        first = state.motor_tensions(up.tensions)
        second = state.moved([5.0], down.cables_mm).motor_tensions(down.tensions)
        assert second / first == pytest.approx([(1 - LOSS) ** 2], rel=1e-9)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Transmission.at_rest(1, 1.0), "loss is 1.0; it must be from 0 to 0.9"),
        (lambda: Transmission.at_rest(1, [0.1, -0.1]), "loss is .*; all must be from 0 to 0.9"),
        (lambda: Transmission.at_rest(0, 0.1), "cables is 0; it must be a whole number"),
        (lambda: Transmission.at_rest(2).moved([0.0], [1.0]), "after_mm is .*; it must be numbers of shape"),
        (lambda: Transmission.at_rest(1).motor_tensions([math.nan]), "robot_tensions is .*; all must be finite"),
    ],
)
def test_refusals(call, message):
    with pytest.raises(ValueError, match=message):
        call()
