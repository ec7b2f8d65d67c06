"""Planar elastica under frictionless cables, dead loads and point contacts, by shooting.

Backbone r(s), 0 ≤ s ≤ L, with tangent t = (sin θ, cos θ) and normal d = (cos θ, −sin θ), where θ = −φ of the
package: it is clamped at the origin, points along +y at rest, and d is then +x. A cable at the distance a runs
along r + a d, so that its length up to s is s − a θ(s), shortened by bending. Without friction its tension T is
the same all along.

The equilibrium minimises ∫ EI θ'²/2 ds less the work of the loads, under a θ(s_e) = pull for every cable, with
multiplier T, and under zero gap at every contact, with multiplier N. With M = EI θ' and p(s) the sum of all outer
forces beyond s, it obeys

    r' = t,   θ' = M / EI,   M' = −p · d,   M(L) = 0.

Along +s, M drops by T a at the end of a cable, and by −b F · t at a force F on the line r + b d, since ∂(b d)/∂θ
= −b t. Nothing else of the cable shows: its pressure T κ on the backbone and its pull T at the end balance in
every section.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

Gap = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]  # points (2, ...) → gap, gradient (2, ...)
ITERATIONS, CONVERGED, STEP = 40, 1e-11, 1e-6


class Cable(NamedTuple):
    """A taut cable: signed distance from the backbone [mm], arc length where it ends [mm], pull [mm]."""

    offset: float
    end: float
    pull: float


class Load(NamedTuple):
    """A dead force on the backbone [N] and a moment that turns φ up [N·mm], at an arc length [mm]."""

    at: float
    force: tuple[float, float]
    moment: float = 0.0


class Contact(NamedTuple):
    """A frictionless contact of the line at a signed distance from the backbone.

    It is at a given arc length as that of a disk, or, ``free``, where the line is tangent to the obstacle.
    """

    gap: Gap
    line: float
    at: float
    free: bool = False


@dataclass(frozen=True, kw_only=True)
class Beam:
    """A beam and all that acts on it; ``weight`` is a force on a unit of length [N/mm]."""

    length: float
    rigidity: float
    cables: tuple[Cable, ...] = ()
    contacts: tuple[Contact, ...] = ()
    loads: tuple[Load, ...] = ()
    weight: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Solution:
    """Tensions (c,) [N], contact forces on the beam (m, 2) [N], their arc lengths (m,) [mm], and the shape."""

    tensions: np.ndarray
    forces: np.ndarray
    places: np.ndarray
    unknowns: np.ndarray
    pieces: list = field(repr=False)

    def poses(self, arc_lengths: np.ndarray) -> np.ndarray:
        """Return poses (x, y, φ) at arc lengths, (k, 3)."""
        return np.array([self._state(s)[:3] * [1, 1, -1] for s in np.atleast_1d(arc_lengths)])

    def moment(self, arc_length: float) -> float:
        """Return the bending moment EI θ' at an arc length [N·mm]."""
        return float(self._state(arc_length)[3])

    def energy(self, rigidity: float) -> float:
        """Return the elastic energy, by Gauss quadrature on every piece [N·mm]."""
        nodes, weights = np.polynomial.legendre.leggauss(40)
        total = 0.0
        for low, high, piece in self.pieces:
            moments = piece((nodes + 1) / 2)[3]
            total += (high - low) / 2 * float(weights @ moments**2) / (2 * rigidity)
        return total

    def _state(self, arc_length: float) -> np.ndarray:
        for low, high, piece in self.pieces:
            if arc_length <= high:
                return piece((arc_length - low) / (high - low))
        raise ValueError(arc_length)


class _Event(NamedTuple):
    """What happens at an arc length (k,): an outer force (2, k), and the drop of the moment there, of the state."""

    at: np.ndarray
    force: np.ndarray
    drop: Callable[[np.ndarray], np.ndarray]


