"""Obstacles on springs: balance of forces, and the limits of a stiff and of a soft spring."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Capsule, Circle, HalfPlane, Polygon, Robot, Scene, Solver, Status
from solver.common.robot import MODELS
from solver.planar.forces import force_true
from solver.planar.free import free_nodes

CIRCLE = Circle(center=(44, 104), radius=15)
EVERY_MODEL = pytest.mark.parametrize("model", MODELS)


def pulled(model, *obstacles, to=9.0):
    solver = Solver(replace(Robot.prototype(model="paper"), model=model), Scene(obstacles))
    equilibrium = solver.rest()
    for command in np.linspace(0, to, 37)[1:]:
        equilibrium = solver.step(equilibrium, command)
        assert equilibrium.status is Status.CONVERGED
    return equilibrium


@EVERY_MODEL
@pytest.mark.parametrize("spring", [0.05, 1.0, ((3.0, 0.9), (0.9, 0.4))])
def test_spring_carries_the_contact_force(model, spring):
    obstacle = replace(CIRCLE, spring=spring)
    equilibrium = pulled(model, obstacle)
    (force,), (displacement,) = force_true(equilibrium), equilibrium.displacements
    assert np.linalg.norm(force) > 0.01
    assert obstacle.spring_matrix @ displacement == pytest.approx(-force, abs=1e-10)


@EVERY_MODEL
def test_stiff_spring_is_a_fixed_obstacle(model):
    fixed, stiff = pulled(model, CIRCLE), pulled(model, replace(CIRCLE, spring=1e6))
    assert stiff.nodes == pytest.approx(fixed.nodes, abs=1e-4)
    assert force_true(stiff) == pytest.approx(force_true(fixed), rel=1e-4)


@EVERY_MODEL
def test_soft_spring_hardly_bends_the_robot(model):
    equilibrium = pulled(model, replace(CIRCLE, spring=1e-6))
    assert equilibrium.contact.any()
    assert equilibrium.nodes == pytest.approx(free_nodes(equilibrium.robot, 9.0), abs=0.02)


def test_softer_springs_give_more_and_push_less():
    states = [pulled("paper", replace(CIRCLE, spring=spring)) for spring in (10, 1, 0.1, 0.01)]
    assert np.all(np.diff([np.linalg.norm(state.displacements) for state in states]) > 0)
    assert np.all(np.diff([np.linalg.norm(force_true(state)) for state in states]) < 0)


def test_wall_moves_along_its_normal_only():
    wall = HalfPlane(point=(31, 127), normal=(-1, 0), nodes=(14,), spring=0.5)
    equilibrium = pulled("paper", wall)
    assert equilibrium.displacements[0, 0] > 0.1
    assert equilibrium.displacements[0, 1] == 0
    assert (
        equilibrium.nodes[14, 0]
        < equilibrium.cable_nodes[14, 0]
        == pytest.approx(31 + equilibrium.displacements[0, 0], abs=1e-9)
    )


def test_obstacles_where_they_have_been_pushed_to():
    equilibrium = pulled("paper", replace(CIRCLE, spring=0.2))
    (circle,), (displacement,) = equilibrium.scene_now, equilibrium.displacements
    assert circle.center == pytest.approx(CIRCLE.center + displacement)
    assert circle.gap(equilibrium.points) == pytest.approx(equilibrium.gaps[0], abs=1e-12)


def test_let_go_the_obstacle_returns_to_its_place():
    solver = Solver(Robot.prototype(model="paper"), Scene([replace(CIRCLE, spring=0.2)]))
    pushed = solver.step(solver.rest(), 8.0)
    assert pushed.displacements.any()
    assert np.array_equal(solver.step(pushed, 0.0).block, solver.rest().block)


@pytest.mark.parametrize(
    ("spring", "message"),
    [
        (0.0, "spring is 0.0; it must be positive and finite"),
        (np.inf, "spring is inf; it must be positive and finite"),
        (((1, 0.5), (0.4, 1)), "it must be finite, symmetric and positive definite"),
        (((1, 2), (2, 1)), "it must be finite, symmetric and positive definite"),
        ((1, 2, 3), "it must be a number or a matrix"),
        ("soft", "spring is 'soft'; it must be a number or a matrix"),
    ],
)
def test_bad_stiffness_is_refused(spring, message):
    with pytest.raises(ValueError, match=message):
        replace(CIRCLE, spring=spring)


def test_robot_rolls_past_an_obstacle_on_a_soft_spring():
    """The descent has to move obstacles fast whose springs are softer by far than the robot."""
    corners = (
        (29.708088486204776, 120.2044478660963),
        (37.38646048042019, 107.09659235269643),
        (49.169474735228846, 105.79827812957964),
        (59.31078724426851, 116.10881237589773),
        (58.52195553648005, 126.51373817466254),
        (47.07095814773226, 135.158460498289),
        (35.44403335476555, 132.0818382712314),
    )
    soft = Polygon(corners=corners, radius=7.50484287702009, spring=0.006021656561407207)
    stiff = Capsule(
        start=(66.92016589075972, 174.82340795085702),
        end=(42.95299442399343, 181.0803377917917),
        radius=12.62464431823938,
        spring=392.154624193634,
    )
    solver = Solver(Robot.prototype(touch=("backbone", "cable", "rim")), Scene([soft, stiff]))
    rolled = solver.step(solver.rest(), 8.186564456280223)
    assert rolled.status is Status.SNAPPED
    assert rolled.cable_mm == 8.186564456280223
    assert rolled.factorizations < 1500
