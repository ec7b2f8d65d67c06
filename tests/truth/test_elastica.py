"""The elastica against closed forms, and its equations against the energy that they make stationary."""

import math

import numpy as np
import pytest
from scipy.special import ellipkinc

from truth.elastica import Beam, Cable, Contact, Load, circle, solve, wall

LENGTH, OFFSET, RIGIDITY = 180.0, 8.0, 5000.0
BEAM = {"length": LENGTH, "rigidity": RIGIDITY}


def test_a_cable_bends_the_free_beam_to_an_arc():
    curvature = 7.0 / (OFFSET * LENGTH)
    found = solve(Beam(**BEAM, cables=(Cable(OFFSET, LENGTH, 7.0),)))
    turn = curvature * LENGTH
    assert found.tensions == pytest.approx([RIGIDITY * curvature / OFFSET], rel=1e-12)
    assert found.poses(LENGTH)[0] == pytest.approx(
        [(1 - math.cos(turn)) / curvature, math.sin(turn) / curvature, -turn], rel=1e-12
    )
    assert found.energy(RIGIDITY) == pytest.approx(RIGIDITY * curvature**2 * LENGTH / 2, rel=1e-12)


def test_two_sections_are_two_arcs():
    """M = T₁ a₁ + T₂ a₂ below the end of the first cable and T₂ a₂ beyond, from θ = pull / a at both ends."""
    first, second, half = 6.0 / 8.0, 5.0 / 6.0, LENGTH / 2
    found = solve(Beam(**BEAM, cables=(Cable(8.0, half, 6.0), Cable(6.0, LENGTH, 5.0))))
    lower, upper = RIGIDITY * first / half, RIGIDITY * (second - first) / half
    assert found.tensions == pytest.approx([(lower - upper) / 8, upper / 6], rel=1e-11)
    assert found.poses([half, LENGTH])[:, 2] == pytest.approx([-first, -second], rel=1e-12)


@pytest.mark.parametrize("load", [0.5, 2.0, 4.0])
def test_transverse_force_bends_as_by_elliptic_integrals(load):
    """Bisshopp and Drucker: F L² / EI = (K(k) − F(k, ψ))², 2 k² = 1 + sin θ(L), k sin ψ = √½."""
    beam = Beam(**BEAM, loads=(Load(LENGTH, (load * RIGIDITY / LENGTH**2, 0.0)),))
    found = solve(beam, [0.8 * math.sqrt(2 * load)])  # M(0)² = 2 EI F sin θ(L)
    (pose,) = found.poses(LENGTH)
    square = (1 + math.sin(-pose[2])) / 2
    amplitude = math.asin(math.sqrt(0.5 / square))
    assert (ellipkinc(math.pi / 2, square) - ellipkinc(amplitude, square)) ** 2 == pytest.approx(load, rel=1e-10)
    axial = math.sqrt(2 * math.sin(-pose[2]) / load)  # y(L) / L
    assert pose[1] / LENGTH == pytest.approx(axial, rel=1e-10)


def test_light_cantilever_sags_by_the_beam_formulas():
    weight = 1e-4 * RIGIDITY / LENGTH**3
    (sag,) = solve(Beam(**BEAM, weight=(weight, 0.0))).poses(LENGTH)[:, 0]
    assert sag == pytest.approx(weight * LENGTH**4 / (8 * RIGIDITY), rel=1e-8)
    force = 1e-4 * RIGIDITY / LENGTH**2
    (sag,) = solve(Beam(**BEAM, loads=(Load(LENGTH, (force, 0.0)),))).poses(LENGTH)[:, 0]
    assert sag == pytest.approx(force * LENGTH**3 / (3 * RIGIDITY), rel=1e-8)


