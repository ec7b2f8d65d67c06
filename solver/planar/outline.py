"""Outlines of shapes of a family: where they are, what is wrong with them, and how large they are."""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from solver.common.gap_laws import GapLaw, gap_function
from solver.common.obstacle import SHARPEST
from solver.common.signals import held_signals
from solver.common.validation import Point
from solver.planar.family import POSE_SIZE, Family
from solver.planar.obstacles import directions, distance_to_outline

BISECTIONS = 60
REFINEMENTS = 12  # halvings of the angle between two rays
LONG, BENT = 3.0, np.pi / 12  # chord over the mean of the first outline, and turn at its end, from which it is halved
RAY_SAMPLES = 32  # along a ray from the centre to the outline, and from there to the reach
DISTANT_SAMPLES = 12  # along a ray from the outline outwards, and inwards
DEEPEST = 0.5  # of the way from the outline to the centre, where the gap is looked at
NUDGE = 1e-6  # step to either side of the outline, over the reach
SLOPE_TOLERANCE, RATE_TOLERANCE = 1e-6, 1e-3  # of the gap's slope on the outline, and of its change across it
SMOOTH = "give a function that is smooth there, such as a distance, with a non-zero slope on its surface"
DISTANCE = "give a function that grows as the distance does, such as norm_2(point) - radius"


@dataclass(frozen=True, slots=True)
class Form:
    """A shape of a family about the origin, within a disc of radius ``reach`` [mm]."""

    family: Family
    sizes: tuple[float, ...]
    reach: float

    @property
    def law(self) -> GapLaw:
        """Gap law of the family."""
        return GapLaw("custom", self.family, POSE_SIZE + len(self.sizes), (4,))

    @held_signals()
    def values(self, points: np.ndarray) -> np.ndarray:
        """Return the family's function at points, ``(k, 2) → (k,)``."""
        return np.asarray(self.family.function(points.T, self.sizes)).ravel()

    @held_signals()
    def derivatives(self, points: np.ndarray) -> np.ndarray:
        """Return the gap, its slopes and its second derivatives xx, xy, yy at points, ``(k, 2) → (6, k)``."""
        return np.asarray(gap_function(self.law)(points.T, (0.0, 0.0, 1.0, 0.0, 0.0, *self.sizes)))


class Flaw(NamedTuple):
    """What is wrong with a shape, at which point of the family's coordinates, and what to do about it."""

    problem: str
    point: Point
    remedy: str


class Measures(NamedTuple):
    """Radius of the largest disc that an outline is known to hold, and that of the smallest which rolls along it."""

    inradius: float
    min_curvature_radius: float


@lru_cache(maxsize=256)
def trace_outline(form: Form) -> np.ndarray:
    """Return where rays from the centre leave a shape, ``(k, 2)``: more of them where the outline is far or bends."""
    rays = directions()
    outline = _leave(form, rays)
    for _ in range(REFINEMENTS):
        coarse = _is_coarse(outline)
        if not coarse.any():
            break
        middle = (rays + np.roll(rays, -1, axis=0))[coarse]
        middle /= np.linalg.norm(middle, axis=1)[:, None]
        after = np.flatnonzero(coarse) + 1
        rays = np.insert(rays, after, middle, axis=0)
        outline = np.insert(outline, after, _leave(form, middle), axis=0)
    return outline


def _leave(form: Form, rays: np.ndarray) -> np.ndarray:
    """Return where rays from the centre leave a shape, by bisection, ``(k, 2)``."""
    near, far = np.zeros(len(rays)), np.full(len(rays), form.reach)
    for _ in range(BISECTIONS):
        middle = (near + far) / 2
        outside = form.values(middle[:, None] * rays) > 0
        near, far = np.where(outside, near, middle), np.where(outside, middle, far)
    return np.asarray(far[:, None] * rays)


def _is_coarse(outline: np.ndarray) -> np.ndarray:
    """Return which chords, each from a point to the next, are long or end where the outline bends, ``(k,)``."""
    chords = np.roll(outline, -1, axis=0) - outline
    lengths = np.linalg.norm(chords, axis=1)
    before = np.roll(chords, 1, axis=0)
    bent = np.abs(np.arctan2(_cross(before, chords), (before * chords).sum(axis=1))) > BENT
    return np.asarray((lengths > LONG * lengths.sum() / len(directions())) | bent | np.roll(bent, -1))


