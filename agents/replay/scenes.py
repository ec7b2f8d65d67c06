"""Scenes as JSON: a list of obstacles, each with the name of its shape and the fields of its class."""

import json
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import solver
from agents.arguments import check_kind
from agents.errors import UserError
from agents.replay.json_files import check_names, check_object, read_json
from agents.replay.robots import AnyRobot, changed_fields, check_robot
from solver import Obstacle, Robot, Scene, Solver, spatial
from solver.spatial import SpatialSolver

PLANAR = ("Circle", "HalfPlane", "Ellipse", "Capsule", "Polygon")
SPATIAL = ("Sphere", "HalfSpace", "Capsule", "Cylinder", "Box")


def read_scene(path: Path | str, robot: AnyRobot) -> Scene:
    """Return the scene of a JSON file, for a robot that must fit between its obstacles.

    Raises:
        TypeError: If the robot or the path is none.
        UserError: If the file does not describe obstacles that the robot can be put among.
    """
    check_robot(robot)
    planar = isinstance(robot, Robot)
    try:
        scene = scene_of(read_json(path), planar=planar)
        Solver(robot, scene) if isinstance(robot, Robot) else SpatialSolver(robot, scene)
    except UserError:
        raise
    except (ValueError, TypeError) as error:
        raise UserError(f"{path}: {error}") from error
    return scene


def scene_of(value: object, *, planar: bool) -> Scene:
    """Return the scene that a JSON value describes.

    Args:
        value: An array of objects. ``"shape"`` names the class of an obstacle, the other names are its fields.
        planar: Whether the obstacles are of the plane.

    Raises:
        ValueError: If a shape or a name is unknown, or a value out of range.
        TypeError: As the obstacles.
    """
    if not isinstance(value, list) or not value:
        raise ValueError("a scene must be an array of at least one obstacle, [{…}, …]")
    return Scene([_obstacle(entry, f"obstacle {index}", planar) for index, entry in enumerate(value)])


def _obstacle(value: object, what: str, planar: bool) -> Obstacle:
    given = dict(check_object(value, what))
    shape, known = given.pop("shape", None), PLANAR if planar else SPATIAL
    if not (isinstance(shape, str) and shape in known):
        raise ValueError(f"shape of {what} is {shape!r}; it must be one of {', '.join(known)}")
    kind: Any = getattr(solver if planar else spatial, shape)
    named = f"{'an' if shape[0] in 'AEIOU' else 'a'} {shape}"
    check_names(given, [field.name for field in fields(kind)], f"{what}, {named}")
    for field in fields(kind):
        if field.default is MISSING and field.name not in given:
            raise ValueError(f"{field.name} of {what}, {named}, is missing")
    try:
        obstacle: Obstacle = kind(**given)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{what}, {named}: {error}") from error
    return obstacle


def scene_json(scene: Scene) -> str:
    """Return the JSON of a scene, from which :func:`scene_of` makes an equal one.

    Raises:
        TypeError: If it is no scene.
        ValueError: If an obstacle is a custom shape, which is an expression and not data.
    """
    check_kind("scene", scene, Scene, "it must be a Scene")
    for obstacle in scene:
        if type(obstacle).__name__ not in (*PLANAR, *SPATIAL):
            raise ValueError(f"{type(obstacle).__name__} cannot be written as JSON; take one of {PLANAR + SPATIAL}")
    return json.dumps([{"shape": type(entry).__name__, **changed_fields(entry)} for entry in scene], indent=2)
