"""States of an independent prototype (tests/data), among them the paper's Fig. 4 and 5."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from solver import Equilibrium, Robot, Solver, Status

SCENES = json.loads((Path(__file__).parents[2] / "data" / "planar_uniform.json").read_text())
SCENES = {name: scene for name, scene in SCENES.items() if isinstance(scene, dict) and "states" in scene}
POINTS = ["backbone", "cable"]


@pytest.fixture(scope="module", params=SCENES)
def branch(request):
    """Every recorded state with the equilibrium found there."""
    from solver import Circle, Scene

    recorded = SCENES[request.param]
    scene = Scene(Circle(center=(x, y), radius=r) for x, y, r in recorded["circles"])
    solver = Solver(Robot.prototype(model="paper", max_tension=math.inf), scene)
    step = 0.25 if request.param == "free" else 0.05
    wanted = {state["cable_mm"]: state for state in recorded["states"]}
    found: list[tuple[dict, Equilibrium]] = []
    equilibrium = solver.rest()
    for k in range(1, round(max(wanted) / step) + 1):
        equilibrium = solver.step(equilibrium, round(step * k, 9))
        assert equilibrium.status is Status.CONVERGED
        if equilibrium.cable_mm in wanted:
            found.append((wanted[equilibrium.cable_mm], equilibrium))
    assert len(found) == len(wanted)
    return found


def test_shapes(branch):
    for state, equilibrium in branch:
        np.testing.assert_allclose(equilibrium.nodes[-1, :2], state["tip_mm"], rtol=0, atol=1e-6)
        np.testing.assert_allclose(equilibrium.nodes[-1, 2], state["tip_angle_rad"], rtol=0, atol=1e-8)
        np.testing.assert_allclose(equilibrium.shear, state["shear_rad"], rtol=0, atol=1e-8)
        assert equilibrium.objective == pytest.approx(state["objective_rad2"], rel=1e-8)


def test_contacts(branch):
    for state, equilibrium in branch:
        recorded = {(c["obstacle"], POINTS.index(c["point"]), c["node"]): c["multiplier"] for c in state["contacts"]}
        assert {tuple(map(int, c)) for c in np.argwhere(equilibrium.contact)} == set(recorded)
        for contact, multiplier in recorded.items():
            assert equilibrium.multipliers[contact] == pytest.approx(multiplier, rel=1e-6)


def test_nodes_of_figure_5(circles, pulls):
    """The multiplier peaks of Fig. 5, at nodes 11 and 17 as the paper counts."""
    scene = circles(*SCENES["two_obstacles_fig4b"]["circles"])
    solver = Solver(Robot.prototype(model="paper", max_tension=math.inf), scene)
    equilibrium = solver.rest()
    for cable in pulls(5.0, 0.05):
        equilibrium = solver.step(equilibrium, cable)
    assert np.argwhere(equilibrium.contact).tolist() == [[0, 1, 10], [1, 1, 16]]
