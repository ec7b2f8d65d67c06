"""The rod against the elastica of an independent program (tests/truth/elastica.py), to which it must tend as 1/n²."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from truth import robots
from truth.elastica import Beam, Cable, Contact, Load, circle, solve, wall

LENGTH, OFFSET, RIGIDITY = 180.0, 8.0, 5000.0
COMMON = np.linspace(0, LENGTH, 10)  # where every refinement has a node
CELL = 140.0  # arc length of the node that meets the load cell, index 14 of 18
REFINEMENTS = (18, 36, 72, 144)
BEAM = {"length": LENGTH, "rigidity": RIGIDITY}
GRAM = 9.80665e-3  # [N]
UNIT = RIGIDITY / LENGTH**2  # of force [N]


def beam(pull, *contacts, **further):
    """The prototype as a beam."""
    return Beam(**BEAM, cables=(Cable(OFFSET, LENGTH, pull),) if pull else (), contacts=contacts, **further)


def errors(equilibrium, exact):
    """Largest error of a place, of an angle, of a tension and of a force [mm, rad, N, N]."""
    found, poses = robots.read(equilibrium), exact.poses(COMMON)
    every = (len(found.places) - 1) // (len(COMMON) - 1)
    missed = (
        np.hypot(*(found.places[::every] - poses[:, :2]).T).max(),
        np.abs(found.frames[::every] - poses[:, 2]).max(),
    )
    taut = found.tensions[: len(exact.tensions)]
    missed += (np.abs(taut - exact.tensions).max(initial=0),)
    return np.array([*missed, np.abs(found.forces - exact.forces.reshape(found.forces.shape)).max(initial=0)])


def assert_second_order(table):
    """Twice the segments, a quarter of every error that is there."""
    table = np.array(table)
    table = table[:, table[0] > 0]
    ratios = table[:-1] / table[1:]
    assert np.all((ratios > 3.6) & (ratios < 4.4)), ratios


def converges(make_spec, exact, *pulls):
    """Assert that robots of ever more segments tend to a beam as 1/n²."""
    robots.require(make_spec(REFINEMENTS[0]))
    assert_second_order([errors(robots.pulled(make_spec(n), *pulls, steps=30), exact) for n in REFINEMENTS])


def cell(distance, line=OFFSET):
    """The paper's load cell as a contact of the beam."""
    return Contact(wall((distance, 127.0), (-1.0, 0.0)), line, CELL)


def at_cell(n, distance, offset=OFFSET):
    """The prototype at the load cell, which only the point at one disk touches."""
    obstacle = {"kind": "wall", "normal": [-1.0, 0.0], "offset": -distance, "nodes": (round(n * CELL / LENGTH),)}
    return robots.plane(n, obstacles=[obstacle], touch=[{"offset": offset, "angle": 0.0}])


def test_free_robot_tends_to_the_arc():
    converges(robots.plane, solve(beam(7.0)), 7.0)


@pytest.mark.parametrize("line", [0.0, OFFSET], ids=["backbone", "cable"])
def test_robot_at_a_wall_tends_to_the_elastica(line):
    converges(lambda n: at_cell(n, 31.0, line), solve(beam(7.0, cell(31.0, line))), 7.0)


def test_robot_at_a_circle_tends_to_the_elastica():
    """The circle of Fig. 4a, shifted to where it touches at a node of every refinement.

    Other nodes are free to touch it and do not.
    """

    def touched(height):
        return solve(beam(8.0, Contact(circle((44.0, height), 15.0), OFFSET, 120.0, free=True)))

    height = brentq(lambda y: touched(y).places[0] - 120, 103.5, 105.0, xtol=1e-10)
    obstacle = {"kind": "circle", "center": [44.0, height], "radius": 15.0}
    converges(lambda n: robots.plane(n, obstacles=[obstacle]), touched(height), 8.0)


def test_force_of_disks_between_which_the_circle_touches():
    """Disks that touch beside the true place of contact make an error of the first order, ± half a segment at most."""
    exact = solve(beam(8.0, Contact(circle((44.0, 104.0), 15.0), OFFSET, 120.0, free=True)))
    obstacle = {"kind": "circle", "center": [44.0, 104.0], "radius": 15.0}
    for n in REFINEMENTS:
        (force,) = robots.read(robots.pulled(robots.plane(n, obstacles=[obstacle]), 8.0)).forces
        assert math.hypot(*force) == pytest.approx(math.hypot(*exact.forces[0]), rel=0.75 / n)


