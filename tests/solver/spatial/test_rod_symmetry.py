"""The rod in space against itself: turned about the base axis, and against the rod of the plane."""

import math

import numpy as np
import pytest
from truth import robots

THIRDS = 2 * math.pi * np.arange(3) / 3
BACKBONE = [{"offset": 0.0, "angle": 0.0}]


@pytest.mark.parametrize("angle", [0.4, 2.0, -2.7])
def test_turning_robot_and_scene_turns_the_state(angle):
    cosine, sine = math.cos(angle), math.sin(angle)
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    center, pulls = np.array([30.0, 9.0, 110.0]), (6.0, 1.0, -8.0)

    def state(by, turned):
        sphere = {"kind": "sphere", "center": (turned @ center).tolist(), "radius": 15.0}
        spec = robots.space(18, *(THIRDS + by), touch=BACKBONE, obstacles=[sphere])
        return robots.read(robots.pulled(robots.require(spec), *pulls))

    first, second = state(0.0, np.eye(3)), state(angle, turn)
    assert np.linalg.norm(first.forces) > 0.05
    assert second.places == pytest.approx(first.places @ turn.T, rel=0, abs=1e-9 * 180)
    assert second.frames == pytest.approx(turn @ first.frames @ turn.T, rel=0, abs=1e-9)
    assert second.tensions == pytest.approx(first.tensions, rel=0, abs=1e-8)
    assert second.forces == pytest.approx(first.forces @ turn.T, rel=0, abs=1e-8)


@pytest.mark.parametrize("pulls", [(6.5,), (6.5, -7.0), (-6.5, 6.0)])
@pytest.mark.parametrize("distance", [26.0, 400.0])
def test_in_a_plane_it_is_the_rod_of_the_plane(pulls, distance):
    """One cable and an opposing pair, free and at a wall, where no motion out of the plane pays.

    At that wall it does from a pull of 6.66 on: by a dense eigenvalue of the Hessian on the tangent space, which is
    0.52 EI/L at 6.5 and negative at 6.75.
    """
    angles = [0.0, math.pi][: len(pulls)]
    side = math.copysign(1.0, pulls[0])
    cables = [{"offset": 8.0, "angle": angle, "end": 18} for angle in angles]
    wall = {"kind": "wall", "offset": -distance}
    planar = robots.plane(18, cables=cables, touch=BACKBONE, obstacles=[{**wall, "normal": [-side, 0.0]}])
    walls = [{**wall, "normal": [-side, 0.0, 0.0]}]
    spatial = robots.space(18, *angles, touch=BACKBONE, obstacles=walls)
    robots.require(planar)
    flat, found = (robots.read(robots.pulled(spec, *pulls)) for spec in (planar, robots.require(spatial)))
    assert (np.abs(flat.forces).max() > 0.01) == (distance < 100)
    assert found.places[:, ::2] == pytest.approx(flat.places, rel=0, abs=1e-7)
    assert found.places[:, 1] == pytest.approx(0.0, abs=1e-7)
    assert found.tensions == pytest.approx(flat.tensions, rel=0, abs=1e-7)
    assert found.forces[:, ::2] == pytest.approx(flat.forces, rel=0, abs=1e-7)


def test_it_leaves_the_plane_where_that_is_unstable():
    """Pressed against a wall beyond the pull of 6.66, the robot slips aside and turns, by any side."""
    spec = robots.space(
        18, 0.0, touch=BACKBONE, obstacles=[{"kind": "wall", "offset": -26.0, "normal": [-1.0, 0.0, 0.0]}]
    )
    found = robots.read(robots.pulled(robots.require(spec), 7.0, steps=40))
    assert abs(found.places[-1, 1]) > 1.0
