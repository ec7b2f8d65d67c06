"""States of the rod by an independent program (tests/data/rod), followed by the package along the same pulls."""

import math

import numpy as np
import pytest
from scipy.linalg import expm
from truth import robots
from truth.recorded import RECORDED, read_states

LENGTH_TOLERANCE, FORCE_TOLERANCE = 1e-8, 1e-7  # over the robot's length; over EI/L² and EI/(aL)


@pytest.mark.parametrize("name", RECORDED)
def test_states_are_those_recorded(name):
    recorded = RECORDED[name]
    spec = robots.require(recorded["spec"])
    length, offset, rigidity = sum(spec["segment_mm"]), spec["cables"][0]["offset"], np.mean(spec["EI"])
    for state, equilibrium in read_states(recorded):
        found, frames = robots.read(equilibrium), state["rotations"] if spec["space"] else state["phi"]
        assert found.places == pytest.approx(np.array(state["positions"]), rel=0, abs=LENGTH_TOLERANCE * length)
        assert found.frames == pytest.approx(np.array(frames), rel=0, abs=LENGTH_TOLERANCE)
        unit = rigidity / (offset * length)
        assert found.tensions == pytest.approx(np.array(state["tensions"]), rel=0, abs=FORCE_TOLERANCE * unit)
        forces = np.reshape(state["obstacle_forces"], found.forces.shape)
        assert found.forces == pytest.approx(forces, rel=0, abs=FORCE_TOLERANCE * rigidity / length**2)


def exponential(turn):
    """Return the rotation of a rotation vector."""
    x, y, z = turn
    return expm(np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]))


def shape(spec, state):
    """Return places and frames in space by the conventions of tests/data/rod/README.md; the plane is its x–z plane."""
    turns = state["u"] if spec["space"] else [[0, theta, 0] for theta in state["theta"]]
    places, frames = [np.zeros(3)], [np.eye(3)]
    for turn, segment in zip(turns, spec["segment_mm"], strict=True):
        chord = segment * np.sinc(math.hypot(*turn[:2]) / (2 * math.pi))
        places.append(places[-1] + frames[-1] @ exponential(np.array(turn) / 2) @ [0, 0, chord])
        frames.append(frames[-1] @ exponential(turn))
    return np.array(places), np.array(frames)


def hole(point):
    return point["offset"] * np.array([math.cos(point["angle"]), math.sin(point["angle"]), 0.0])


@pytest.mark.parametrize("name", RECORDED)
def test_files_follow_their_conventions(name):
    """Shapes, cable lengths and forces follow from the unknowns and multipliers as the README there says."""
    spec = RECORDED[name]["spec"]
    seen = slice(None) if spec["space"] else slice(None, None, 2)
    for state in RECORDED[name]["states"]:
        places, frames = shape(spec, state)
        assert places[:, seen] == pytest.approx(np.array(state["positions"]), abs=1e-10)
        if spec["space"]:
            assert frames == pytest.approx(np.array(state["rotations"]), abs=1e-12)
        cables = zip(spec["cables"], state["pulls"], state["tensions"], state["slack_mm"], strict=True)
        for cable, pull, tension, slack in cables:
            line = (places + frames @ hole(cable))[: cable["end"] + 1]
            length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
            assert length + pull + slack == pytest.approx(sum(spec["segment_mm"][: cable["end"]]), abs=1e-10)
            assert tension >= 0
            assert tension * slack == pytest.approx(0, abs=1e-9)
        total = np.zeros(np.shape(state["obstacle_forces"]))
        for contact in state["contacts"]:
            point = (places + frames @ hole(spec["touch"][contact["touch"]]))[contact["node"]][seen]
            assert point == pytest.approx(np.array(contact["point"]), abs=1e-10)
            total[contact["obstacle"]] += contact["normal_force"] * outward(
                spec["obstacles"][contact["obstacle"]], point
            )
        assert total == pytest.approx(np.array(state["obstacle_forces"]), abs=1e-10)


def outward(obstacle, point):
    """Return the gap's gradient at a point of the surface, which it checks to be one."""
    if obstacle["kind"] == "wall":
        assert point @ obstacle["normal"] == pytest.approx(obstacle["offset"], abs=1e-8)
        return np.array(obstacle["normal"])
    away = point - obstacle["center"]
    assert np.linalg.norm(away) == pytest.approx(obstacle["radius"], abs=1e-8)
    return away / obstacle["radius"]
