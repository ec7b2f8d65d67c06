"""The rod model against the elastica it discretises: a beam with a frictionless cable, pressed by a wall.

With the bending angle θ = −φ, the curvature κ = θ' and the wall's force (−N, 0) at arc length s_c, the beam obeys
EI κ = T a − N (y(s_c) − y) below s_c and EI κ = T a beyond; x(s_c) = d and a θ(L) = l fix T and N.
"""

import math
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from solver import HalfPlane, Robot, Scene, Solver, Status
from solver.planar.forces import force_true

LENGTH, OFFSET, RIGIDITY = 180.0, 8.0, 5000.0
COMMON = np.linspace(0, LENGTH, 10)  # where every refinement has a node
TOUCHING = 7
CONTACT = COMMON[TOUCHING]
REFINEMENTS = (9, 18, 36, 72)


class State(NamedTuple):
    """Poses (x, y, φ) at the common nodes, cable tension, and force of the wall on the robot."""

    poses: np.ndarray
    tension: float
    force: np.ndarray


def arc(pose, curvature, along):
    """Poses at arc lengths along a circle from a pose on, (k, 3)."""
    x, y, phi = pose
    turned = phi - curvature * along
    right, ahead = np.cos(phi) - np.cos(turned), np.sin(phi) - np.sin(turned)
    return np.column_stack([x + right / curvature, y + ahead / curvature, turned])


def free_rod(cable_mm):
    """The rod that nothing touches: one arc."""
    curvature = cable_mm / (OFFSET * LENGTH)
    return State(arc(np.zeros(3), curvature, COMMON), RIGIDITY * curvature / OFFSET, np.zeros(2))


def rod_at_wall(cable_mm, wall_mm):
    """The rod at a wall: up to the contact EI κ' = N cos θ with N unknown, an arc from there on."""

    def slopes(_, state, force):
        _, _, phi, curvature = state
        return np.stack([-np.sin(phi), np.cos(phi), -curvature, force[0] / RIGIDITY * np.cos(phi)])

    def mismatch(base, contact, _):
        tip = contact[2] - contact[3] * (LENGTH - CONTACT)
        return np.array([*base[:3], contact[0] - wall_mm, OFFSET * tip + cable_mm])

    mesh = np.linspace(0, CONTACT, 50)
    straight = np.stack([0 * mesh, mesh, 0 * mesh, 0 * mesh])
    rod = solve_bvp(slopes, mismatch, mesh, straight, p=[0.0], tol=1e-10, max_nodes=10_000)
    assert rod.success, rod.message
    *pose, curvature = rod.y[:, -1]
    poses = [rod.sol(COMMON[:TOUCHING])[:3].T, arc(pose, curvature, COMMON[TOUCHING:] - CONTACT)]
    return State(np.concatenate(poses), RIGIDITY * curvature / OFFSET, np.array([-rod.p[0], 0.0]))


def pulled(segments, cable_mm, *walls_mm):
    """The solver's robot, pulled in increments towards walls that only the node at the contact meets."""
    robot = Robot(
        length_mm=LENGTH,
        segments=segments,
        offset_mm=OFFSET,
        rigidity=RIGIDITY,
        max_tension=math.inf,
        model="rod",
        touch=("backbone",),
    )
    every = segments // 9
    walls = [HalfPlane(point=(wall, 0.0), normal=(-1.0, 0.0), nodes=(TOUCHING * every,)) for wall in walls_mm]
    solver = Solver(robot, Scene(walls))
    equilibrium = solver.rest()
    for command in [*np.arange(0.5, cable_mm, 0.5), cable_mm]:
        equilibrium = solver.step(equilibrium, command)
        assert equilibrium.status is Status.CONVERGED
    return State(equilibrium.nodes[::every], equilibrium.tension, force_true(equilibrium).sum(axis=0))


def errors(state, rod):
    """Largest error of position and of angle, error of tension and of force [mm, rad, N, N]."""
    poses, tension, force = (np.abs(value - exact) for value, exact in zip(state, rod, strict=True))
    return np.array([np.hypot(poses[:, 0], poses[:, 1]).max(), poses[:, 2].max(), tension, np.hypot(*force)])


def assert_second_order(table):
    """Twice the segments, a quarter of every error."""
    assert np.all((table[:-1] > 3.5 * table[1:]) & (table[:-1] < 4.5 * table[1:])), table


def test_free_robot_tends_to_the_arc():
    rod = free_rod(7.0)
    table = np.array([errors(pulled(segments, 7.0), rod) for segments in REFINEMENTS])
    assert_second_order(table[:, :3])  # the force is zero on both sides


def test_robot_at_a_wall_tends_to_the_elastica():
    rod = rod_at_wall(7.0, 31.0)
    table = np.array([errors(pulled(segments, 7.0, 31.0), rod) for segments in REFINEMENTS])
    assert_second_order(table)


@pytest.mark.parametrize("state", [lambda: rod_at_wall(0.1, 1e-4), lambda: pulled(72, 0.1, 1e-4)], ids=["rod", "robot"])
def test_small_deflection_divides_force_and_tension_as_a_propped_beam(state):
    """N / T = 3a / 2s_c for a wall that holds the contact where it is."""
    _, tension, (force, across) = state()
    assert -force / tension == pytest.approx(1.5 * OFFSET / CONTACT, rel=2e-4)
    assert across == pytest.approx(0.0, abs=1e-12)