LOADED = {
    "weight": Beam(**BEAM, weight=(2 * RIGIDITY / LENGTH**3, -1e-3)),
    "moment": Beam(**BEAM, loads=(Load(70.0, (0.1, -0.05), 10.0), Load(LENGTH, (0.0, 0.05), -20.0))),
    "sections": Beam(**BEAM, cables=(Cable(8.0, 90.0, 4.0), Cable(-6.0, LENGTH, 1.0)), weight=(0.0, -5e-4)),
    "cell": Beam(**BEAM, cables=(Cable(8.0, LENGTH, 8.0),), contacts=(Contact(wall((31, 0), (-1, 0)), 8.0, 140.0),)),
    "circle": Beam(
        **BEAM, cables=(Cable(8.0, LENGTH, 8.0),), contacts=(Contact(circle((44, 104), 15), 8.0, 120.0, free=True),)
    ),
}


def panels_of(beam, found):
    """Return Gauss points and weights (p, 12) on panels that end wherever something happens along a beam."""
    ends = [*found.places, *(cable.end for cable in beam.cables), *(load.at for load in beam.loads)]
    edges = np.unique([*np.linspace(0, LENGTH, 20), *ends])
    points, weights = np.polynomial.legendre.leggauss(12)
    width = np.diff(edges)[:, None] / 2
    return edges[:-1, None] + width * (points + 1), width * weights


def potential(beam, found, angle, slope):
    """Return the energy less all work, at θ plus a trial angle(s), whose derivative is slope(s).

    Tensions and contact forces are those found, the multipliers of cables and contacts at an equilibrium.
    """
    s, weights = panels_of(beam, found)
    theta = angle(s) - np.reshape(found.poses(s.ravel())[:, 2], s.shape)
    kappa = slope(s) + np.reshape([found.moment(at) for at in s.ravel()], s.shape) / beam.rigidity
    ahead = np.array([np.sin(theta), np.cos(theta)]) * weights

    def turned(at):
        return angle(at) - found.poses(at)[0, 2]

    def place(at, line=0.0):
        across = np.array([math.cos(turned(at)), -math.sin(turned(at))])
        return ahead[:, s[:, -1] < at].sum(axis=(1, 2)) + line * across

    work = np.dot(beam.weight, ((LENGTH - s) * ahead).sum(axis=(1, 2)))
    work += sum(t * cable.offset * turned(cable.end) for cable, t in zip(beam.cables, found.tensions, strict=True))
    pushed = zip(beam.contacts, found.forces, found.places, strict=True)
    work += sum(force @ place(at, contact.line) for contact, force, at in pushed)
    work += sum(load.force @ place(load.at) - load.moment * turned(load.at) for load in beam.loads)
    return (weights * beam.rigidity * kappa**2).sum() / 2 - work


def sine(share, wave):
    """Return a trial angle and its derivative."""
    return lambda s: share * np.sin(wave * s), lambda s: share * wave * np.cos(wave * s)


@pytest.mark.parametrize("name", LOADED)
def test_shape_is_stationary(name):
    beam = LOADED[name]
    found = solve(beam)
    for wave in (0.7, 1.3, 3.1, 5.2):
        up, down = (potential(beam, found, *sine(share, wave / LENGTH)) for share in (1e-4, -1e-4))
        assert (up - down) / 2e-4 == pytest.approx(0.0, abs=1e-7 * RIGIDITY / LENGTH)


@pytest.mark.parametrize("name", ["cell", "circle"])
def test_contacts_and_cables_hold(name):
    beam = LOADED[name]
    found = solve(beam)
    (contact,) = beam.contacts
    for at, bound in ((found.places[0], 1e-9), (found.places[0] + 2, None), (found.places[0] - 2, None)):
        x, y, phi = found.poses(at)[0]
        gap, _ = contact.gap(np.array([x, y]) + contact.line * np.array([math.cos(phi), math.sin(phi)]))
        assert abs(gap) < bound if bound else (gap > 0 or not contact.free)
    assert found.poses(LENGTH)[0, 2] == pytest.approx(-1.0, rel=1e-12)  # pull / offset
