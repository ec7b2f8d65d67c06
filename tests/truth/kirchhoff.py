"""Kirchhoff rod in space with frictionless cables, dead loads and spheres, minimised by IPOPT.

Backbone r(s) and frame R(s) obey r' = R e₃ and R' = R û, where the body curvature u = (u_x, u_y, u_z), less that at
rest, has the energy ∫ (EI (u_x² + u_y²) + GJ u_z²)/2 ds. A cable runs along r + R h, h = a (cos α, sin α, 0), so that
its length is ∫ |e₃ + u × h| ds; it is at most the rest length less the pull, and the multiplier is its tension.

The curvature is linear on each of m elements and jumps between them; frames are quaternions, integrated by Runge and
Kutta's method, and are unknowns at the ends of elements. Cable lengths and weight are integrated along. What is found
converges as m⁻⁴. Points of disks can touch at given ``stations`` alone, as on a robot whose nodes are there.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(4)
OPTIONS = {
    "print_time": False,
    "error_on_fail": False,
    "ipopt": {
        "print_level": 0,
        "sb": "yes",
        "tol": 1e-10,
        "constr_viol_tol": 1e-12,
        "compl_inf_tol": 1e-10,
        "dual_inf_tol": 1e-9,
        "max_iter": 300,
        "warm_start_init_point": "yes",
        "warm_start_bound_push": 1e-8,
        "warm_start_mult_bound_push": 1e-8,
        "warm_start_slack_bound_push": 1e-8,
        "mu_init": 1e-5,
    },
}


def _hole(offset: float, angle: float) -> np.ndarray:
    return offset * np.array([math.cos(angle), math.sin(angle), 0.0])


def _rotation(q: ca.SX) -> ca.SX:
    """Return the rotation of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return ca.vertcat(
        ca.horzcat(1 - 2 * (y**2 + z**2), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        ca.horzcat(2 * (x * y + w * z), 1 - 2 * (x**2 + z**2), 2 * (y * z - w * x)),
        ca.horzcat(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x**2 + y**2)),
    )


def _slope(state: ca.SX, u: ca.SX) -> ca.SX:
    """Return the derivative of (r, q) along the rod."""
    q = state[3:]
    w, v = q[0], q[1:]
    turned = ca.vertcat(-ca.dot(v, u), w * u + ca.cross(v, u)) / 2
    return ca.vertcat(_rotation(q)[:, 2], turned)


def _runge_kutta(state: ca.SX, curvature: ca.Function, start: float, share: float, size: float) -> ca.SX:
    """Return the state after a step of a share of an element of some size."""
    step = share * size
    first = _slope(state, curvature(start))
    second = _slope(state + step / 2 * first, curvature(start + share / 2))
    third = _slope(state + step / 2 * second, curvature(start + share / 2))
    fourth = _slope(state + step * third, curvature(start + share))
    return state + step / 6 * (first + 2 * second + 2 * third + fourth)


def element(size: float, holes: list[np.ndarray]) -> ca.Function:
    """Return (r, q) at the end of an element, its share of the integral of r, and how much each cable is shortened."""
    state, mean, tilt = ca.SX.sym("state", 7), ca.SX.sym("mean", 3), ca.SX.sym("tilt", 3)

    def curvature(share: float) -> ca.SX:
        return mean + (2 * share - 1) * tilt

    middle = _runge_kutta(state, curvature, 0.0, 0.5, size)
    end = _runge_kutta(middle, curvature, 0.5, 0.5, size)
    centre = size / 6 * (state[:3] + 4 * middle[:3] + end[:3])
    end = ca.vertcat(end[:3], end[3:] / ca.norm_2(end[3:]))
    shortened = []
    for hole in holes:
        lines = [ca.DM([0, 0, 1]) + ca.cross(curvature((1 + point) / 2), ca.DM(hole)) for point in POINTS]
        shortened.append(size * (1 - sum(w / 2 * ca.norm_2(x) for w, x in zip(WEIGHTS, lines, strict=True))))
    return ca.Function("element", [state, mean, tilt], [end, centre, ca.vertcat(*shortened)])


