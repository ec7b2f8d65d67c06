"""The rod in space against the Kirchhoff rod of an independent program (tests/truth/kirchhoff.py)."""

import math
from dataclasses import replace

import numpy as np
import pytest
from truth import robots
from truth.kirchhoff import Cable, Load, Rod

LENGTH, OFFSET, RIGIDITY, RATIO = 180.0, 8.0, 5000.0, 0.75
COMMON = 18  # stations, where every refinement has a node
REFINEMENTS = (18, 36, 72, 144)
POINTS = ((0.0, 0.0), *((OFFSET, k * math.pi / 2) for k in range(4)))
RIGHT_ANGLE, THIRDS = (0.0, math.pi / 2), (0.0, 2 * math.pi / 3, 4 * math.pi / 3)
SPHERE = ((40.0, 6.0, 104.0), 15.0)
FORCE, TENSION = RIGIDITY / LENGTH**2, RIGIDITY / (OFFSET * LENGTH)  # natural units [N]


def rod(*angles, **further):
    """The prototype as a rod."""
    cables = tuple(Cable(OFFSET, angle, LENGTH) for angle in angles)
    further = {"touch": POINTS, "stations": COMMON, "torsion_ratio": RATIO, "elements": COMMON, **further}
    return Rod(length=LENGTH, rigidity=RIGIDITY, cables=cables, **further)


