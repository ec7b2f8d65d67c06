"""The reference solver keeps the contract of the solver; their answers are compared in test_certificate.py."""

import numpy as np
import pytest

from solver import HalfPlane, ReferenceSolver, Robot, Scene, Solver, Status

SCENE = ((33, 89, 12.5),)


def walk(solver, cables):
    equilibrium = solver.rest()
    for cable in cables:
        equilibrium = solver.step(equilibrium, cable)
    return equilibrium


def test_rest_is_the_solvers(circles):
    robot, scene = Robot.prototype(model="paper"), circles(*SCENE)
    np.testing.assert_allclose(
        ReferenceSolver(robot, scene).rest().block, Solver(robot, scene).rest().block, atol=1e-12
    )


def test_load_cell_touches_its_node_alone():
    robot = Robot.prototype(model="paper")
    scene = Scene([HalfPlane(point=(26, 0), normal=(-1, 0), nodes=(14,))])
    reference = walk(ReferenceSolver(robot, scene), [2.0, 4.0])
    native = walk(Solver(robot, scene), [2.0, 4.0])
    assert np.argwhere(reference.contact).tolist() == [[0, 1, 14]]
    assert np.array_equal(np.isinf(reference.gaps), np.isinf(native.gaps))
    for field in ("cable_mm", "tension", "objective", "shear", "nodes", "cable_nodes", "multipliers", "gaps"):
        np.testing.assert_allclose(getattr(reference, field), getattr(native, field), rtol=1e-6, atol=1e-6)


def test_stalls_at_the_limit(circles):
    robot = Robot.prototype(model="paper", max_tension=4.0)
    reference = ReferenceSolver(robot, circles(*SCENE))
    stalled = walk(reference, [10.0])
    again = reference.step(stalled, 11.0)
    assert stalled.status is again.status is Status.STALLED
    assert max(stalled.tension, again.tension) <= 4.0
    assert stalled.tension == pytest.approx(4.0, rel=1e-5)
    assert again.cable_mm == pytest.approx(stalled.cable_mm, abs=2e-6)
    assert stalled.cable_mm == pytest.approx(walk(Solver(robot, reference.scene), [10.0]).cable_mm, abs=1e-4)


def test_fails_where_the_branch_ends(circles):
    robot = Robot.prototype(model="paper", max_tension=float("inf"))
    scene = circles((32.4, 84.7, 14.9), (57.6, 148.6, 14.3))
    before = walk(Solver(robot, scene), np.arange(1, 50) * 0.25)
    failed = ReferenceSolver(robot, scene).step(before, 14.0)
    assert failed.status is Status.GAVE_UP
    assert np.array_equal(failed.block, before.block)


def test_released_robot_is_straight(circles):
    reference = ReferenceSolver(Robot.prototype(model="paper"), circles(*SCENE))
    released = walk(reference, [6.0, 0.0])
    assert released.status is Status.CONVERGED
    assert np.array_equal(released.block, reference.rest().block)


def test_refuses_what_the_solver_refuses(circles):
    with pytest.raises(ValueError, match="overlaps the unstressed robot"):
        ReferenceSolver(Robot.prototype(model="paper"), circles((10, 80, 12)))
    reference = ReferenceSolver(Robot.prototype(model="paper"), circles(*SCENE))
    with pytest.raises(ValueError, match="cable_mm is nan"):
        reference.step(reference.rest(), float("nan"))
