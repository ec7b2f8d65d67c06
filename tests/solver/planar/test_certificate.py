"""Every equilibrium is a KKT point of eq. 5, and the one the reference solver finds."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver import Circle, ReferenceSolver, Robot, Scene, Solver, Status
from solver.common.robot import MODELS
from solver.planar.formulation import GAP_LAWS
from solver.planar.robot import LINES

obstacles = st.builds(
    lambda x, y, radius, spring: Circle(center=(x, y), radius=radius, spring=spring),
    st.floats(35, 75),
    st.floats(75, 150),
    st.floats(10, 16),
    st.none() | st.floats(0.01, 30),
)
scenes = st.lists(obstacles, min_size=1, max_size=3).map(Scene)
increments = st.lists(st.tuples(st.floats(-0.2, 0.5), st.floats(-1, 1)), min_size=10, max_size=60)
EVERY_MODEL = pytest.mark.parametrize("model", MODELS)
SHORTEST, LONGEST = 120.0, 180.0


def follow(solver, changes):
    equilibrium = solver.rest()
    for change, insertion in changes:
        cable = min(max(equilibrium.cable_mm + change, 0.0), 14.0)
        length = min(max(equilibrium.length_mm + insertion, SHORTEST), LONGEST)
        equilibrium = solver.step(equilibrium, cable, length)
        yield equilibrium


@EVERY_MODEL
@settings(max_examples=40)
@given(scene=scenes, start=st.floats(1, 8), changes=increments)
def test_residuals(model, scene, start, changes):
    robot = replace(Robot.prototype(model="paper"), model=model, length_range_mm=(SHORTEST, LONGEST))
    certify(follow(Solver(robot, scene), [(start, 0.0), *changes]))


@EVERY_MODEL
@pytest.mark.parametrize(
    ("touch", "scenes"),
    [({"segments": 9, "between": 1}, (24, 60)), ({"segments": 6, "touch": LINES, "between": 3}, (20, 60))],
    ids=["paper", "everywhere"],
)
def test_residuals_of_every_shape(random_shapes, many, model, touch, scenes):
    robot, generator = replace(Robot.prototype(model="paper"), model=model, **touch), np.random.default_rng(3)
    touched, springs = set(), 0
    for _ in range(many(*scenes)):
        scene = random_shapes(generator, robot)
        springs += any(scene.mounted)
        changes = generator.uniform(-0.2, 0.6, 40)
        states = list(follow(Solver(robot, scene), np.column_stack([changes, np.zeros(40)])))
        certify(states[::3])
        touched |= {scene.laws[j] for state in states for j in state.contact.any(axis=(1, 2)).nonzero()[0]}
    assert touched > set(GAP_LAWS)  # and a custom shape
    assert springs > 10


def certify(equilibria):
    for equilibrium in equilibria:
        residuals = equilibrium.residuals()
        assert equilibrium.status is not Status.GAVE_UP
        assert residuals.stationarity <= 1e-8
        assert residuals.lengths <= 1e-9
        assert equilibrium.gaps.min() >= -1e-8
        assert residuals.gaps <= 1e-8
        assert residuals.sign == 0
        assert residuals.complementarity <= 1e-10


@EVERY_MODEL
@settings(max_examples=4)
@given(scene=scenes, changes=st.lists(st.tuples(st.floats(0.1, 0.5), st.floats(-1, 1)), min_size=24, max_size=40))
def test_reference_solver(model, scene, changes):
    robot = replace(
        Robot.prototype(model="paper", max_tension=math.inf), model=model, length_range_mm=(SHORTEST, LONGEST)
    )
    solver, reference = Solver(robot, scene), ReferenceSolver(robot, scene)
    before = solver.step(solver.rest(), 1.0, 175.0)
    asked, answered = 0, 0
    for change, insertion in changes:
        length = min(before.length_mm + insertion, LONGEST)
        after = solver.step(before, min(before.cable_mm + change, 14.0), length)
        if after.status is Status.CONVERGED:
            same = reference.step(before, after.cable_mm, length)
            asked += 1
            if same.status is Status.CONVERGED:
                answered += 1
                compare(after, same)
        before = after
    assert answered >= 0.9 * asked  # IPOPT gives up now and then; what it answers must agree


def compare(ours, theirs):
    np.testing.assert_allclose(ours.nodes, theirs.nodes, rtol=0, atol=1e-6)
    np.testing.assert_allclose(ours.displacements, theirs.displacements, rtol=0, atol=1e-6)
    ours_sum, theirs_sum = ours.multipliers.sum(axis=(1, 2)), theirs.multipliers.sum(axis=(1, 2))
    np.testing.assert_allclose(ours_sum, theirs_sum, rtol=1e-5, atol=1e-11)
    np.testing.assert_allclose(ours.tension, theirs.tension, rtol=1e-8, atol=1e-8)