@lru_cache(maxsize=256)
def find_flaw(form: Form) -> Flaw | None:
    """Return what keeps the gap of a shape from being a distance near its outline, ``None`` if nothing does."""
    outline = trace_outline(form)
    at = form.derivatives(outline)
    unbounded = ~np.isfinite(at).all(axis=0)
    if unbounded.any():
        return _flaw_at(outline, unbounded, "the gap or its slope is not finite", SMOOTH)
    normals, nudge = at[1:3], NUDGE * form.reach
    size = np.hypot(*normals)
    outer, inner = (form.derivatives(outline + side * nudge * normals.T)[0] for side in (1, -1))
    rate = (outer - inner) / (2 * nudge)
    for flawed, problem, remedy in (
        (np.abs(at[0]) > SLOPE_TOLERANCE * form.reach, "the function jumps", SMOOTH),
        (np.abs(size - 1) > SLOPE_TOLERANCE, "the gap does not grow as the distance does, its slope is not 1", SMOOTH),
        ((inner >= 0) | (outer <= 0), "the gap is not negative just inside and positive just outside", SMOOTH),
        (~(np.abs(rate - 1) <= RATE_TOLERANCE), "the gap does not change as its slope says", SMOOTH),
        (_curvature(at) * SHARPEST * form.reach > 1, "the outline has a corner", "round it"),
        (
            _crossed_again(form, outline),
            "the ray from the centre meets the outline more than once",
            "move the centre to where the whole outline can be seen, or compose the shape of several",
        ),
    ):
        if flawed.any():
            return _flaw_at(outline, flawed, problem, remedy)
    return None


@lru_cache(maxsize=256)
def find_distant_flaw(form: Form, farthest: float, deepest: float) -> Flaw | None:
    """Return where the gap is of no use farther from the outline, ``None`` if that is nowhere.

    Args:
        form: A shape whose outline has no flaw.
        farthest: Distance from the centre up to which it is looked at [mm].
        deepest: Depth up to which it is looked at, where that is not beyond half of the way to the centre [mm].
    """
    outline = trace_outline(form)
    radii = np.linalg.norm(outline, axis=1)
    parts = (np.arange(1, DISTANT_SAMPLES + 1) / DISTANT_SAMPLES)[:, None] ** 2  # closer to each other near the outline
    for side, ways, problem in (
        (1, np.maximum(farthest - radii, 0), "the gap is not positive and finite, with finite derivatives,"),
        (-1, np.minimum(deepest, DEEPEST * radii), "the gap is not negative and finite, with finite derivatives,"),
    ):
        points = ((1 + side * parts * ways / radii)[..., None] * outline).reshape(-1, 2)
        at = form.derivatives(points)
        flawed = ~(np.isfinite(at).all(axis=0) & (side * at[0] > 0))
        if flawed.any():
            return _flaw_at(points, flawed, problem, DISTANCE)
    return None


def _flaw_at(points: np.ndarray, flawed: np.ndarray, problem: str, remedy: str) -> Flaw:
    """Return the flaw at the first flawed point."""
    return Flaw(problem, tuple(points[int(flawed.argmax())].tolist()), remedy)


def _curvature(derivatives: np.ndarray) -> np.ndarray:
    """Return the size of the outline's curvature, from derivatives ``(6, k)`` of the gap on it, ``(k,)``."""
    _, x, y, xx, xy, yy = derivatives
    return np.asarray(np.abs(xx * y**2 - 2 * xy * x * y + yy * x**2))


def _crossed_again(form: Form, outline: np.ndarray) -> np.ndarray:
    """Return which rays from the centre cross the outline more than once, by samples inside and outside, ``(k,)``."""
    parts = np.arange(1, RAY_SAMPLES) / RAY_SAMPLES
    within = np.stack([form.values(part * outline) for part in parts])
    rim = form.reach / np.linalg.norm(outline, axis=1)[:, None] * outline
    beyond = np.stack([form.values(outline + part * (rim - outline)) for part in parts])
    return np.asarray((within >= 0).any(axis=0) | (beyond <= 0).any(axis=0))


@lru_cache(maxsize=256)
def measure_outline(form: Form) -> Measures:
    """Return the size of a shape.

    A disc that touches the outline from inside at one point grows until it meets the outline again: its centre is on
    the medial axis. The depth of these centres in the polygon of the outline, from which the kernel takes depths, is a
    lower bound on the radius of the largest disc in it.
    """
    outline = trace_outline(form)
    at = form.derivatives(outline)
    normals = at[1:3].T
    radii = np.minimum(_touching_radii(outline, normals), _thickness(outline, normals) / 2)
    inradius = distance_to_outline(outline, outline - radii[:, None] * normals).max()
    return Measures(float(inradius), float(min(1 / _curvature(at).max(), radii.min())))


def _touching_radii(outline: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the radii of the discs that touch an outline at each point from inside and hold no other point, (k,)."""
    apart = outline[:, None] - outline
    inwards = (apart * normals[:, None]).sum(axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        radii = np.where(inwards > 0, (apart**2).sum(axis=2) / (2 * inwards), np.inf)
    return np.asarray(radii.min(axis=1))


def _thickness(outline: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return how far the inward normal of each point of an outline is inside its polygon, ``(k,)``."""
    chords = np.roll(outline, -1, axis=0) - outline
    offset = outline - outline[:, None]  # from the point to where each chord begins
    with np.errstate(divide="ignore", invalid="ignore"):
        across = _cross(chords, normals[:, None])
        way, share = _cross(chords, offset) / across, _cross(normals[:, None], offset) / across
    count = np.arange(len(outline))
    own = (count[:, None] == count) | (count[:, None] == (count + 1) % len(outline))
    met = ~own & (share >= 0) & (share <= 1) & (way > 0)
    return np.asarray(np.where(met, way, np.inf).min(axis=1))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