def circle(center: tuple[float, float], radius: float) -> Gap:
    """Return the distance to a circle, with its gradient."""

    def gap(point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        away = (point.T - center).T
        distance = np.hypot(*away)
        return distance - radius, away / distance

    return gap


def wall(point: tuple[float, float], normal: tuple[float, float]) -> Gap:
    """Return the distance to a wall of unit normal, with its gradient."""

    def gap(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        away = (place.T - point) @ np.array(normal)
        return away.T, np.array(normal).reshape(2, *[1] * (place.ndim - 1)) * np.ones_like(place)

    return gap


def solve(beam: Beam, guess: np.ndarray | None = None) -> Solution:
    """Return the equilibrium, by Newton's method from a guess of the unknowns or from a circular arc.

    The unknowns are M(0), the tensions, and the force and, where it is free, the place of every contact, each in
    natural units. All columns of the Jacobian are integrated at once.

    Raises:
        ArithmeticError: If Newton's method does not converge to 1e-11, or a cable pushes, or an obstacle pulls.
    """
    unknowns = _first_guess(beam) if guess is None else np.array(guess)
    for _ in range(ITERATIONS):
        columns = unknowns[:, None] + STEP * np.eye(len(unknowns), len(unknowns) + 1, 1)
        values, _ = _shoot(beam, columns)
        step = np.linalg.solve((values[:, 1:] - values[:, :1]) / STEP, -values[:, 0])
        unknowns = unknowns + step / max(1.0, np.abs(step).max())
        if np.abs(step).max() < CONVERGED:
            return _checked(beam, _solution(beam, unknowns))
    raise ArithmeticError(f"no equilibrium of {beam}: last step {step}")


def _first_guess(beam: Beam) -> np.ndarray:
    tensions = [cable.pull / cable.offset * beam.length / cable.end for cable in beam.cables]
    contacts = [[0.0, 0.0, *([contact.at / beam.length] if contact.free else [])] for contact in beam.contacts]
    return np.concatenate([[sum(tensions)], tensions, *contacts])


def _checked(beam: Beam, found: Solution) -> Solution:
    """Return a solution whose cables pull and whose obstacles push."""
    points = [_point(found._state(s), c.line) for c, s in zip(beam.contacts, found.places, strict=True)]
    pushes = [force @ c.gap(x)[1] for c, x, force in zip(beam.contacts, points, found.forces, strict=True)]
    if min([*found.tensions, *pushes], default=0.0) < 0:
        raise ArithmeticError(f"tensions {found.tensions} and normal forces {pushes} of {beam} must not be negative")
    return found


class _Parts(NamedTuple):
    """The unknowns in their units: M(0), the tensions, forces and places of contacts, over (k,) columns."""

    moment: np.ndarray
    tensions: list[np.ndarray]
    forces: list[np.ndarray]
    places: list[np.ndarray]


def _parts(beam: Beam, unknowns: np.ndarray) -> _Parts:
    moment_unit, force_unit = beam.rigidity / beam.length, beam.rigidity / beam.length**2
    rest = iter(unknowns)
    moment = moment_unit * next(rest)
    tensions = [moment_unit / cable.offset * next(rest) for cable in beam.cables]
    forces, places = [], []
    for contact in beam.contacts:
        forces.append(force_unit * np.array([next(rest), next(rest)]))
        places.append(beam.length * next(rest) if contact.free else np.full_like(moment, contact.at))
    return _Parts(moment, tensions, forces, places)


def _events(beam: Beam, parts: _Parts) -> list[_Event]:
    """Return all that happens along the beam, by arc length, the tip last."""
    ones = np.ones_like(parts.moment)
    nothing = np.zeros((2, *ones.shape))
    events = [_Event(beam.length * ones, nothing, lambda _: 0.0)]
    for cable, tension in zip(beam.cables, parts.tensions, strict=True):
        events.append(_Event(cable.end * ones, nothing, lambda _, drop=tension * cable.offset: drop))
    for load in beam.loads:
        force = np.multiply.outer(load.force, ones)
        events.append(_Event(load.at * ones, force, lambda _, drop=-load.moment: drop))
    for contact, force, place in zip(beam.contacts, parts.forces, parts.places, strict=True):
        events.append(_Event(place, force, lambda s, f=force, b=contact.line: -b * np.sum(f * _tangent(s), axis=0)))
    return sorted(events, key=lambda event: event.at[0])


def _tangent(state: np.ndarray) -> np.ndarray:
    return np.array([np.sin(state[2]), np.cos(state[2])])


def _point(state: np.ndarray, line: float) -> np.ndarray:
    return state[:2] + line * np.array([np.cos(state[2]), -np.sin(state[2])])


def _shoot(beam: Beam, unknowns: np.ndarray) -> tuple[np.ndarray, list]:
    """Return the residuals of unknowns (u, k), in natural units, and the pieces of the shape of the first column."""
    parts = _parts(beam, unknowns)
    events = _events(beam, parts)
    state, here = np.zeros((4, *parts.moment.shape)), np.zeros_like(parts.moment)
    state[3] = parts.moment
    pieces, states = [], {}
    beyond = sum(event.force for event in events)
    for event in events:
        if event.at[0] > here[0]:
            state, piece = _advance(beam, state, here, event.at, beyond)
            pieces.append((here[0], event.at[0], piece))
        here, beyond, states[event.at[0]] = event.at, beyond - event.force, state
        state = state - np.array([0.0, 0.0, 0.0, 1.0])[:, None] * event.drop(state)
    return np.array([state[3] * beam.length / beam.rigidity, *_conditions(beam, parts, states)]), pieces


def _conditions(beam: Beam, parts: _Parts, states: dict[float, np.ndarray]) -> list[np.ndarray]:
    """Return what cables and contacts ask of the states at their arc lengths."""
    found = [states[cable.end][2] - cable.pull / cable.offset for cable in beam.cables]
    for contact, force, place in zip(beam.contacts, parts.forces, parts.places, strict=True):
        state = states[place[0]]
        gap, slope = contact.gap(_point(state, contact.line))
        across = (force[0] * slope[1] - force[1] * slope[0]) * beam.length**2 / beam.rigidity
        found += [gap / beam.length, across]
        found += [np.sum(slope * _tangent(state), axis=0)] if contact.free else []
    return found


def _advance(beam: Beam, state: np.ndarray, low: np.ndarray, high: np.ndarray, beyond: np.ndarray) -> tuple:
    """Integrate states (4, k) from arc lengths to others; return them and the first one's course over [0, 1]."""
    weight = np.array(beam.weight)[:, None]

    def slopes(share: float, flat: np.ndarray) -> np.ndarray:
        _, _, theta, moment = flat.reshape(state.shape)
        force = beyond + weight * (beam.length - low - share * (high - low))
        sine, cosine = np.sin(theta), np.cos(theta)
        along = np.array([sine, cosine, moment / beam.rigidity, force[1] * sine - force[0] * cosine])
        return (along * (high - low)).ravel()

    run = solve_ivp(slopes, (0, 1), state.ravel(), method="DOP853", rtol=1e-12, atol=1e-12, dense_output=True)
    return run.y[:, -1].reshape(state.shape), lambda share: run.sol(share).reshape(*state.shape, *np.shape(share))[:, 0]


def _solution(beam: Beam, unknowns: np.ndarray) -> Solution:
    parts = _parts(beam, unknowns[:, None])
    _, pieces = _shoot(beam, unknowns[:, None])
    forces = np.array(parts.forces).reshape(-1, 2)
    return Solution(np.ravel(parts.tensions), forces, np.ravel(parts.places), unknowns, pieces)