def balls(n, *spheres):
    """Spheres that robots of every n touch at the common stations only."""
    nodes = tuple(range(n // COMMON, n + 1, n // COMMON))
    return [{"kind": "sphere", "center": list(c), "radius": r, "nodes": nodes} for c, r in spheres]


def errors(equilibrium, exact):
    """Largest error of a place, a frame, a tension and a force, in natural units."""
    found = robots.read(equilibrium)
    coarse, fine = (len(places) // COMMON for places in (found.places, exact.places))
    return np.array(
        [
            np.abs(found.places[::coarse] - exact.places[::fine]).max() / LENGTH,
            np.abs(found.frames[::coarse] - exact.frames[::fine]).max(),
            np.abs(found.tensions - exact.tensions).max(initial=0) / TENSION,
            np.abs(found.forces - exact.forces).max(initial=0) / FORCE,
        ]
    )


def converges(make_spec, exact, *pulls, steps=20, refinements=REFINEMENTS[:3]):
    """Assert that robots of ever more segments tend to a rod as 1/n²."""
    robots.require(make_spec(COMMON))
    table = np.array([errors(robots.pulled(make_spec(n), *pulls, steps=steps), exact) for n in refinements])
    table = table[:, table[0] > 1e-9]
    ratios = table[:-1] / table[1:]
    assert np.all((ratios > 3.6) & (ratios < 4.4)), ratios


@pytest.mark.parametrize(
    ("pulls", "coarse", "limit"),
    [
        ((5.0, 0.0), (2.863, 1.426), (2.894, 1.447)),
        ((8.0, 3.0), (5.378, 3.953), (5.498, 4.051)),
        ((5.0, 5.0), (4.252, 4.252), (4.340, 4.340)),
    ],
)
def test_cables_at_120_degrees(pulls, coarse, limit):
    """Closed form in the limit: with κ·e = l / aL towards both cables, EI κ = Σ T a e."""
    first = robots.require(robots.space(COMMON, *THIRDS[:2]))
    assert robots.read(robots.pulled(first, *pulls)).tensions == pytest.approx(coarse, abs=5e-4)
    exact = np.linalg.solve([[1, -0.5], [-0.5, 1]], pulls) * TENSION / OFFSET
    assert exact == pytest.approx(limit, abs=5e-4)
    converges(lambda n: robots.space(n, *THIRDS[:2]), rod(*THIRDS[:2], touch=(), stations=0).pulled(*pulls), *pulls)


@pytest.mark.parametrize(("pull", "normal"), [(5, 0.0369), (6, 0.1058), (7, 0.1558)])
def test_robot_at_a_sphere(pull, normal):
    """Sum of the normal forces of 18 segments to the digits given, then to the rod as 1/n², from within 3 %."""
    equilibrium = robots.pulled(
        robots.require(robots.space(COMMON, *RIGHT_ANGLE, obstacles=balls(18, SPHERE))), pull, 0
    )
    assert robots.normal_forces(equilibrium).sum() == pytest.approx(normal, abs=5e-5)
    exact = rod(*RIGHT_ANGLE, spheres=(SPHERE,)).pulled(pull, 0.0)
    assert exact.pushes.sum() == pytest.approx(normal, rel=0.03)
    converges(lambda n: robots.space(n, *RIGHT_ANGLE, obstacles=balls(n, SPHERE)), exact, pull, 0.0)


def sampled(seed):
    """A sphere in the way, two or three cables, pulls towards it and away from it on the far side."""
    generator = np.random.default_rng(seed)
    azimuth, height, radius = generator.uniform(0, 2 * math.pi), generator.uniform(70, 150), generator.uniform(12, 20)
    angles = (RIGHT_ANGLE, THIRDS)[seed % 2]
    turn = generator.uniform(0.5, 1.0)
    heading = (math.pi / 4 if seed % 2 == 0 else azimuth) + generator.uniform(-0.4, 0.4)
    reach = radius + OFFSET + generator.uniform(2, 8)
    centre = (reach * math.cos(heading), reach * math.sin(heading), height)
    side = heading + generator.uniform(-0.3, 0.3)
    pulls = [OFFSET * turn * math.cos(angle - side) for angle in angles]
    return angles, (centre, radius), [pull if pull > 0 else pull - 0.5 for pull in pulls]


@pytest.mark.parametrize("seed", [0, 2, 3, 4, 5, 7, 9, 10])  # those of the first eleven that touch, 8 by four points
def test_random_contacts(seed):
    """Forces, tensions and places differ by the order of the discretisation, and by no more than measured."""
    angles, sphere, pulls = sampled(seed)
    robots.require(robots.space(COMMON, *angles))
    exact = rod(*angles, spheres=(sphere,)).pulled(*pulls, steps=20)
    assert np.linalg.norm(exact.forces) > 0.3 * FORCE

    def among(n):
        return robots.space(n, *angles, obstacles=balls(n, sphere))

    assert np.all(errors(robots.pulled(among(18), *pulls), exact) < np.array([1.0, 1.5, 8.0, 13.0]) / 18**2)
    converges(among, exact, *pulls)


@pytest.mark.parametrize("angles", [RIGHT_ANGLE, THIRDS])
def test_weight_and_tip_force_out_of_the_plane(angles):
    weight, force = (0.0, 2e-3, -1e-3), (0.0, -0.05, 0.02)
    pulls = (6.0, 1.0, -8.0)[: len(angles)]
    exact = rod(*angles, touch=(), stations=0, weight=weight, loads=(Load(LENGTH, force),)).pulled(*pulls)

    def loaded(n):
        return robots.space(n, *angles, weight_per_length=weight, loads=[{"node": n, "force": list(force)}])

    converges(loaded, exact, *pulls)


def test_precurved_and_twisted():
    """A rod at rest in a helix, with a load."""
    rest, force = (0.002, 0.004, 0.005), (0.0, 0.04, 0.0)
    exact = rod(0.0, touch=(), stations=0, precurvature=rest, loads=(Load(LENGTH, force),)).pulled(-8.0)

    def curved(n):
        turns = [[component * LENGTH / n for component in rest]] * n
        return robots.space(n, 0.0, precurvature=turns, loads=[{"node": n, "force": list(force)}])

    converges(curved, exact, -8.0)


def test_two_sections():
    """Three cables to the middle and three to the tip, turned by 60°: bends, and tensions of those that are taut."""
    lower, upper = THIRDS, tuple(angle + math.pi / 3 for angle in THIRDS)
    pulls = (2.5, -0.8, -2.5, 3.5, -1.0, -3.5)
    ends = [*[(angle, LENGTH / 2) for angle in lower], *[(angle, LENGTH) for angle in upper]]
    exact = replace(rod(touch=(), stations=0), cables=tuple(Cable(OFFSET, angle, end) for angle, end in ends)).pulled(
        *pulls
    )

    def sections(n):
        cables = [{"offset": OFFSET, "angle": angle, "end": round(n * end / LENGTH)} for angle, end in ends]
        return robots.space(n, cables=cables)

    converges(sections, exact, *pulls)


def directions():
    return 2 * math.pi * np.arange(12) / 12


def assert_isotropic(deflections, exact):
    """Deflections over the direction for 9, 18, 36 segments: 1/n² from the exact one, and from one another."""
    spread = np.ptp(deflections, axis=1)
    assert np.all(spread[:-1] > 3.6 * spread[1:]), spread
    for n, row in zip((9, 18, 36), deflections, strict=True):
        assert row == pytest.approx(exact, rel=1 / n**2)


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_even_cables_turn_the_tip_alike_in_all_directions(count):
    """Pulled to a turn of 0.5 rad, the tip goes (1 − cos 0.5) / 0.5 of the length to that side, wherever that is.

    Cables beyond the two beside the direction are paid out by 0.3 mm more: without, they lock in second order.
    """
    angles = 2 * math.pi * np.arange(count) / count
    robots.require(robots.space(9, *angles))

    def deflection(n, direction):
        off = (angles - direction + math.pi) % (2 * math.pi) - math.pi
        pulls = OFFSET * 0.5 * np.cos(off) - 0.3 * (np.abs(off) > 2 * math.pi / count - 1e-9)
        tip = robots.read(robots.pulled(robots.space(n, *angles), *pulls, steps=4)).places[-1]
        return tip[:2] @ [math.cos(direction), math.sin(direction)]

    found = np.array([[deflection(n, direction) for direction in directions()] for n in (9, 18, 36)])
    assert_isotropic(found, (1 - math.cos(0.5)) / 0.5 * LENGTH)


def tip_under(n, angles, size, direction, pull):
    """Deflection of the tip, along a small force at it, over the force [mm/N]."""
    along = np.array([math.cos(direction), math.sin(direction), 0.0])
    spec = robots.space(n, *angles, loads=[{"node": n, "force": (size * along).tolist()}])
    return robots.read(robots.pulled(spec, *[pull] * len(angles), steps=1)).places[-1] @ along / size


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_even_cables_give_way_alike_in_all_directions(count):
    """A small force at the tip: F L³ / 12EI with all cables at rest, which keep the tip upright."""
    angles = 2 * math.pi * np.arange(count) / count
    robots.require(robots.space(9, *angles, loads=[{"node": 9, "force": [0.0, 0.0, 0.0]}]))
    sizes = (9, 18, 36)
    found = np.array([[tip_under(n, angles, 0.1 * FORCE, way, 0.0) for way in directions()] for n in sizes])
    assert_isotropic(found, LENGTH**3 / (12 * RIGIDITY))


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_slack_cables_leave_a_cantilever(count):
    """A small force at the tip: F L³ / 3EI with all cables paid out."""
    angles = 2 * math.pi * np.arange(count) / count
    robots.require(robots.space(9, *angles, loads=[{"node": 9, "force": [0.0, 0.0, 0.0]}]))
    found = np.array([tip_under(18, angles, 1e-2 * FORCE, direction, -0.5) for direction in directions()])
    assert found == pytest.approx(LENGTH**3 / (3 * RIGIDITY), rel=1e-3)
    assert np.ptp(found) < 1e-5 * found[0]