@pytest.mark.parametrize("distance", [24.0, 31.0, 36.0, 51.0])
def test_load_cell_of_the_paper(distance):
    """At a load P on the cable beyond its tension at the onset, as Table 1 has it, the force is right to 0.7 %."""
    curvature = brentq(lambda k: (1 - math.cos(k * CELL)) / k + OFFSET * math.cos(k * CELL) - distance, 1e-6, 0.02)
    onset, pull = RIGIDITY * curvature / OFFSET, OFFSET * curvature * LENGTH
    compared = 0
    for equilibrium in robots.follow(at_cell(18, distance), [np.array([p]) for p in np.linspace(0.2, pull + 4, 40)]):
        load = equilibrium.tension - equilibrium.onset_tension
        if not (equilibrium.contact.any() and 50 * GRAM < load < 350 * GRAM):
            continue
        tip_moment = Load(LENGTH, (0.0, 0.0), -OFFSET * (onset + load))
        exact = solve(beam(0.0, cell(distance), loads=(tip_moment,)))
        assert -equilibrium.forces[0, 0] == pytest.approx(-exact.forces[0, 0], rel=0.007)
        compared += 1
    assert compared >= 10


@pytest.mark.parametrize(
    "found",
    [
        lambda: (lambda beam: (beam.tensions, beam.forces))(solve(beam(0.1, cell(1e-4, 0.0)))),
        lambda: robots.read(robots.pulled(at_cell(72, 1e-4, 0.0), 0.1))[2:],
    ],
    ids=["beam", "robot"],
)
def test_small_deflection_divides_force_and_tension_as_a_propped_beam(found):
    """N / T = 3a / 2s_c for a wall that holds the contact where it is."""
    (tension,), ((force, across),) = found()
    assert -force / tension == pytest.approx(1.5 * OFFSET / CELL, rel=2e-4)
    assert across == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("size", [0.1, 2.0], ids=["small", "large"])
def test_cantilever_under_its_own_weight(size):
    """The cable, on the side it bends to, is slack; a small weight makes the tip sag by w L⁴ / 8EI."""
    weight = (size * RIGIDITY / LENGTH**3, 0.0)
    exact = solve(beam(0.0, weight=weight))
    if size < 1:
        assert exact.poses(LENGTH)[0, 0] == pytest.approx(weight[0] * LENGTH**4 / (8 * RIGIDITY), rel=1e-3)
    converges(lambda n: robots.plane(n, weight_per_length=weight), exact, 0.0)


def test_pulled_robot_that_stands_up_and_hangs():
    for along in (-8e-4, 8e-4):
        weight = (0.0, along)
        converges(lambda n, w=weight: robots.plane(n, weight_per_length=w), solve(beam(7.0, weight=weight)), 7.0)


def test_loads_at_the_tip_and_at_a_disk():
    """A transverse force of 2 EI/L² at the tip, and forces and moments at the tip and at two thirds."""
    across = (Load(LENGTH, (2 * UNIT, 0.0)),)
    several = (Load(LENGTH, (0.03, 0.02), -2.0), Load(120.0, (-0.1, 0.0), 3.0))
    for loads, pull in ((across, 0.0), (several, 8.0)):
        exact = solve(beam(pull, loads=loads))
        converges(lambda n, loads=loads: robots.plane(n, loads=[_described(load, n) for load in loads]), exact, pull)


def _described(load, n):
    return {"node": round(n * load.at / LENGTH), "force": list(load.force), "moment": load.moment}


@pytest.mark.parametrize("opposing", [False, True])
def test_two_sections_tend_to_two_arcs(opposing):
    """Closed form: θ = pull / a at both ends, each section an arc, T₂ a₂ = M₂ and T₁ a₁ = M₁ − M₂."""
    half, (first, second) = LENGTH / 2, (4.0, 4.0) if opposing else (6.0, 5.0)
    offset = -6.0 if opposing else 6.0
    exact = solve(Beam(**BEAM, cables=(Cable(OFFSET, half, first), Cable(offset, LENGTH, second))))
    moments = np.diff([0.0, first / OFFSET, second / offset]) * RIGIDITY / half
    assert exact.tensions == pytest.approx([(moments[0] - moments[1]) / OFFSET, moments[1] / offset], rel=1e-10)

    def sections(n):
        angle = math.pi if opposing else 0.0
        ends = [{"offset": OFFSET, "angle": 0.0, "end": n // 2}, {"offset": abs(offset), "angle": angle, "end": n}]
        return robots.plane(n, cables=ends)

    converges(sections, exact, first, second)
