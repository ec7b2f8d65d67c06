"""Estimates of the contact force of robots with loads, several cables and unlike segments, against their own force."""

import math

import numpy as np
import pytest

from solver import Cable, Circle, Load, Robot, Scene, Solver, VirtualWork, contact_estimate, free_motion, shape_estimate
from solver.planar.forces import force_true

WEIGHT = 5000 / 180**3  # EI/L³
PAIR = (Cable(), Cable(angle=math.pi))
SECTIONS = (Cable(end=9), Cable(angle=math.pi, end=9), *PAIR)
CIRCLE = Scene([Circle(center=(44, 104), radius=15)])
LOADS = (Load(node=18, force=(-0.02, 0.05), at=(8.0, math.pi)), Load(node=7, force=(0.0, 0.0), moment=-20.0))
CASES = {
    "weight": ({"weight_per_length": (2 * WEIGHT, -WEIGHT)}, (7.0,)),
    "loads": ({"loads": LOADS}, (7.0,)),
    "precurved": ({"precurvature": -0.02}, (7.0,)),
    "unlike segments": ({"segment_rigidity": (4500.0,) * 9 + (5500.0,) * 9}, (8.0,)),
    "nearer cable": ({"cables": (Cable(offset_mm=4.0),)}, (4.0,)),
    "short cable": ({"cables": (Cable(end=12),)}, (5.5,)),
    "pair": ({"cables": PAIR}, (7.0, -8.0)),
    "pair the other way round": ({"cables": PAIR[::-1]}, (-8.0, 7.0)),
    "sections": ({"cables": SECTIONS, "weight_per_length": (WEIGHT, 0.0)}, (2.0, -4.0, 7.5, -10.0)),
}


def pulled(changes, pulls, scene=CIRCLE):
    solver = Solver(Robot.prototype(between=1, **changes), scene)
    now = solver.rest()
    for part in np.linspace(0, 1, 29)[1:]:
        now = solver.step(now, part * np.array(pulls))
    return now


@pytest.mark.parametrize("case", CASES)
def test_identity_gives_the_force_at_the_true_shape(case):
    state = pulled(*CASES[case])
    force = force_true(state)
    assert np.abs(force).max() > 0.02
    assert shape_estimate(state, state.nodes, state.tensions) == pytest.approx(force, abs=1e-8)


@pytest.mark.parametrize("case", CASES)
def test_contact_is_near_at_this_deflection(case):
    state = pulled(*CASES[case])
    assert contact_estimate(state, state.tensions) == pytest.approx(force_true(state), rel=0.1)


@pytest.mark.parametrize("case", CASES)
def test_the_free_robot_feels_nothing(case):
    """At its tensions nothing is left for a contact, and at more tension there is."""
    changes, pulls = CASES[case]
    free, touching = pulled(changes, pulls, Scene()), pulled(changes, pulls)
    assert contact_estimate(touching, free.tensions) == pytest.approx(0.0, abs=1e-6)
    assert np.abs(contact_estimate(touching, 1.2 * free.tensions)).max() > 0.01


def test_robots_that_bend_evenly_are_estimated_alike_by_the_closed_form():
    """A robot with a pair is solved, one with a single cable is not, and both are the same robot."""
    single, pair = pulled({}, (7.0,)), pulled({"cables": PAIR}, (7.0, -8.0))
    assert contact_estimate(pair, pair.tensions) == pytest.approx(contact_estimate(single, single.tension), rel=1e-6)


def test_closed_forms_refuse_other_robots():
    state = pulled(*CASES["weight"])
    with pytest.raises(ValueError, match="bends evenly; contact_estimate and shape_estimate take any robot"):
        VirtualWork().estimate(state)
    with pytest.raises(ValueError, match="bends evenly; contact_estimate and shape_estimate take any robot"):
        free_motion(state.robot, np.array(7.0), np.array(180.0))


@pytest.mark.parametrize("tension", [3.0, (1.0,), (1.0, math.nan), "a"])
def test_tensions_are_those_of_the_cables(tension):
    with pytest.raises(ValueError, match="tension is"):
        contact_estimate(pulled(*CASES["pair"]), tension)