class Cable(NamedTuple):
    """A cable through holes at a distance [mm] and angle on every disk, up to an arc length [mm]."""

    offset: float
    angle: float
    end: float


class Load(NamedTuple):
    """A dead force [N] at the backbone at an arc length [mm], the end of an element."""

    at: float
    force: tuple[float, float, float]


class State(NamedTuple):
    """Backbone (m+1, 3) and frames (m+1, 3, 3) at the ends of elements, tensions (c,) [N], pushes and forces.

    Pushes are normal forces (spheres, stations, points) [N], forces their sum on the rod for each sphere, (spheres, 3).
    """

    places: np.ndarray
    frames: np.ndarray
    tensions: np.ndarray
    pushes: np.ndarray
    forces: np.ndarray
    energy: float


@dataclass(frozen=True, kw_only=True)
class Rod:
    """A rod and what acts on it.

    ``touch`` are (offset, angle) of points of the disks at evenly spaced ``stations``, the base not counted;
    ``spheres`` are (centre, radius). ``weight`` is a force on a unit of length [N/mm], ``precurvature`` the curvature
    at rest [1/mm]. ``law`` replaces the elements by others, such as :func:`truth.segments.segment`.
    """

    length: float
    rigidity: float
    torsion_ratio: float
    cables: tuple[Cable, ...]
    elements: int
    stations: int = 0
    touch: tuple[tuple[float, float], ...] = ()
    spheres: tuple[tuple[tuple[float, float, float], float], ...] = ()
    loads: tuple[Load, ...] = ()
    weight: tuple[float, float, float] = (0.0, 0.0, 0.0)
    precurvature: tuple[float, float, float] = (0.0, 0.0, 0.0)
    law: Callable[[float, list[np.ndarray]], ca.Function] = element

    def follow(self, pulls: Iterable[Iterable[float]]) -> State:
        """Return the state after a path of pulls, each solved from the one before, from the straight rod on.

        Raises:
            ArithmeticError: If IPOPT does not converge.
        """
        problem = self._problem
        warm = {"x0": problem.straight}
        for pull in pulls:
            bounds = {"lbg": problem.lower, "ubg": problem.upper, "p": np.array(list(pull)) / self.length}
            found = problem.solver(**warm, **bounds)
            if not problem.solver.stats()["success"]:
                raise ArithmeticError(f"{problem.solver.stats()['return_status']} at pulls {pull}")
            warm = {"x0": found["x"], "lam_g0": found["lam_g"], "lam_x0": found["lam_x"]}
        return self._state(found)

    def pulled(self, *pulls: float, steps: int = 10) -> State:
        """Return the state after a straight path of pulls."""
        return self.follow(np.outer(np.arange(1, steps + 1) / steps, pulls))

    @cached_property
    def _problem(self) -> "_Problem":
        return _problem(self)

    def _state(self, found: dict[str, ca.DM]) -> State:
        frames = self.elements + 1
        places, turns = _chain(self, found["x"])[1:]
        rotations = np.array([np.array(_rotation(turns[:, k])) for k in range(frames)])
        multipliers = -np.array(found["lam_g"]).ravel()[7 * self.elements :]
        count = len(self.cables)
        offsets = np.array([cable.offset for cable in self.cables])
        tensions = multipliers[:count] * self.rigidity / (self.length * offsets)
        shape = (len(self.spheres), self.stations, len(self.touch))
        pushes = multipliers[count:].reshape(shape) * self.rigidity / self.length**2
        places = np.array(places).T * self.length
        energy = float(found["f"]) * self.rigidity / self.length
        return State(places, rotations, tensions, pushes, self._forces(places, rotations, pushes), energy)

    def _forces(self, places: np.ndarray, frames: np.ndarray, pushes: np.ndarray) -> np.ndarray:
        every = self.elements // self.stations if self.stations else 1
        total = np.zeros((len(self.spheres), 3))
        for m, k, p in np.argwhere(pushes > 0):
            point = places[(k + 1) * every] + frames[(k + 1) * every] @ _hole(*self.touch[p])
            away = point - self.spheres[m][0]
            total[m] += pushes[m, k, p] * away / np.linalg.norm(away)
        return total


