"""The robot in space (eq. 13): two cables, in the node coordinates of the paper, through CasADi and IPOPT.

Base at the origin, unactuated backbone along +z, first cable on the +x side, second cable at an angle from it. Pulling
a cable bends the robot towards its side; pulling both, into the plane between. As in the plane, every segment takes an
equal share of each cable's displacement.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from solver.formulation import NodeProblem, first_derivatives, norms
from solver.reference import LARGEST_STEP, MOVE_OFFSET, MOVE_SLOPE, OPTIONS, SLACK, SMALLEST_STEP
from solver.robot import require_positive
from solver.status import Status

NARROW = 1e-4  # square of the half sine of an angle below which its series serves


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialRobot:
    """A cable-driven continuum robot in space, with two cables.

    Attributes:
        length_mm: Length of the backbone, L0 [mm].
        segments: Number of segments n.
        offset_mm: Distance a of both cables from the backbone [mm].
        angle: From the first cable to the second, about +z [rad]; neither 0 nor half a turn.
        max_cable_mm: Largest displacement of a cable [mm]; ``None`` stands for π·a / 2, a quarter turn of the tip.

    Raises:
        ValueError: If a value is not finite, not positive, or out of range; the message names the bound.
    """

    length_mm: float
    segments: int
    offset_mm: float
    angle: float = math.pi / 2
    max_cable_mm: float | None = None

    def __post_init__(self) -> None:
        for name in ("length_mm", "offset_mm"):
            require_positive(name, getattr(self, name))
        if not (isinstance(self.segments, int) and 2 <= self.segments <= 4096):
            raise ValueError(f"segments is {self.segments!r}; it must be a whole number from 2 to 4096")
        if not (math.isfinite(self.angle) and abs(math.sin(self.angle)) > 1e-3):
            raise ValueError(f"angle is {self.angle}; the cables must not be in one plane with the backbone")
        if self.max_cable_mm is None:
            object.__setattr__(self, "max_cable_mm", min(math.pi * self.offset_mm, self.length_mm) / 2)
        require_positive("max_cable_mm", self.max_cable_mm)
        bound = min(self.length_mm, 2 * self.segments * self.offset_mm)
        if not self.cable_limit_mm < bound:
            raise ValueError(f"max_cable_mm is {self.max_cable_mm}; it must be below {bound}")

    @classmethod
    def prototype(cls, *, segments: int = 18, angle: float = math.pi / 2) -> "SpatialRobot":
        """The paper's prototype, with a second cable."""
        return cls(length_mm=180.0, segments=segments, offset_mm=8.0, angle=angle)

    @property
    def cable_limit_mm(self) -> float:
        """``max_cable_mm`` with its default filled in [mm]."""
        assert self.max_cable_mm is not None
        return self.max_cable_mm

    @property
    def holes(self) -> np.ndarray:
        """Both holes of the base disk, ``(2, 3)`` [mm]."""
        turned = self.offset_mm * np.array([math.cos(self.angle), math.sin(self.angle), 0.0])
        return np.array([[self.offset_mm, 0.0, 0.0], turned])


@dataclass(frozen=True, slots=True, kw_only=True)
class Sphere:
    """A ball that backbone and cable points of all nodes can touch.

    Attributes:
        center: Its centre (x, y, z) [mm].
        radius: Its radius [mm].

    Raises:
        ValueError: If a value is not finite or the radius is not positive.
    """

    center: tuple[float, float, float]
    radius: float

    def __post_init__(self) -> None:
        x, y, z = (float(value) for value in self.center)
        if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
            raise ValueError(f"center is {self.center}; it must be finite")
        object.__setattr__(self, "center", (x, y, z))
        require_positive("radius", self.radius)


