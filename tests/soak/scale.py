"""Scaling law: lengths × s, rigidities × s², springs and weight per length × 1/s leave forces and angles unchanged."""

from dataclasses import replace
from functools import singledispatch

import numpy as np

from solver import Capsule, Circle, Custom, Ellipse, HalfPlane, Obstacle, Polygon, Robot, Scene, spatial

VANISHING = 1e-290  # smaller numbers have fewer bits and do not scale exactly
DIRECTIONS = ("normal", "axis", "second")
CABLE_POWERS = {
    "objective": 0,
    "nodes": None,  # points and, in the plane, angles
    "multipliers": -1,
    "disk_multipliers": -1,
    "cables_mm": 1,
    "tensions": 0,
    "gaps": 1,
    "displacements": 1,
    "forces": 0,
    "length_mm": 1,
}
PLANAR_POWERS = {**CABLE_POWERS, "cable_mm": 1, "tension": 0, "shear": 0, "onset_tension": 0}
SPATIAL_POWERS = {**CABLE_POWERS, "controls": 0, "frames": 0, "onset_tensions": 0}


def times(point, s):
    """Return a point, pair or range times a factor; None stays None."""
    return None if point is None else tuple(s * value for value in point)


def scale_robot(robot, s):
    """Return the robot s times as large, with the same tensions and forces."""
    lengths = {
        "length_mm": s * robot.length_mm,
        "offset_mm": s * robot.offset_mm,
        "max_cable_mm": s * robot.cable_limit_mm,
    }
    if isinstance(robot, Robot):
        lengths |= {"length_range_mm": times(robot.length_range_mm, s)}
    if isinstance(robot, Robot) or robot.model == "rod":
        lengths |= {"disk_radius_mm": s * robot.edge_mm, "disk_thickness_mm": s * robot.disk_thickness_mm}
    rigidities = {"rigidity": s * s * robot.rigidity, "segment_rigidity": times(robot.segment_rigidity, s * s)}
    return replace(robot, **lengths, **rigidities, **_rod_parts(robot, s))


def _rod_parts(robot, s):
    """Return cables and loads of a rod s times as large; none in the paper's model."""
    if robot.model != "rod":
        return {}
    return {
        "cables": tuple(replace(c, offset_mm=None if c.offset_mm is None else s * c.offset_mm) for c in robot.cables),
        "weight_per_length": times(robot.weight_per_length, 1 / s),
        "loads": tuple(replace(o, moment=s * o.moment, at=(s * o.at[0], o.at[1])) for o in robot.loads),
    }


def scale_scene(scene, s):
    """Return the obstacles s times as large and as far away, on springs 1/s times as stiff."""
    return Scene(scale_obstacle(obstacle, s) for obstacle in scene)


def scale_obstacle(obstacle, s):
    """Return an obstacle s times as large and as far away; sizes of a custom shape must all be lengths."""
    matrix = obstacle.spring and tuple(times(row, 1 / s) for row in obstacle.spring)
    scaled = replace(obstacle, spring=matrix, **_lengths(obstacle, s))
    for direction in DIRECTIONS:  # normalised once more on construction, which may change their last bits
        if hasattr(obstacle, direction):
            object.__setattr__(scaled, direction, getattr(obstacle, direction))
    return scaled


@singledispatch
def _lengths(obstacle: Obstacle, s):
    raise TypeError(f"{obstacle!r} has no scaling law")


@_lengths.register(Circle)
@_lengths.register(spatial.Sphere)
def _(obstacle, s):
    return {"center": times(obstacle.center, s), "radius": s * obstacle.radius}


@_lengths.register(HalfPlane)
@_lengths.register(spatial.HalfSpace)
def _(obstacle, s):
    return {"point": times(obstacle.point, s)}


@_lengths.register
def _(obstacle: Ellipse, s):
    return {"center": times(obstacle.center, s), "radii": times(obstacle.radii, s)}


@_lengths.register(Capsule)
@_lengths.register(spatial.Capsule)
def _(obstacle, s):
    return {"start": times(obstacle.start, s), "end": times(obstacle.end, s), "radius": s * obstacle.radius}


@_lengths.register
def _(obstacle: Polygon, s):
    return {"corners": tuple(times(corner, s) for corner in obstacle.corners), "radius": s * obstacle.radius}


@_lengths.register
def _(obstacle: Custom, s):
    return {"center": times(obstacle.center, s), "sizes": times(obstacle.sizes, s), "reach": s * obstacle.reach}


@_lengths.register
def _(obstacle: spatial.Cylinder, s):
    ends = {"start": times(obstacle.start, s), "end": times(obstacle.end, s)}
    return {**ends, "radius": s * obstacle.radius, "edge": s * obstacle.edge}


@_lengths.register
def _(obstacle: spatial.Box, s):
    return {"center": times(obstacle.center, s), "sizes": times(obstacle.sizes, s), "edge": s * obstacle.edge}


def natural(states, s=1.0):
    """Return the numbers of states of a robot scaled by s, by name, ``(T, ...)``, converted to the robot at s = 1.

    With s a power of two the division is exact, so the law is true to the last bit of every number that does not
    vanish.
    """
    planar = isinstance(states[0].robot, Robot)
    powers = PLANAR_POWERS if planar else SPATIAL_POWERS
    values = {name: np.array([getattr(state, name) for state in states]) for name in powers}
    nodes = values.pop("nodes")
    numbers = {name: value / s ** powers[name] for name, value in values.items()}
    numbers |= {"points": nodes[..., :2] / s, "angles": nodes[..., 2]} if planar else {"points": nodes / s}
    return {name: np.where(np.abs(value) < VANISHING, 0.0, value) for name, value in numbers.items()}
