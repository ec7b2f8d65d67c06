"""Robots as JSON: the fields of a robot, or the name of a preset with the fields that differ from it."""

import json
import math
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from agents.arguments import check_kind
from agents.errors import UserError
from agents.replay.json_files import check_names, check_object, read_json
from solver import Cable, Load, Robot
from solver.spatial import SpatialRobot

AnyRobot = Robot | SpatialRobot
KINDS: dict[str, type[AnyRobot]] = {"plane": Robot, "space": SpatialRobot}
PARTS: dict[str, type[Cable] | type[Load]] = {"cables": Cable, "loads": Load}  # fields that hold objects
NO_LIMIT = {"max_tension"}  # fields in which null stands for infinity


def read_robot(path: Path | str) -> AnyRobot:
    """Return the robot of a JSON file.

    Raises:
        UserError: If the file does not describe a valid robot.
    """
    try:
        return robot_of(read_json(path))
    except UserError:
        raise
    except (ValueError, TypeError) as error:
        raise UserError(f"{path}: {error}") from error


def robot_of(value: object) -> AnyRobot:
    """Return the robot that a JSON value describes.

    Args:
        value: An object with the fields of :class:`solver.Robot`, or of :class:`solver.spatial.SpatialRobot` with
            ``"space": "space"``. With ``"preset"`` only the fields that differ from the preset are given. ``null`` as
            ``max_tension`` lifts the limit.

    Raises:
        ValueError: If a name is unknown or a value out of range.
        TypeError: As the robot.
    """
    given = dict(check_object(value, "a robot"))
    space, preset = given.pop("space", "plane"), given.pop("preset", None)
    if not (isinstance(space, str) and space in KINDS):
        raise ValueError(f"space is {space!r}; it must be one of {', '.join(KINDS)}")
    kind = KINDS[space]
    check_names(given, [field.name for field in fields(kind)], f"{kind.__name__} (or space, or preset)")
    values: dict[str, Any] = {name: _decoded(name, entry) for name, entry in given.items()}
    if preset is not None:
        return kind.preset(preset, **values)
    for field in fields(kind):
        if field.default is MISSING and field.name not in values:
            raise ValueError(f"{field.name} is missing; give it, or name a preset")
    return kind(**values)


def check_robot(robot: object) -> None:
    """Check that an object is a robot.

    Raises:
        TypeError: If it is anything else.
    """
    check_kind("robot", robot, (Robot, SpatialRobot), "it must be a Robot or a SpatialRobot")


def _decoded(name: str, value: object) -> object:
    if name in NO_LIMIT and value is None:
        return math.inf
    if name not in PARTS:
        return value
    if not isinstance(value, list):
        raise ValueError(f"{name} must be an array of objects")
    return tuple(_part(PARTS[name], entry, f"entry {index} of {name}") for index, entry in enumerate(value))


def _part(kind: type[Cable] | type[Load], value: object, what: str) -> Cable | Load:
    given = check_object(value, what)
    check_names(given, [field.name for field in fields(kind)], what)
    for field in fields(kind):
        if field.default is MISSING and field.name not in given:
            raise ValueError(f"{field.name} of {what} is missing")
    return kind(**given)


def robot_json(robot: AnyRobot) -> str:
    """Return the JSON of a robot, from which :func:`robot_of` makes an equal one.

    Raises:
        TypeError: If it is no robot.
    """
    check_robot(robot)
    space = "plane" if isinstance(robot, Robot) else "space"
    return json.dumps({"space": space, **changed_fields(robot)}, indent=2)


def changed_fields(instance: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that differ from their defaults, as JSON values."""
    values = {field.name: (getattr(instance, field.name), field.default) for field in fields(instance)}
    return {name: _encoded(value) for name, (value, default) in values.items() if value != default}


def _encoded(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_encoded(entry) for entry in value]
    if isinstance(value, Cable | Load):
        return changed_fields(value)
    return None if value == math.inf else value
