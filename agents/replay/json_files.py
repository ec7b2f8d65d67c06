"""JSON files from elsewhere: read strictly, into plain values, with errors that fit in one line."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from agents.arguments import check_kind
from agents.errors import UserError

MOST_BYTES = 16 * 2**20  # of a file that is read; robots and scenes take a few kilobytes


def read_text(path: Path | str) -> str:
    """Return the text of a file.

    Raises:
        TypeError: If the path is none.
        OSError: If the file cannot be read.
        UserError: If it is too large, or is not UTF-8.
    """
    check_kind("path", path, (Path, str), "it must be a Path or a string")
    path = Path(path)
    try:
        if (size := path.stat().st_size) > MOST_BYTES:
            raise UserError(f"{path} has {size} bytes; at most {MOST_BYTES} are read")
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise UserError(f"{path} is not a text in UTF-8: {error.reason} at byte {error.start}") from error


def read_json(path: Path | str) -> object:
    """Return the value of a JSON file: strict JSON, without repeated names and without NaN.

    Raises:
        UserError: If the file is not such JSON.
    """
    try:
        return json.loads(read_text(path), object_pairs_hook=_unique, parse_constant=_refused)
    except json.JSONDecodeError as error:
        raise UserError(f"{path}, line {error.lineno}, column {error.colno}: {error.msg}") from error
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path}: {error}") from error


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object whose names are given once."""
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            raise ValueError(f"{name!r} is given twice; remove one")
        found[name] = value
    return found


def _refused(constant: str) -> float:
    raise ValueError(f"{constant} is not JSON; give a finite number")


def check_object(value: object, what: str) -> dict[str, Any]:
    """Return a JSON object.

    Raises:
        ValueError: If it is anything else.
    """
    if not isinstance(value, dict):
        raise ValueError(f"{what} is a JSON {_kind(value)}; it must be an object, {{…}}")
    return value


def check_names(given: Mapping[str, object], known: Iterable[str], what: str) -> None:
    """Check that an object has no unknown names.

    Raises:
        ValueError: Naming the unknown one, and those that are known.
    """
    known = list(known)
    for name in given:
        if name not in known:
            raise ValueError(f"{name!r} is not a field of {what}; its fields are {', '.join(known)}")


def _kind(value: object) -> str:
    kinds = {list: "array", str: "string", bool: "boolean", int: "number", float: "number", type(None): "null"}
    return kinds.get(type(value), "object")