class _Problem(NamedTuple):
    """IPOPT's problem over a rod of unit length and rigidity."""

    solver: ca.Function
    straight: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


def _chain(rod: Rod, unknowns: ca.MX) -> tuple:
    """Split unknowns into mean and tilt of curvatures (6, m), and places (3, m+1) and quaternions (4, m+1)."""
    table = ca.reshape(unknowns, 13, rod.elements)
    start = ca.DM([0, 0, 0, 1, 0, 0, 0])
    states = ca.horzcat(start, table[6:, :])
    return table[:6, :], states[:3, :], states[3:, :]


def _problem(rod: Rod) -> _Problem:
    unknowns, pulls = ca.MX.sym("x", 13 * rod.elements), ca.MX.sym("pull", len(rod.cables))
    curvatures, places, turns = _chain(rod, unknowns)
    states = ca.vertcat(places, turns)
    law = (rod.law or element)(
        1 / rod.elements, [_hole(cable.offset, cable.angle) / rod.length for cable in rod.cables]
    )
    ends, centres, shortened = law.map(rod.elements)(states[:, :-1], curvatures[:3, :], curvatures[3:, :])
    unequal = [ca.vec(states[:, 1:] - ends)]
    taut = []
    for k, cable in enumerate(rod.cables):
        last = round(cable.end / rod.length * rod.elements)
        taut.append((ca.sum2(shortened[k, :last]) - pulls[k]) * rod.length / cable.offset)
    gaps = [_gaps(rod, places, turns, *sphere) for sphere in rod.spheres]
    energy = _energy(rod, curvatures) - _work(rod, places, centres)
    constraints = ca.vertcat(*unequal, *taut, *gaps)
    problem = {"x": unknowns, "p": pulls, "f": energy, "g": constraints}
    lower, upper = np.zeros(constraints.shape[0]), np.full(constraints.shape[0], np.inf)
    upper[: 7 * rod.elements] = 0.0
    heights = np.arange(1, rod.elements + 1) / rod.elements
    straight = np.zeros((rod.elements, 13))
    straight[:, 8], straight[:, 9] = heights, 1.0
    return _Problem(ca.nlpsol("rod", "ipopt", problem, OPTIONS), straight.ravel(), lower, upper)


def _energy(rod: Rod, curvatures: ca.MX) -> ca.MX:
    ratios = ca.DM([1, 1, rod.torsion_ratio])
    rest = ca.repmat(ca.DM(rod.precurvature) * rod.length, 1, rod.elements)
    squares = (curvatures[:3, :] - rest) ** 2 + curvatures[3:, :] ** 2 / 3
    return ca.dot(ratios, ca.sum2(squares)) / (2 * rod.elements)


def _work(rod: Rod, places: ca.MX, centres: ca.MX) -> ca.MX:
    """Return the work of weight and loads, in units of EI/L."""
    force = rod.rigidity / rod.length**2
    work = ca.dot(ca.DM(rod.weight) * rod.length / force, ca.sum2(centres))
    for load in rod.loads:
        work += ca.dot(ca.DM(load.force) / force, places[:, round(load.at / rod.length * rod.elements)])
    return work


def _gaps(rod: Rod, places: ca.MX, turns: ca.MX, center: tuple[float, float, float], radius: float) -> ca.MX:
    """Return the gaps of the points of all stations but the base to a sphere, over the length."""
    place, q = ca.SX.sym("place", 3), ca.SX.sym("q", 4)
    points = [place + _rotation(q) @ (_hole(*touch) / rod.length) for touch in rod.touch]
    away = [point - ca.DM(center) / rod.length for point in points]
    size = radius / rod.length
    gap = ca.Function("gap", [place, q], [ca.vertcat(*[(ca.sumsqr(x) - size**2) / (2 * size) for x in away])])
    every = rod.elements // rod.stations
    return ca.vec(gap.map(rod.stations)(places[:, every::every], turns[:, every::every]))