def spatial_problem(robot: SpatialRobot, spheres: int) -> NodeProblem:
    """Build eq. 13 for a robot and a number of spheres.

    Returns:
        ``unknowns``: backbone points, first and second holes of nodes 1…n, each as x, y, z triples, ``(9n,)`` [mm].
        ``parameters``: displacements of both cables, then (x, y, z, r) of each sphere [mm]. ``objective``: sum of
        squared angles between consecutive disks, towards both holes [rad²]. ``equalities``: zero when lengths of
        backbone, cables and disks, and the angle between the holes, are as given, ``(6n,)`` [mm]. ``inequalities``:
        gaps of backbone points, first and second holes of nodes 1…n to each sphere [mm].
    """
    n, a = robot.segments, robot.offset_mm
    unknowns, parameters = ca.MX.sym("unknowns", 9 * n), ca.MX.sym("parameters", 2 + 4 * spheres)
    bases = np.vstack([np.zeros(3), robot.holes])
    lines: list[ca.MX] = [
        ca.horzcat(ca.DM(base), ca.reshape(unknowns[3 * n * k : 3 * n * (k + 1)], 3, n)) for k, base in enumerate(bases)
    ]
    disks = [line - lines[0] for line in lines[1:]]
    pulls = [ca.MX(0), parameters[0], parameters[1]]
    lengths = [(robot.length_mm - pull) / n for pull in pulls]
    equalities = [norms(line[:, 1:] - line[:, :-1]) - length for line, length in zip(lines, lengths, strict=True)]
    equalities += [norms(disk[:, 1:]) - a for disk in disks]
    equalities.append(ca.sum1(disks[0][:, 1:] * disks[1][:, 1:]) / a - a * math.cos(robot.angle))
    gaps = [_sphere_gaps(line[:, 1:], parameters[2 + 4 * j : 6 + 4 * j]) for j in range(spheres) for line in lines]
    first, second = (_square_angles(disk, a) for disk in disks)
    inequalities = ca.horzcat(*gaps).T if gaps else ca.MX(0, 1)
    return NodeProblem(unknowns, parameters, ca.sum2(first + second), ca.horzcat(*equalities).T, inequalities)


def _square_angles(disk: ca.MX, offset: float) -> ca.MX:
    """Squared angles between consecutive columns of equal length, ``(1, n)``, smooth where they vanish."""
    square = ca.sum1((disk[:, 1:] - disk[:, :-1]) ** 2) / (4 * offset**2)
    exact = 4 * ca.asin(ca.sqrt(ca.fmax(square, NARROW))) ** 2
    series = 4 * square * (1 + square / 3 + 8 * square**2 / 45 + 4 * square**3 / 35)
    return ca.if_else(square < NARROW, series, exact)


def _sphere_gaps(points: ca.MX, sphere: ca.MX) -> ca.MX:
    offset = points - ca.repmat(sphere[:3], 1, points.shape[1])
    return (ca.sum1(offset**2) - sphere[3] ** 2) / (2 * sphere[3])


