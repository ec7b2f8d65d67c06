"""A long random walk in space: nothing fails, nothing is penetrated, nothing is crossed."""

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from solver import Status

STEPS_PER_SCENE = 200


def deepest(solver, nodes_before, nodes_after):
    """Deepest place of the straight ways of all nodes, in each obstacle that stands still [mm]."""
    ways = np.linspace(nodes_before, nodes_after, 9)
    depths = [-obstacle.gap(ways).min() for obstacle in solver.scene if obstacle.stiffness is None]
    return max(depths, default=0.0)


@pytest.mark.parametrize("mix", ["spheres", "shapes"])
def test_random_walk(pytestconfig, robot, mix, random_sphere, random_shape, random_solver, random_walk):
    generator, counts, touched = np.random.default_rng(0), Counter(), 0
    draw = random_sphere if mix == "spheres" else random_shape
    robot = robot if mix == "spheres" else replace(robot, touch=("backbone", "holes", "rim"), rim_points=8)
    for _ in range(max(1, pytestconfig.getoption("soak") // STEPS_PER_SCENE)):
        solver = random_solver(generator, robot, draw)
        states = random_walk(generator, solver, STEPS_PER_SCENE)
        counts.update(state.status.name for state in states[1:])
        touched += sum(state.contact.any() for state in states)
        for before, after in pairwise(states):
            assert after.gaps.min() >= -1e-6
            assert after.tensions.max() <= robot.max_tension * (1 + 1e-6)
            assert after.displacements[[o.stiffness is None for o in solver.scene]].any() == 0
            way = [before.nodes, after.nodes]
            if after.status is Status.SNAPPED:
                way = list(solver.trace(before, np.clip(after.cables_mm, -12, 12)).nodes)
                way = [before.nodes, *way] if np.allclose(way[-1], after.nodes, atol=1e-6) else []
            # A way of 8.5 mm is the longest that is taken at once; a sphere of 10 mm is cut 0.9 mm deep by it at most.
            assert all(deepest(solver, *pair) < 1.5 for pair in pairwise(way))
    print(dict(counts), touched)
    assert "GAVE_UP" not in counts
    assert touched > 0
