"""Eq. 13 as it stands, through IPOPT: the kernel follows the same branch."""

import math

import casadi as ca
import numpy as np
import pytest

from solver import Scene, Status
from solver.spatial import Box, Capsule, Cylinder, SpatialReferenceSolver, SpatialRobot, SpatialSolver, Sphere
from solver.spatial.formulation import node_problem

SPRING = ((0.3, 0.1, 0), (0.1, 0.5, 0), (0, 0, 0.2))
SCENES = {
    "sphere": ((1.0, 0.4), [Sphere(center=(40, 18, 104), radius=15)]),
    "opposite cables": ((-0.4, -1.0), [Sphere(center=(-18, -40, 104), radius=15, spring=0.3)]),
    "capsule on a spring": (
        (-1.0, 0.4),
        [Capsule(start=(-40, -20, 100), end=(-30, 40, 95), radius=9, spring=SPRING)],
    ),
    "cylinder and box": (
        (0.8, 0.8),
        [
            Cylinder(start=(20, 45, 100), end=(50, 10, 110), radius=10, edge=2),
            Box(center=(25, 35, 150), sizes=(20, 20, 20), second=(0, 1, 1)),
        ],
    ),
}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("angle", [math.pi / 2, 2.0])
def test_kernel_follows_the_same_branch(name, angle):
    direction, obstacles = SCENES[name]
    robot = SpatialRobot.prototype(model="paper", angle=angle)
    kernel, reference = SpatialSolver(robot, Scene(obstacles)), SpatialReferenceSolver(robot, Scene(obstacles))
    here, there, touched = kernel.rest(), reference.rest(), 0
    for pull in np.arange(0.5, 6.6, 0.5):
        command = pull * np.array(direction)
        here = kernel.step(here, command)
        if here.status is Status.SNAPPED:  # no branch to compare
            break
        there = reference.step(there, command)
        touched += here.contact.any()
        assert here.status is there.status is Status.CONVERGED
        assert here.points == pytest.approx(there.points, abs=1e-6)
        assert here.frames == pytest.approx(there.frames, abs=1e-7)
        assert here.controls == pytest.approx(there.controls, abs=1e-6)
        assert here.tensions == pytest.approx(there.tensions, abs=1e-7)
        assert here.forces == pytest.approx(there.forces, abs=1e-7)
        assert here.objective == pytest.approx(there.objective, abs=1e-10)
        assert here.displacements == pytest.approx(there.displacements, abs=1e-6)
    assert touched >= 3
    assert max(there.residuals()) < 1e-8


def test_an_equilibrium_of_the_reference_is_one_of_the_kernel(robot):
    scene = Scene([Sphere(center=(40, 18, 104), radius=15)])
    reference, kernel = SpatialReferenceSolver(robot, scene), SpatialSolver(robot, scene)
    there = reference.rest()
    for pull in np.arange(0.5, 6.1, 0.5):
        there = reference.step(there, (pull, 0.4 * pull))
    here = kernel.step(there, there.cables_mm + np.array([0.0, 0.1]))
    assert here.status is Status.CONVERGED
    assert here.points == pytest.approx(reference.step(there, there.cables_mm + np.array([0.0, 0.1])).points, abs=1e-6)


@pytest.mark.parametrize("s", [0.1, 10.0])
def test_a_robot_of_another_size_is_followed_alike(s):
    def end(s):
        robot = SpatialRobot(
            model="paper", length_mm=180 * s, segments=6, offset_mm=8 * s, rigidity=5e3 * s * s, between=3
        )
        solver = SpatialReferenceSolver(robot, Scene([Sphere(center=(40 * s, 18 * s, 104 * s), radius=15 * s)]))
        return solver.step(solver.rest(), (5.0 * s, 2.0 * s))

    here, there = end(1.0), end(s)
    assert here.status is there.status is Status.CONVERGED
    assert here.contact.any()
    assert there.points / s == pytest.approx(here.points, abs=1e-5)
    assert there.tensions == pytest.approx(here.tensions, abs=1e-6)


def test_derivatives_are_smooth_where_disks_are_parallel(robot):
    problem = node_problem(robot, (), ())
    slope = ca.Function(
        "slope", [problem.unknowns, problem.parameters], [ca.gradient(problem.objective, problem.unknowns)]
    )
    rest = SpatialReferenceSolver(robot, Scene()).rest()
    assert np.all(slope(*rest._node_point()).full() == 0)


def test_a_step_that_cannot_be_followed_fails(robot, walk):
    """Pulled head-on, the robot slips off the sphere, which is no branch."""
    solver = SpatialReferenceSolver(robot, Scene([Sphere(center=(44, 0, 104), radius=15)]))
    equilibrium = walk(solver, ((pull, 0.0) for pull in np.arange(0.5, 6.1, 0.5)))
    reached = solver.step(equilibrium, (11.0, 0.0))
    assert reached.status is Status.GAVE_UP
    assert np.all(reached.cables_mm == equilibrium.cables_mm)
