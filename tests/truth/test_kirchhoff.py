"""The rod in space against closed forms, the planar elastica, and the numbers of another program."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from truth import elastica
from truth.kirchhoff import Cable, Load, Rod
from truth.segments import segment

DATA = Path(__file__).parents[1] / "data" / "rod"
LENGTH, OFFSET, RIGIDITY, RATIO = 180.0, 8.0, 5000.0, 0.75
FOUR = ((0.0, 0.0), *((OFFSET, k * math.pi / 2) for k in range(4)))
SPHERE = ((40.0, 6.0, 104.0), 15.0)


def cables(*degrees):
    return tuple(Cable(OFFSET, math.radians(angle), LENGTH) for angle in degrees)


PROTOTYPE = Rod(length=LENGTH, rigidity=RIGIDITY, torsion_ratio=RATIO, cables=cables(0, 90), elements=18)
AT_SPHERE = replace(PROTOTYPE, stations=18, touch=FOUR, spheres=(SPHERE,))


@pytest.mark.parametrize(
    ("pulls", "tensions"), [((5, 0), (2.894, 1.447)), ((8, 3), (5.498, 4.051)), ((5, 5), (4.340, 4.340))]
)
def test_cables_at_120_degrees(pulls, tensions):
    """Free, the rod is an arc: κ·e = l / aL towards every taut cable, and EI κ = Σ T a e."""
    found = replace(PROTOTYPE, elements=6, cables=cables(0, 120)).pulled(*pulls, steps=2)
    assert found.tensions == pytest.approx(tensions, abs=5e-4)
    between = np.array([[1, -0.5], [-0.5, 1]])
    exact = np.linalg.solve(between, pulls) * RIGIDITY / (OFFSET**2 * LENGTH)
    assert found.tensions == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize(("pull", "normal", "vector"), [(5, 0.0369, 0.0369), (6, 0.1058, 0.1033), (7, 0.1558, 0.1417)])
def test_sphere_beside_the_prototype(pull, normal, vector):
    """Forces of a program that shares nothing with this one, for 18 segments: up to 3 % from the limit here."""
    found = AT_SPHERE.pulled(pull, 0.0, steps=2 * pull)
    assert found.pushes.sum() == pytest.approx(normal, rel=0.03)
    assert np.linalg.norm(found.forces) == pytest.approx(vector, rel=0.03)


def test_converges_as_the_fourth_power():
    rods = [replace(AT_SPHERE, stations=9, elements=9 * k) for k in (1, 2, 4)]
    found = [(s.tensions, s.forces.ravel(), s.places[-1]) for s in (rod.pulled(6.0, 0.0) for rod in rods)]
    for coarse, middle, fine in zip(*found, strict=True):
        assert np.abs(middle - fine).max() < 2 ** (-3.5) * np.abs(coarse - fine).max()
        assert fine == pytest.approx(middle, rel=1e-6, abs=1e-8)


def test_turns_about_the_base_axis():
    angle = 0.6
    cosine, sine = math.cos(angle), math.sin(angle)
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    turned = replace(
        AT_SPHERE,
        cables=tuple(cable._replace(angle=cable.angle + angle) for cable in AT_SPHERE.cables),
        touch=tuple((offset, at + angle) for offset, at in FOUR),
        spheres=((tuple(turn @ SPHERE[0]), SPHERE[1]),),
    )
    first, second = (rod.pulled(6.0, 1.0) for rod in (AT_SPHERE, turned))
    assert second.places == pytest.approx(first.places @ turn.T, abs=1e-6)
    assert second.tensions == pytest.approx(first.tensions, abs=1e-7)
    assert second.forces == pytest.approx(first.forces @ turn.T, abs=1e-7)


def test_forces_are_slopes_of_the_energy():
    """Tension is dE/dl, and the force of the sphere −dE/d(centre)."""

    def energy(pull, *shift):
        center = tuple(np.add(SPHERE[0], shift or 0.0))
        return replace(rod, spheres=((center, SPHERE[1]),)).pulled(pull, 0.5, steps=5).energy

    rod, step = replace(AT_SPHERE, stations=9, elements=9), 1e-2
    found = rod.pulled(6.0, 0.5)
    assert found.tensions[0] == pytest.approx((energy(6 + step) - energy(6 - step)) / (2 * step), rel=1e-4)
    slopes = [(energy(6.0, *(step * e)) - energy(6.0, *(-step * e))) / (2 * step) for e in np.eye(3)]
    assert found.forces[0] == pytest.approx(slopes, rel=1e-3, abs=1e-5)


def test_quarter_circle_gives_way_out_of_its_plane():
    """Castigliano: δ = P R³ ((π/4)/EI + (3π/4 − 2)/GJ) for a rod precurved by 90°."""
    radius, load = 2 * LENGTH / math.pi, 1e-5 * RIGIDITY / LENGTH**2
    bent = replace(PROTOTYPE, cables=(), elements=36, precurvature=(0.0, 1 / radius, 0.0))
    tip = replace(bent, loads=(Load(LENGTH, (0.0, load, 0.0)),)).follow([()]).places[-1]
    flexibility = math.pi / 4 + (3 * math.pi / 4 - 2) / RATIO
    assert tip[1] == pytest.approx(load * radius**3 * flexibility / RIGIDITY, rel=1e-4)
    assert tip[::2] == pytest.approx([radius, radius], rel=1e-5)


def test_in_its_plane_it_is_the_elastica():
    """A pulled cable, weight, a tip force, and a disk against a ball or circle."""
    weight, force = 4e-4, (-0.03, 0.02)
    wall, ball = elastica.wall((31.0, 0.0), (-1.0, 0.0)), elastica.circle((45.0, 130.0), 14.0)
    beam = elastica.Beam(
        length=LENGTH,
        rigidity=RIGIDITY,
        cables=(elastica.Cable(OFFSET, LENGTH, 7.0),),
        contacts=(elastica.Contact(wall, OFFSET, 140.0),),
        loads=(elastica.Load(LENGTH, force),),
        weight=(weight, -weight),
    )
    near = elastica.solve(beam).unknowns
    exact = elastica.solve(replace(beam, contacts=(elastica.Contact(ball, OFFSET, 140.0),)), near)
    rod = replace(
        PROTOTYPE,
        elements=36,
        stations=9,
        cables=cables(0),
        touch=((OFFSET, 0.0),),
        spheres=(((45.0, 0.0, 130.0), 14.0),),
        loads=(Load(LENGTH, (force[0], 0.0, force[1])),),
        weight=(weight, 0.0, -weight),
    )
    found = rod.pulled(7.0)
    assert np.flatnonzero(found.pushes > 1e-6).tolist() == [6]
    assert found.tensions == pytest.approx(exact.tensions, rel=1e-6)
    assert found.forces[0, ::2] == pytest.approx(exact.forces[0], abs=1e-6)
    assert found.places[:, ::2] == pytest.approx(exact.poses(np.linspace(0, LENGTH, 37))[:, :2], abs=1e-5)
    assert found.places[:, 1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("name", ["e08", "f04"])
def test_segments_are_those_of_the_recorded_states(name):
    """IPOPT finds the states of tests/data/rod with the law of its segments in the place of the rod's elements."""
    recorded = json.loads((DATA / f"{name}.json").read_text())
    spec, state = recorded["spec"], recorded["states"][-1]
    spheres = tuple((tuple(sphere["center"]), sphere["radius"]) for sphere in spec["obstacles"])
    rod = replace(
        PROTOTYPE,
        torsion_ratio=spec["GJ"][0] / spec["EI"][0],
        cables=tuple(Cable(cable["offset"], cable["angle"], LENGTH) for cable in spec["cables"]),
        stations=18,
        touch=tuple((point["offset"], point["angle"]) for point in spec["touch"]),
        spheres=spheres,
        law=segment,
    )
    found = rod.pulled(*spec["path"][0], steps=32)
    assert found.places == pytest.approx(np.array(state["positions"]), abs=1e-6)
    assert found.frames == pytest.approx(np.array(state["rotations"]), abs=1e-8)
    assert found.tensions == pytest.approx(state["tensions"], abs=1e-7)
    assert found.forces == pytest.approx(np.array(state["obstacle_forces"]), abs=1e-7)
