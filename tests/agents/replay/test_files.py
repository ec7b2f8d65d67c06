"""Robots, scenes and sensing as JSON: what is written is read again, and what is wrong is named in one line."""

import json
import math

import pytest

from agents import read_instruments, read_robot, read_scene, robot_json, scene_json
from agents.errors import UserError
from agents.replay.robots import robot_of
from agents.replay.scenes import scene_of
from solver import Capsule, Circle, Custom, Ellipse, Family, HalfPlane, Load, Polygon, Robot, Scene, spatial
from solver.spatial import SpatialRobot

ROBOTS = [
    Robot.prototype(model="paper"),
    Robot.preset("snake_arm"),
    Robot.prototype(max_tension=math.inf, precurvature=[0.01] * 18, loads=[Load(node=3, force=(1, 2))]),
    Robot.prototype(length_range_mm=(160, 190), touch=("backbone",), weight_per_length=(0, -1e-4)),
    SpatialRobot.preset("rao_2021"),
    SpatialRobot.preset("three_cables", torsion_ratio=[0.5] * 18),
]
PLANAR = [
    Circle(center=(44, 100), radius=15, spring=0.5),
    HalfPlane(point=(50, 0), normal=(-1, 0.3), nodes=(14,)),
    Ellipse(center=(60, 50), radii=(10, 5), axis=(1, 2)),
    Capsule(start=(80, 0), end=(90, 9), radius=3),
    Polygon(corners=[(100, 0), (110, 0), (105, 10)], radius=3),
]
SPATIAL = [
    spatial.Sphere(center=(44, 100, 3), radius=15),
    spatial.HalfSpace(point=(50, 0, 1), normal=(-1, 0.3, 0.2)),
    spatial.Box(center=(60, 50, 3), sizes=(10, 5, 4)),
    spatial.Capsule(start=(80, 0, 1), end=(90, 9, 1), radius=3),
    spatial.Cylinder(start=(80, 0, 1), end=(90, 9, 1), radius=3),
]


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_robot_is_read_as_it_was_written(robot, tmp_path):
    path = tmp_path / "robot.json"
    path.write_text(robot_json(robot))
    assert read_robot(path) == robot


@pytest.mark.parametrize(("obstacles", "planar"), [(PLANAR, True), (SPATIAL, False)])
def test_a_scene_is_read_as_it_was_written(obstacles, planar):
    assert scene_of(json.loads(scene_json(Scene(obstacles))), planar=planar) == Scene(obstacles)


def test_a_preset_takes_other_fields():
    given = {"preset": "snake_arm", "rigidity": 6e5, "segments": 20}
    assert robot_of(given) == Robot.preset("snake_arm", rigidity=6e5, segments=20)
    in_space = {"space": "space", "preset": "snake_arm"}
    assert robot_of(in_space) == SpatialRobot.preset("snake_arm")


