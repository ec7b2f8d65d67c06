"""The package's robots from plain descriptions: the one place of these tests that knows its constructors.

A description is a mapping as in tests/data/rod (README there), where an obstacle may also name the ``nodes`` that can
touch it. :func:`missing` names what the package cannot build, from the fields of its robots, so that a test skipped for
it runs by itself once the field exists.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np
import pytest

import solver
from solver import spatial

Spec = Mapping[str, Any]
PLANE, SPACE = ({field.name for field in fields(robot)} for robot in (solver.Robot, spatial.SpatialRobot))
if hasattr(solver, "Load"):
    PLANE, SPACE = (known | {f"loads.{field.name}" for field in fields(solver.Load)} for known in (PLANE, SPACE))


class Reading(NamedTuple):
    """What is compared of a state: places (n+1, d) [mm], disk angles or frames, tensions [N], obstacle forces [N]."""

    places: np.ndarray
    frames: np.ndarray
    tensions: np.ndarray
    forces: np.ndarray


def plane(n: int, **changes: Any) -> dict[str, Any]:
    """Return the description of the paper's prototype in n segments, free, with one cable, or with changes."""
    return {
        "space": False,
        "n": n,
        "segment_mm": [180.0 / n] * n,
        "EI": [5000.0] * n,
        "cables": [{"offset": 8.0, "angle": 0.0, "end": n}],
        "touch": [{"offset": 0.0, "angle": 0.0}, {"offset": 8.0, "angle": 0.0}],
        "obstacles": [],
        **changes,
    }


def space(n: int, *angles: float, torsion_ratio: float = 0.75, **changes: Any) -> dict[str, Any]:
    """Return the description of a prototype in space in n segments, free, with cables at angles, or with changes.

    Backbone and four points of the edge can touch.
    """
    cables = [{"offset": 8.0, "angle": angle, "end": n} for angle in angles]
    edge = [{"offset": 8.0, "angle": k * math.pi / 2} for k in range(4)]
    spatial_robot = {"space": True, "GJ": [5000.0 * torsion_ratio] * n, "cables": cables}
    return plane(n, **{**spatial_robot, "touch": [{"offset": 0.0, "angle": 0.0}, *edge], **changes})


def require(spec: Spec) -> Spec:
    """Return a description that the package can build; skip the test if it cannot."""
    if reason := missing(spec):
        pytest.skip(reason)
    return spec


def missing(spec: Spec) -> str:
    """Return what the package's robots lack to build a description, empty if nothing."""
    known, needed = (SPACE, _needs_in_space(spec)) if spec["space"] else (PLANE, _needs(spec))
    lacking = sorted(name for name in needed - known if name.split(".")[0] == name or "loads" in known)
    return f"robots of {'space' if spec['space'] else 'the plane'} have no {', '.join(lacking)}" if lacking else ""


def make_solver(spec: Spec) -> Any:
    """Return the package's solver of a description."""
    scene = solver.Scene(_obstacle(obstacle) for obstacle in spec["obstacles"])
    if spec["space"]:
        return spatial.SpatialSolver(spatial.SpatialRobot(**_robot(spec), **_torsion(spec)), scene)
    return solver.Solver(solver.Robot(**_robot(spec)), scene)


def command(spec: Spec, pulls: np.ndarray) -> Any:
    """Return pulls as the solver takes them: a number for the default cable, else one a cable."""
    return float(pulls[0]) if _has_default_cable(spec) else tuple(map(float, pulls))


def follow(spec: Spec, pulls: Iterator[np.ndarray] | list[np.ndarray]) -> Iterator[Any]:
    """Yield the package's equilibria along pulls, from rest on; each step must reach its command."""
    robot = make_solver(spec)
    equilibrium = robot.rest()
    for target in pulls:
        equilibrium = robot.step(equilibrium, command(spec, target))
        assert equilibrium.status in (solver.Status.CONVERGED, solver.Status.SNAPPED), (equilibrium, target)
        yield equilibrium


def pulled(spec: Spec, *pulls: float, steps: int = 20) -> Any:
    """Return the package's equilibrium after a straight pull from rest in equal steps."""
    *_, equilibrium = follow(spec, [np.array(pulls) * k / steps for k in range(1, steps + 1)])
    return equilibrium


def read(equilibrium: Any) -> Reading:
    """Return what is compared of an equilibrium."""
    nodes = equilibrium.nodes
    if isinstance(equilibrium, spatial.SpatialEquilibrium):
        return Reading(nodes, equilibrium.frames, np.asarray(equilibrium.tensions), equilibrium.forces)
    tensions = equilibrium.tensions if hasattr(equilibrium, "tensions") else [equilibrium.tension]
    return Reading(nodes[:, :2], nodes[:, 2], np.asarray(tensions), equilibrium.forces)


def normal_forces(equilibrium: Any) -> np.ndarray:
    """Return the normal force of every point that can touch, (obstacles, points, positions) [N]."""
    return np.asarray(equilibrium.energy_scale * equilibrium.multipliers)


