"""Forces in space: the work they do, the estimate, and its planar limit."""

import numpy as np
import pytest

from solver import HalfPlane, Robot, Scene, Solver
from solver.planar.forces import VirtualWork
from solver.spatial import HalfSpace, SpatialRobot, SpatialSolver, Sphere
from solver.spatial.forces import SpatialVirtualWork, force_true, with_friction

SPHERE = Sphere(center=(40, 18, 104), radius=15)


@pytest.fixture(name="pressed")
def pressed_fixture(robot, walk):
    return walk(SpatialSolver(robot, Scene([SPHERE])), ((k / 2, k / 5) for k in range(1, 17)))


def test_forces_follow_from_the_multipliers(pressed):
    total = np.zeros(3)
    for _, line, position in np.argwhere(pressed.contact):
        normal = SPHERE.normal_at(pressed.points[line, position])
        total += pressed.energy_scale * pressed.multipliers[0, line, position] * normal
    assert force_true(pressed)[0] == pytest.approx(total, abs=1e-12)
    assert np.linalg.norm(total) > 0.01


def test_forces_and_tensions_do_the_work_that_the_energy_takes(pressed, robot):
    """B (∂J/∂q·q' + ∂J/∂l) = T + Σ F·x' along any motion that keeps the lengths, but for those of the cables."""
    unknowns, parameters = pressed._node_point()
    slope, _, held, _, gap_slopes = (value.full() for value in pressed._derivatives(unknowns, parameters))
    n = robot.segments
    shortening = np.zeros((2, len(held)))
    shortening[0, n : 2 * n] = shortening[1, 2 * n : 3 * n] = -1.0 / n
    null = np.linalg.svd(held)[2][len(held) :]
    generator = np.random.default_rng(0)
    for pulls in generator.normal(size=(10, 2)):
        motion = np.linalg.lstsq(held, pulls @ shortening, rcond=None)[0] + generator.normal(size=len(null)) @ null
        work = pressed.energy_scale * float(pressed.multipliers[:, :, 1:].ravel() @ (gap_slopes @ motion))
        change = pressed.energy_scale * float(slope.ravel() @ motion)
        assert change == pytest.approx(float(pressed.tensions @ pulls) + work, abs=1e-8)


def test_tip_slopes(robot, walk):
    """Of the free robot, by central differences; the turn is what both cables take up, in the limit of a small pull."""
    solver, step = SpatialSolver(robot, Scene()), 1e-5
    for command in ((3.0, -1.0), (0.0, 0.0), (-4.0, 2.0)):
        here = walk(solver, [command])
        for k, change in enumerate(step * np.eye(2)):
            ahead, behind = (walk(solver, [np.array(command) + sign * change]) for sign in (1, -1))
            slope = (ahead.nodes[-1] - behind.nodes[-1]) / (2 * step)
            assert here.tip_slopes[k, :3] == pytest.approx(slope, abs=1e-7)
    assert walk(solver, [(0.0, 0.0)]).tip_slopes[:, 3:] == pytest.approx(np.eye(2), abs=1e-12)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_estimate_is_that_of_the_plane(robot, walk, friction):
    in_space = Scene([HalfSpace(point=(31, 0, 127), normal=(-1, 0, 0.1), nodes=(14,))])
    in_plane = Scene([HalfPlane(point=(31, 127), normal=(-1, 0.1), nodes=(14,))])
    solver = Solver(Robot.prototype(model="paper"), in_plane)
    planar = solver.rest()
    for pull in np.arange(0.25, 7.1, 0.25):
        planar = solver.step(planar, pull)
    spatial = walk(SpatialSolver(robot, in_space), ((pull, 0.0) for pull in np.arange(0.25, 7.1, 0.25)))
    expected = VirtualWork(friction).estimate(planar)
    assert expected.any()
    estimate = SpatialVirtualWork(friction).estimate(spatial)
    assert estimate[0, [0, 2]] == pytest.approx(expected[0], rel=1e-4)


def test_estimate_does_not_depend_on_where_the_cables_lie(robot, turned, walk):
    """The scene turned by a quarter, and so are the commands."""
    other = Sphere(center=turned(SPHERE.center, np.pi / 2), radius=SPHERE.radius)
    here = walk(SpatialSolver(robot, Scene([SPHERE])), ((k / 2, k / 5) for k in range(1, 17)))
    there = walk(SpatialSolver(robot, Scene([other])), ((-k / 5, k / 2) for k in range(1, 17)))
    estimate = SpatialVirtualWork(0.2).estimate(here)
    assert SpatialVirtualWork(0.2).estimate(there) == pytest.approx(turned(estimate, np.pi / 2), rel=1e-6)


def test_friction_is_tangential_and_slides_with_the_tip():
    slopes = np.array([[10.0, 0.0, -3.0], [0.0, 10.0, 0.0]])
    normal = np.array([-2.0, 0.0, 0.0])
    assert with_friction(normal, slopes, 0.5) == pytest.approx([-2.0, 0.0, -1.0])
    assert with_friction(np.zeros(3), slopes, 0.5) == pytest.approx(np.zeros(3))


def test_nothing_is_estimated_where_nothing_touches(robot, walk):
    free = walk(SpatialSolver(robot, Scene([SPHERE])), [(1.0, 1.0)])
    assert not SpatialVirtualWork(0.2).estimate(free).any()
    assert not free.onset_tensions.any()


def test_the_estimate_refuses_a_rod():
    rest = SpatialSolver(SpatialRobot.prototype(), Scene([SPHERE])).rest()
    with pytest.raises(ValueError, match=r"model is 'rod'; .* model=\"paper\""):
        SpatialVirtualWork().estimate(rest)