@dataclass(frozen=True, slots=True, eq=False)
class SpatialEquilibrium:
    """One equilibrium of a robot among spheres. All arrays are read-only.

    Attributes:
        robot: The robot.
        spheres: The obstacles, m of them.
        cables_mm: Displacements of both cables, ``(2,)`` [mm].
        points: Backbone point and both holes of each node, ``(3, n+1, 3)`` [mm].
        multipliers: Lagrange multipliers of the gaps of these points to each sphere, ``(m, 3, n+1)`` [rad²/mm].
        status: ``CONVERGED``, or ``FAILED`` with the equilibrium the step began at.
    """

    robot: SpatialRobot
    spheres: tuple[Sphere, ...]
    cables_mm: np.ndarray
    points: np.ndarray
    multipliers: np.ndarray
    status: Status

    def __post_init__(self) -> None:
        for array in (self.cables_mm, self.points, self.multipliers):
            array.flags.writeable = False

    @property
    def gaps(self) -> np.ndarray:
        """Signed clearance of each point from each sphere, ``(m, 3, n+1)`` [mm]."""
        centers = np.array([sphere.center for sphere in self.spheres]).reshape(-1, 1, 1, 3)
        radii = np.array([sphere.radius for sphere in self.spheres]).reshape(-1, 1, 1)
        square = np.sum((self.points - centers) ** 2, axis=-1)
        return np.asarray((square - radii**2) / (2 * radii))

    @property
    def objective(self) -> float:
        """Sum of squared angles between consecutive disks, towards both holes [rad²]."""
        disks = (self.points[1:] - self.points[0]) / self.robot.offset_mm
        half_sines = np.linalg.norm(np.diff(disks, axis=1), axis=-1) / 2
        return float(np.sum((2 * np.arcsin(half_sines)) ** 2))

    def residuals(self) -> tuple[float, float, float]:
        """Stationarity of eq. 13 [rad²/mm], violation of its lengths [mm] and depth of penetration [mm]."""
        unknowns, parameters = _numbers(self.points), _parameters(self.spheres, self.cables_mm)
        values = _derivatives(self.robot, len(self.spheres))(unknowns, parameters)
        slope, equalities, equality_slopes, gaps, gap_slopes = (value.full() for value in values)
        balance = slope.ravel() - gap_slopes.T @ self.multipliers[:, :, 1:].ravel()
        tensions = np.linalg.lstsq(equality_slopes.T, balance, rcond=None)[0]
        stationarity = np.abs(balance - equality_slopes.T @ tensions).max()
        return float(stationarity), float(np.abs(equalities).max()), float(max(0.0, -gaps.min(initial=0.0)))


