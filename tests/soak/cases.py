"""Cases that reproduce the findings of a soak: stored as JSON, shrunk and replayed."""

import time
from typing import Any

import numpy as np

import solver
from soak.checks import check
from soak.report import Tally
from soak.scenes import make_solver
from soak.walks import replay
from solver import Scene, spatial

SECONDS = 15  # of processor time to shrink a case


def load(case: dict[str, Any]):
    """Return robot, scene and commands of a case."""
    names = vars(solver) | {"SpatialRobot": spatial.SpatialRobot, "np": np, "inf": np.inf}
    if case["robot"].startswith("Spatial"):
        names |= vars(spatial)
    robot = eval(case["robot"], dict(names))
    return robot, Scene(eval(text, dict(names)) for text in case["scene"]), np.array(case["commands"])


def find(case):
    """Return all findings of a case, played from rest."""
    robot, scene, commands = load(case)
    solver = make_solver(robot, scene)
    return check(solver, replay(solver, commands), Tally())


def shrink(case):
    """Return the case with fewer obstacles and commands, as far as some seconds allow."""
    if "commands" not in case:  # an episode that raised an error
        return case
    end = time.process_time() + SECONDS
    case = _without(case, "scene", end, chunk=1)
    chunk = len(case["commands"]) // 2
    while chunk:
        case = _without(case, "commands", end, chunk)
        chunk //= 2
    return case | {"step": len(case["commands"]) - 1}


def _without(case, name, end, chunk):
    """Drop entries of a list that the case does not need, ``chunk`` of them at a time."""
    k = 0
    while k < len(case[name]) and time.process_time() < end:
        smaller = case | {name: case[name][:k] + case[name][k + chunk :]}
        if _shows(smaller, case["kind"]):
            case = smaller
        else:
            k += chunk
    return case


def _shows(case, kind):
    """Return whether a smaller case still shows a kind of finding, at its last step."""
    if not case["commands"]:
        return False
    try:
        return any(finding.kind == kind and finding.step == len(case["commands"]) - 1 for finding in find(case))
    except ValueError:  # a command out of range
        return False
