"""A long random walk among random obstacles: nothing fails, nothing is penetrated, nothing is crossed."""

from collections import Counter
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from solver import Robot, Solver, Status
from solver.robot import LINES

STEPS_PER_SCENE = 100


def walk(solver, changes):
    states, commands = [solver.rest()], []
    for change in changes:
        commands.append(min(max(states[-1].cable_mm + change, 0.0), 14.0))
        states.append(solver.step(states[-1], commands[-1]))
    return states, commands


@pytest.mark.parametrize("mix", ["circles", "shapes", "thin shapes"])
def test_random_walk(pytestconfig, mix, random_scene, random_shapes, swept):
    thin = mix == "thin shapes"
    draw = random_scene if mix == "circles" else partial(random_shapes, thinnest=2 if thin else 6)
    generator, counts = np.random.default_rng(0), Counter()
    robot = replace(Robot.prototype(), touch=LINES, between=3) if thin else Robot.prototype()
    for _ in range(pytestconfig.getoption("soak") // STEPS_PER_SCENE):
        scene = draw(generator)
        solver = Solver(robot, scene)
        states, commands = walk(solver, generator.uniform(-0.5, 0.5, STEPS_PER_SCENE) + 0.14)
        counts.update(state.status.name for state in states[1:])
        snapped = np.array([state.status is Status.SNAPPED for state in states[1:]])
        crossed = swept(np.stack([state.nodes for state in states]), robot, scene).any(axis=1)
        assert not crossed[~snapped].any()
        for k in np.flatnonzero(snapped):
            assert not swept(solver.trace(states[k], commands[k]), robot, scene).any()
        assert min(state.gaps.min() for state in states) >= -1e-6
        assert max(state.tension for state in states) <= robot.max_tension * (1 + 1e-6)
    print(dict(counts))
    assert "FAILED" not in counts
