"""Prepare docstrings for the API reference, and check that it holds every public name."""

import importlib
import inspect
import re
from typing import Any

from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util import logging

import ccr_gym

PACKAGES = "solver", "solver.spatial", "ccr_gym", "agents"
LITERAL = re.compile(r"(``.*?``|:\w+:`.*?`|`.*?`)")
MARKUP = re.compile(r"([|*])")


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect both to the events of Sphinx."""
    app.connect("autodoc-process-docstring", prepare)
    app.connect("env-check-consistency", lambda app, env: check(env))
    return {"parallel_read_safe": True}


def prepare(app: Sphinx, what: str, name: str, thing: Any, options: object, lines: list[str]) -> None:
    """Refer to the page of an environment, and escape absolute values and stars, which are no markup here."""
    if inspect.isclass(thing) and thing in ccr_gym.ENV_IDS.values():
        ids = [env_id.split("/")[-1] for env_id, env_class in ccr_gym.ENV_IDS.items() if env_class is thing]
        lines[1:] = ["", "Pages: " + ", ".join(f":doc:`CCR/{name} </environments/{name}>`" for name in ids), ""]
        return
    lines[:] = ["".join(map(_escaped, LITERAL.split(line))) for line in lines]


def _escaped(part: str) -> str:
    """Return a part of a line with its stars and bars escaped, unless it is a literal or a role."""
    return part if part.startswith(("`", ":")) else MARKUP.sub(r"\\\1", part)


def check(env: BuildEnvironment) -> None:
    """Warn of public names that are missing."""
    known = env.get_domain("py").data["objects"]
    for package in PACKAGES:
        for name in importlib.import_module(package).__all__:
            if f"{package}.{name}" not in known:
                logging.getLogger(__name__).warning("%s.%s is public, but not in docs/api", package, name)