class SpatialReferenceSolver:
    """Follows the equilibria of a robot among spheres by eq. 13 as it stands, through CasADi and IPOPT.

    Only a branch is followed: where it ends in a snap or a jam, a step is ``FAILED``. No cable goes slack: both keep
    the lengths they are given.

    Args:
        robot: The robot.
        spheres: The obstacles.

    Raises:
        ValueError: If a sphere overlaps the straight robot.
    """

    def __init__(self, robot: SpatialRobot, spheres: tuple[Sphere, ...] = ()) -> None:
        self.robot, self.spheres = robot, tuple(spheres)
        self._rest = self._free(np.zeros(2))
        for sphere, gaps in zip(self.spheres, self._rest.gaps, strict=True):
            if gaps.min() < 0:
                raise ValueError(f"{sphere!r} overlaps the straight robot by {-gaps.min():.3g} mm")
        problem = spatial_problem(robot, len(self.spheres))
        self._equalities = problem.equalities.shape[0]
        nlp: dict[str, Any] = {
            "x": problem.unknowns,
            "p": ca.vertcat(problem.parameters, unit := ca.MX.sym("unit")),
            "f": problem.objective / unit**2,
            "g": ca.vertcat(problem.equalities, problem.inequalities),
        }
        self._ipopt = ca.nlpsol("spatial_reference", "ipopt", nlp, OPTIONS)

    def rest(self) -> SpatialEquilibrium:
        """The straight, unactuated robot."""
        return self._rest

    def step(self, equilibrium: SpatialEquilibrium, cables_mm: tuple[float, float]) -> SpatialEquilibrium:
        """Move both cables evenly to displacements.

        Args:
            equilibrium: Where the robot is, from this solver.
            cables_mm: Displacement of each cable, 0 to ``robot.max_cable_mm`` [mm].

        Raises:
            ValueError: If a command is out of range.
        """
        target = np.array(cables_mm, dtype=float)
        limit = self.robot.cable_limit_mm
        if not (target.shape == (2,) and np.all((target >= 0) & (target <= limit))):
            raise ValueError(f"cables_mm is {cables_mm}; both must be from 0 to {limit:.6g} (robot.max_cable_mm)")
        now, largest = equilibrium, LARGEST_STEP
        while (distance := np.abs(target - now.cables_mm).max()) > 0:
            part = min(1.0, largest / distance)
            following = self._solve(now, target if part == 1 else now.cables_mm + part * (target - now.cables_mm))
            if following is not None:
                now = following
            elif largest > SMALLEST_STEP:
                largest /= 2
            else:
                arrays = equilibrium.cables_mm, equilibrium.points, equilibrium.multipliers
                return SpatialEquilibrium(self.robot, self.spheres, *arrays, Status.FAILED)
        return now

    def _solve(self, start: SpatialEquilibrium, cables: np.ndarray) -> SpatialEquilibrium | None:
        free = self._free(cables)
        if np.abs(cables).max() < SLACK or (not start.multipliers.any() and free.gaps.min(initial=1.0) > 0):
            return free
        n, unit = self.robot.segments, np.abs(cables).max() / (self.robot.segments * self.robot.offset_mm)
        bounded = 3 * n * len(self.spheres)
        solution = self._ipopt(
            x0=_numbers(start.points),
            lam_g0=np.r_[np.zeros(self._equalities), -start.multipliers[:, :, 1:].ravel() / unit**2],
            p=np.r_[_parameters(self.spheres, cables), unit],
            lbg=np.zeros(self._equalities + bounded),
            ubg=np.r_[np.zeros(self._equalities), np.full(bounded, np.inf)],
        )
        points = np.concatenate([start.points[:, :1], solution["x"].full().reshape(3, n, 3)], axis=1)
        moved = np.linalg.norm(points - start.points, axis=-1).max()
        allowed = MOVE_OFFSET + MOVE_SLOPE * np.abs(cables - start.cables_mm).max()
        if not (self._ipopt.stats()["success"] and moved <= allowed):
            return None
        pushes = -solution["lam_g"].full().ravel()[self._equalities :]
        pushes[pushes < np.abs(solution["g"].full().ravel()[self._equalities :])] = 0.0  # what the barrier left
        multipliers = np.zeros((len(self.spheres), 3, n + 1))
        multipliers[:, :, 1:] = unit**2 * pushes.reshape(-1, 3, n)
        return SpatialEquilibrium(self.robot, self.spheres, cables, points, multipliers, Status.CONVERGED)

    def _free(self, cables: np.ndarray) -> SpatialEquilibrium:
        """The robot that nothing touches: every segment turns alike, towards b with ``h·b = pull`` for both holes h."""
        n, length, holes = self.robot.segments, self.robot.length_mm / self.robot.segments, self.robot.holes
        towards = np.append(np.linalg.solve(holes[:, :2], cables / n), 0.0)  # 2 sin θ/2 along the bend
        size = float(np.linalg.norm(towards))
        angle = 2 * math.asin(size / 2)
        direction = towards / size if size > 0 else np.array([1.0, 0.0, 0.0])
        points = np.zeros((3, n + 1, 3))
        for k, base in enumerate([np.zeros(3), *holes]):
            points[k] = base
            along = float(base @ direction)
            turns = angle * np.arange(n + 1)
            points[k] += along * ((np.cos(turns) - 1)[:, None] * direction - np.sin(turns)[:, None] * [0.0, 0.0, 1.0])
        middles = angle * (np.arange(n) + 0.5)
        points[:, 1:] += length * np.cumsum(
            np.sin(middles)[:, None] * direction + np.cos(middles)[:, None] * [0.0, 0.0, 1.0], axis=0
        )
        multipliers = np.zeros((len(self.spheres), 3, n + 1))
        return SpatialEquilibrium(self.robot, self.spheres, cables, points, multipliers, Status.CONVERGED)


def _numbers(points: np.ndarray) -> np.ndarray:
    """Unknowns of :func:`spatial_problem` at some points."""
    return points[:, 1:].ravel()


def _parameters(spheres: tuple[Sphere, ...], cables: np.ndarray) -> np.ndarray:
    return np.array([*cables, *(value for sphere in spheres for value in (*sphere.center, sphere.radius))])


@lru_cache(maxsize=32)
def _derivatives(robot: SpatialRobot, spheres: int) -> ca.Function:
    """:func:`~solver.formulation.first_derivatives` of :func:`spatial_problem`."""
    return first_derivatives(spatial_problem(robot, spheres))
