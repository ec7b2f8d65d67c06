"""A long random walk among random obstacles: nothing fails, nothing is penetrated, nothing is crossed."""

from collections import Counter
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from solver import Robot, Solver, Status
from solver.robot import CABLES, LINES

STEPS_PER_SCENE = 100


def walk(solver, pulls, insertions):
    shortest, longest = solver.robot.lengths_mm
    states, commands = [solver.rest()], []
    for pull, insertion in zip(pulls, insertions, strict=True):
        cable = min(max(states[-1].cable_mm + pull, 0.0), 14.0)
        commands.append((cable, min(max(states[-1].length_mm + insertion, shortest), longest)))
        states.append(solver.step(states[-1], *commands[-1]))
    return states, commands


@pytest.mark.parametrize("cable", CABLES)
@pytest.mark.parametrize("mix", ["circles", "shapes", "thin shapes"])
def test_random_walk(pytestconfig, cable, mix, random_scene, random_shapes, swept):
    thin = mix == "thin shapes"
    draw = random_scene if mix == "circles" else partial(random_shapes, thinnest=2 if thin else 6)
    generator, counts = np.random.default_rng(0), Counter()
    robot = replace(Robot.prototype(), cable=cable)
    if mix != "circles":
        robot = replace(robot, length_range_mm=(120, 180))
    if thin:
        robot = replace(robot, touch=LINES, between=3)
    for _ in range(pytestconfig.getoption("soak") // STEPS_PER_SCENE):
        scene = draw(generator)
        solver = Solver(robot, scene)
        pulls = generator.uniform(-0.5, 0.5, STEPS_PER_SCENE) + 0.14
        states, commands = walk(solver, pulls, generator.uniform(-2, 2, STEPS_PER_SCENE))
        counts.update(state.status.name for state in states[1:])
        snapped = np.array([state.status is Status.SNAPPED for state in states[1:]])
        crossed = swept(np.stack([state.nodes for state in states]), robot, scene).any(axis=1)
        assert not crossed[~snapped].any()
        for k in np.flatnonzero(snapped):
            assert not swept(solver.trace(states[k], *commands[k]).nodes, robot, scene).any()
        assert min(state.gaps.min() for state in states) >= -1e-6
        assert max(state.tension for state in states) <= robot.max_tension * (1 + 1e-6)
    print(dict(counts))
    assert "GAVE_UP" not in counts