def _has_default_cable(spec: Spec) -> bool:
    """Whether the one cable of a robot is that of the plane's default: at angle 0, up to the tip."""
    cables = spec["cables"]
    return not spec["space"] and [(cable["angle"], cable["end"]) for cable in cables] == [(0, spec["n"])]


def _needs(spec: Spec) -> set[str]:
    """Return the fields that a description needs beside those every robot has."""
    needed = {name for name in ("weight_per_length", "precurvature") if np.any(spec.get(name, 0))}
    for load in spec.get("loads", []):
        needed |= {"loads", *(f"loads.{name}" for name in load if np.any(load[name]))}
    return needed | {"model"} | (set() if _has_default_cable(spec) else {"cables"})


def _needs_in_space(spec: Spec) -> set[str]:
    return _needs(spec) | {"torsion_ratio"}


def _robot(spec: Spec) -> dict[str, Any]:
    """Return the keyword arguments that a robot of the plane and one of space share."""
    count, offset = spec["n"], max(cable["offset"] for cable in spec["cables"])
    assert np.allclose(spec["segment_mm"], spec["segment_mm"][0]), "robots have segments of equal length"
    arguments = {
        "model": "rod",
        "length_mm": math.fsum(spec["segment_mm"]),
        "segments": count,
        "offset_mm": offset,
        "rigidity": float(np.mean(spec["EI"])),
        "max_tension": math.inf,
        **_touch(spec, offset),
        **_disks(spec, offset),
    }
    if np.ptp(spec["EI"]):
        arguments["segment_rigidity"] = tuple(spec["EI"])
    if not _has_default_cable(spec):
        arguments["cables"] = tuple(_cable(cable, count) for cable in spec["cables"])
    if np.any(spec.get("weight_per_length", 0)):
        arguments["weight_per_length"] = tuple(spec["weight_per_length"])
    if spec.get("loads"):
        arguments["loads"] = tuple(_load(load) for load in spec["loads"])
    if np.any(spec.get("precurvature", 0)):
        arguments["precurvature"] = tuple(np.array(spec["precurvature"]).tolist())
    return arguments


def _disks(spec: Spec, offset: float) -> dict[str, Any]:
    """Return disks so wide that they would meet before an obstacle could slip between the points of two nodes.

    The described robots have no disks, so these must be at rest in what is compared. Robots refuse such obstacles
    otherwise.
    """
    segment = spec["segment_mm"][0]
    gaps = [2 * obstacle["radius"] - segment for obstacle in spec["obstacles"] if "radius" in obstacle]
    widest = 0.97 * min(gaps, default=math.inf) / offset  # angle between neighbouring disks
    known = SPACE if spec["space"] else PLANE
    return {"disk_radius_mm": segment / widest} if widest < segment / offset and "disk_radius_mm" in known else {}


def _torsion(spec: Spec) -> dict[str, Any]:
    return {"torsion_ratio": _each(np.divide(spec["GJ"], spec["EI"]).tolist())}


def _each(values: list[float]) -> Any:
    """Return one number for all segments where they are equal, else one a segment."""
    return values[0] if np.ptp(values) < 1e-12 * np.max(values) else tuple(values)


def _touch(spec: Spec, offset: float) -> dict[str, Any]:
    """Return the lines that touch: backbone, and points of the edge at even angles from 0 on."""
    edge = sorted(point["angle"] for point in spec["touch"] if point["offset"] > 0)
    assert all(point["offset"] in (0, offset) for point in spec["touch"])
    lines = ("backbone",) if any(point["offset"] == 0 for point in spec["touch"]) else ()
    if not spec["space"]:
        sides = {0: "cable", 1: "rim"}
        return {"touch": (*lines, *(sides[round(angle / math.pi)] for angle in edge))}
    if not edge:
        return {"touch": lines}
    assert np.allclose(edge, 2 * math.pi / len(edge) * np.arange(len(edge))), "points of the edge are even"
    return {"touch": (*lines, "rim"), "rim_points": len(edge)}


def _cable(cable: Mapping[str, Any], count: int) -> Any:
    end = None if cable["end"] == count else cable["end"]
    return solver.Cable(angle=cable["angle"], offset_mm=cable["offset"], end=end)


def _load(load: Mapping[str, Any]) -> Any:
    arguments = {"node": load["node"], "force": tuple(load["force"])}
    if load.get("moment"):
        arguments["moment"] = load["moment"]
    if "at" in load:
        arguments["at"] = (load["at"]["offset"], load["at"]["angle"])
    return solver.Load(**arguments)


def _obstacle(obstacle: Mapping[str, Any]) -> Any:
    nodes = {"nodes": obstacle.get("nodes")}
    if obstacle["kind"] in ("circle", "sphere"):
        kind = solver.Circle if obstacle["kind"] == "circle" else spatial.Sphere
        return kind(center=obstacle["center"], radius=obstacle["radius"], **nodes)
    normal = np.array(obstacle["normal"])
    kind = solver.HalfPlane if normal.size == 2 else spatial.HalfSpace
    return kind(point=tuple(obstacle["offset"] * normal), normal=tuple(normal), **nodes)
