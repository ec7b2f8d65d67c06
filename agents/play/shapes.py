"""Robot and contacts of an equilibrium in the units of the page; see :mod:`agents.play.frame`."""

import numpy as np
from scipy.spatial.transform import Rotation

from agents.play.frame import Contacts, Shape
from ccr_gym import Scales
from solver import Equilibrium
from solver.spatial import SpatialEquilibrium

AnyEquilibrium = Equilibrium | SpatialEquilibrium

SHOWN_FORCE = 4.0  # that fills the scale of multipliers, and whose arrow is ARROW long [EI/L²]
ARROW = 0.3  # [L]
LONGEST_ARROW = 0.6  # [L]
ASIDE = 0.015  # by which the arrows of both forces stand to either side of the contact [L]
SLACK = 1e-9  # tension of a slack cable, over EI/(aL)


def to_page(points_mm: np.ndarray, length_mm: float) -> np.ndarray:
    """Return points or vectors of the plane, ``(..., 2)``, or of space, ``(..., 3)``, in the page, ``(..., 3)`` [L]."""
    points = np.asarray(points_mm, float) / length_mm
    if points.shape[-1] == 3:
        return points
    return np.stack([points[..., 0], np.zeros(points.shape[:-1]), points[..., 1]], axis=-1)


def to_robot(point: np.ndarray, length_mm: float, space: int) -> tuple[float, ...]:
    """Return a point of the page ``(3,)`` in the plane or in space [mm]; the inverse of :func:`to_page`."""
    x, y, z = (length_mm * float(value) for value in point)
    return (x, z) if space == 2 else (x, y, z)


def shape_of(equilibrium: AnyEquilibrium, scales: Scales) -> Shape:
    """Return the robot."""
    taut = equilibrium.tensions > SLACK * scales.tension_n
    pulled = to_page(equilibrium.pulled, scales.length_mm)
    segments = equilibrium.robot.segments
    pieces, carries = [], []
    for path, tight, cable in zip(pulled, taut.tolist(), equilibrium.robot.cables, strict=True):
        end = getattr(cable, "end", None) or segments
        pieces.append(np.stack([path[:end], path[1 : end + 1]], axis=1))
        carries += [tight] * end
    nodes = to_page(equilibrium.nodes[:, : equilibrium.forces.shape[1]], scales.length_mm)
    return Shape(nodes, _quaternions(equilibrium), np.concatenate(pieces), np.array(carries))


def contacts_of(
    equilibrium: AnyEquilibrium, true: np.ndarray, estimate: np.ndarray, target: int | None, scales: Scales
) -> Contacts:
    """Return the contacts, with arrows of what the robot exerts on the obstacles.

    Args:
        equilibrium: The robot among its obstacles.
        true: True force on the robot, ``(d,)`` [N].
        estimate: Its estimate.
        target: Index of the obstacle that both forces are of; ``None`` for the sum over all.
        scales: Scales of the page.
    """
    multipliers = equilibrium.multipliers
    sizes = multipliers.sum(axis=0)
    points = to_page(equilibrium.points, scales.length_mm)[sizes > 0]
    weights = sizes[sizes > 0]
    levels = equilibrium.energy_scale * weights / (SHOWN_FORCE * scales.force_n)
    touched = frozenset(np.flatnonzero((multipliers > 0).any(axis=(1, 2))).tolist())
    tail = _tail(equilibrium, target, scales)
    arrows = (_arrow(tail, -force, side * ASIDE, scales) for force, side in ((true, -1), (estimate, 1)))
    return Contacts(points, levels, touched, *arrows)


def _tail(equilibrium: AnyEquilibrium, target: int | None, scales: Scales) -> np.ndarray | None:
    """Return where the arrows of forces start, the mean contact point of one or all obstacles, ``(3,)`` [L]."""
    chosen = slice(None) if target is None else slice(target, target + 1)
    weights = equilibrium.multipliers[chosen].sum(axis=0)
    if not weights.any():
        return None
    points = to_page(equilibrium.points, scales.length_mm)
    return np.asarray(np.tensordot(weights / weights.sum(), points, axes=weights.ndim))


def _arrow(tail: np.ndarray | None, force: np.ndarray, aside: float, scales: Scales) -> np.ndarray:
    """Return tail and head of the arrow of a force, ``(2, 3)``, moved to its side and in the plane before the robot."""
    vector = ARROW / (SHOWN_FORCE * scales.force_n) * to_page(force, 1.0)
    size = float(np.linalg.norm(vector))
    if size == 0 or tail is None:
        return np.zeros((2, 3))
    vector *= min(1.0, LONGEST_ARROW / size)
    side = np.array([vector[2], 0.0, -vector[0]]) / max(float(np.hypot(vector[0], vector[2])), 1e-9 * size)
    start = tail + aside * side
    return np.stack([start, start + vector])


def _quaternions(equilibrium: AnyEquilibrium) -> np.ndarray:
    """Return the orientation of each disk, ``(n+1, 4)``; in the plane a disk turns about −y of the page."""
    if isinstance(equilibrium, SpatialEquilibrium):
        turns = Rotation.from_matrix(equilibrium.frames)
    else:
        turns = Rotation.from_euler("y", -equilibrium.nodes[:, 2:])
    return np.asarray(np.roll(turns.as_quat(), 1, axis=-1))
