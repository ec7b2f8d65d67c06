"""SLSQP on eq. 5, an optimiser that shares nothing with the solver."""

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from agents.paper import eq_5, published
from agents.paper.model import ROBOT, pull
from solver import Solver


@pytest.fixture(scope="module")
def start():
    return pull(published.FIG_4B, 4.8)


@pytest.mark.parametrize(
    ("function", "slopes"),
    [
        (eq_5.objective, eq_5.gradient),
        (eq_5.equalities, eq_5.equality_slopes),
        (eq_5.inequalities, eq_5.inequality_slopes),
    ],
)
def test_derivatives(start, function, slopes):
    problem = eq_5.problem_of(start, 5.0)
    point = eq_5.node_points(start).ravel() / eq_5.UNIT_MM + np.random.default_rng(0).normal(0, 0.01, 72)
    differences = approx_fprime(point, lambda z: function(z, problem), 1e-7)
    assert slopes(point, problem) == pytest.approx(differences, abs=1e-5)


def test_optimiser_finds_the_equilibrium(start):
    goal = start.cable_mm + 0.25
    exact = Solver(ROBOT, start.scene).step(start, goal)
    solution = eq_5.solve(start, goal, with_gradient=True, with_slopes=True)
    assert solution.success
    assert solution.points == pytest.approx(eq_5.node_points(exact), abs=5e-3)
    assert solution.objective == pytest.approx(exact.objective, rel=1e-8)