def test_a_custom_shape_is_no_data():
    family = Family.trace(lambda p, size: p[0] ** 2 + p[1] ** 2 - size[0] ** 2, sizes=1)
    shape = Custom(family=family, sizes=(16,), center=(44, 104), reach=20)
    with pytest.raises(ValueError, match="Custom cannot be written as JSON"):
        scene_json(Scene([shape]))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"preset": "prototype",}', "line 1, column 24: "),
        ('{"preset": "prototype", "preset": "guidewire"}', "'preset' is given twice"),
        ('{"preset": "prototype", "rigidity": NaN}', "NaN is not JSON"),
        ("[" * 100_000, "recursion"),
        ("[]", "a robot is a JSON array; it must be an object"),
        ("7", "a robot is a JSON number"),
        ('{"preset": "octopus"}', "name of a preset is 'octopus'; it must be one of prototype"),
        ('{"preset": "prototype", "stiffness": 3}', "'stiffness' is not a field of Robot"),
        ('{"space": "plain"}', "space is 'plain'; it must be one of plane, space"),
        ('{"length_mm": 100, "segments": 10}', "offset_mm is missing"),
        ('{"preset": "prototype", "rigidity": -1}', "rigidity is -1; it must be"),
        ('{"preset": "prototype", "rigidity": "5000"}', "rigidity is '5000'; it must be"),
        ('{"preset": "prototype", "segments": 18.5}', "segments is 18.5; it must be a whole number"),
        ('{"preset": "prototype", "cables": [{"side": 1}]}', "'side' is not a field of entry 0 of cables"),
        ('{"preset": "prototype", "cables": {"angle": 0}}', "cables must be an array"),
        ('{"preset": "prototype", "loads": [{"node": 3}]}', "force of entry 0 of loads is missing"),
        ('{"preset": "prototype", "segments": ' + "9" * 5000 + "}", "digits"),
    ],
)
def test_what_is_wrong_with_a_robot_is_one_line(text, message, tmp_path):
    path = tmp_path / "robot.json"
    path.write_text(text)
    with pytest.raises(UserError) as caught:
        read_robot(path)
    assert str(caught.value).startswith(str(path))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[]", "at least one obstacle"),
        ('{"shape": "Circle"}', "at least one obstacle"),
        (
            '[{"shape": "Sphere", "center": [0, 0, 9], "radius": 1}]',
            "shape of obstacle 0 is 'Sphere'; it must be one of",
        ),
        ('[{"shape": "Custom"}]', "shape of obstacle 0 is 'Custom'"),
        ('[{"shape": "__class__"}]', "shape of obstacle 0 is '__class__'"),
        ('[{"shape": "Circle", "center": [60, 90]}]', "radius of obstacle 0, a Circle, is missing"),
        ('[{"shape": "Ellipse", "center": [60, 90]}]', "radii of obstacle 0, an Ellipse, is missing"),
        ('[{"shape": "Circle", "center": [60], "radius": 15}]', "obstacle 0, a Circle: center"),
        (
            '[{"shape": "Circle", "center": [60, 90], "radius": 15, "r": 1}]',
            "'r' is not a field of obstacle 0, a Circle",
        ),
        ('[{"shape": "Circle", "center": [5, 90], "radius": 15}]', "overlap"),
        ('[{"shape": "Circle", "center": [60, 90], "radius": 1}]', "slip between"),
    ],
)
def test_what_is_wrong_with_a_scene_is_one_line(text, message, tmp_path):
    assert message in refusal(read_scene, tmp_path / "scene.json", text)


def refusal(read, path, text):
    """Return what is said of a file that is refused: one line, which begins with its name."""
    path.write_text(text)
    with pytest.raises(UserError) as caught:
        read(path, Robot.prototype())
    said = str(caught.value)
    assert said.startswith(str(path))
    assert "\n" not in said
    return said


def test_sensing_is_given_in_millimetres_and_newtons(tmp_path):
    robot, path = Robot.prototype(rigidity=1440.0), tmp_path / "sensing.json"  # EI/(aL) is 1 N
    path.write_text('{"backlash_mm": [0.2, 0.6], "tension_noise_n": 0.05, "latency_rows": 0, "position_noise_mm": 0.5}')
    found = read_instruments(path, robot)
    assert found.sensing.backlash == pytest.approx((0.025, 0.075))
    assert found.sensing.tension_noise == pytest.approx((0.05, 0.05))
    assert found.sensing.latency == (0, 0)
    assert (found.position_noise_mm, found.position_error_mm) == pytest.approx((0.5, 0.36))
    assert read_instruments(None, robot).sensing.tendon_loss == (0.0, 0.3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"backlash": 1}', "'backlash' is not a field of sensing"),
        ('{"backlash_mm": -1}', "backlash_mm is -1; it must be a number from 0 to 8"),
        ('{"backlash_mm": [0.6, 0.2]}', "the smaller one first"),
        ('{"tendon_loss": 0.95}', "tendon_loss is 0.95; it must be a number from 0 to 0.9"),
        ('{"latency_rows": 1.5}', "latency_rows is 1.5; it must be whole numbers"),
        ('{"tension_noise_n": true}', "tension_noise_n is True"),
    ],
)
def test_what_is_wrong_with_sensing_is_one_line(text, message, tmp_path):
    assert message in refusal(read_instruments, tmp_path / "sensing.json", text)
