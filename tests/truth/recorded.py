"""Paths of the rod by an independent program (tests/data/rod), and the package's states on them."""

import json
from pathlib import Path

import numpy as np

from truth import robots

FOLDER = Path(__file__).parents[1] / "data" / "rod"
RECORDED = {path.stem: json.loads(path.read_text()) for path in sorted(FOLDER.glob("*.json"))}


def pulls_along(spec, increments):
    """Return the pulls of every increment, (increments, cables), and the parameter t of each.

    All legs of ``start → path[0] → path[1] …`` take the same share of t.
    """
    corners = np.array([spec.get("start", np.zeros(len(spec["cables"]))), *spec["path"]])
    times = np.arange(1, increments + 1) / increments
    legs = np.linspace(0, 1, len(corners))
    return times, np.column_stack([np.interp(times, legs, column) for column in corners.T])


def approach(spec):
    """Return the pulls from rest to the path's start."""
    return [np.array(spec["start"]) * k / 20 for k in range(1, 21)] if "start" in spec else []


def read_states(recorded):
    """Return the package's states beside those recorded."""
    spec = recorded["spec"]
    before = approach(spec)
    times, pulls = pulls_along(spec, recorded["followed"]["increments"])
    equilibria = list(robots.follow(spec, [*before, *pulls]))[len(before) :]
    for state in recorded["states"]:
        (k,) = np.flatnonzero(np.isclose(times, state["t"], rtol=0, atol=1e-12))
        assert np.allclose(pulls[k], state["pulls"], rtol=0, atol=1e-12)
        yield state, equilibria[k]
