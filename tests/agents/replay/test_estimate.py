"""The force that a log tells agrees with a truth that it does not hold."""

import csv
import json
import math
import runpy
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agents import cli, estimate_log, read_instruments, read_log
from agents.replay import run as replay
from agents.replay.log import Log
from agents.replay.results import summary
from ccr_gym import PushObstacleEnv, SpatialPushEnv
from solver import Actuation, Cable, Circle, Robot, Scene
from solver.spatial import Sphere

EXAMPLE = Path(__file__).parents[3] / "examples" / "estimate"
CIRCLE, PAIR = (
    [Circle(center=(49, 112), radius=14)],
    [
        Circle(center=(33, 89), radius=12.5),
        Circle(center=(59, 140), radius=15),
    ],
)
OPPOSED = Robot.prototype(cables=(Cable(), Cable(angle=math.pi)))
GOAL = 2.0  # force at which the pull ends [EI/L² of the real robot]
CASES = {
    "one": (PushObstacleEnv, Robot.prototype(), CIRCLE, [1.0]),
    "opposed": (PushObstacleEnv, OPPOSED, CIRCLE, [1.0]),
    "two obstacles": (PushObstacleEnv, Robot.prototype(), PAIR, [1.0]),
    "paper": (PushObstacleEnv, Robot.prototype(model="paper"), CIRCLE, [1.0]),
    "two sections": (PushObstacleEnv, Robot.preset("snake_arm"), [Circle(center=(270, 600), radius=80)], [1.0, 1.0]),
    "space": (SpatialPushEnv, "three_cables", [Sphere(center=(40, 25, 115), radius=14)], [0.85, 0.53]),
}


PULL = [*[0.5] * 20, *[-0.5] * 12, *[0.5] * 90]  # with a reversal, which tells friction from rigidity
SWING = (0.4 * np.sin(np.arange(40) * 2 * np.pi / 20)).tolist()


def played(case, seed, *, tip):
    """Return the log of a realistic environment, its true forces [N], and the robot and scene of the log."""
    make, robot, scene, direction = CASES[case]
    env = make(robot=robot, sensing="sensorless", obs_mode="dict")
    settings, space = env.settings, 2 if make is PushObstacleEnv else 3
    actuation, tension_n = Actuation.of(settings.robot, space), settings.tension_span * settings.scales.tension_n
    env.reset(seed=seed, options={"scene": scene, "desired_force": settings.scales.force_n})
    goal = GOAL * settings.scales.force_n * env.privileged_state.rigidity_ratio * actuation.sections
    cables, tensions, tips, forces = [], [], [], []

    def step(action):
        observation, *_, info = env.step(action * np.array(direction))
        cables.append(actuation.cables_mm(env.privileged_state.motor_mm))
        tensions.append(tension_n * observation["tension"].astype(float))
        tips.append(settings.reach_mm * observation["nodes"].reshape(-1, 3)[-1:, :space].astype(float))
        forces.append(np.linalg.norm(info["force_true"]))

    for action in PULL:
        step(action)
        if forces[-1] > goal:
            break
    for action in SWING:
        step(action)
    rows = len(cables)
    nodes, places = ([settings.robot.segments], np.array(tips)) if tip else ([], np.zeros((rows, 0, space)))
    log = Log(np.arange(2, rows + 2), None, np.array(cables), np.array(tensions), np.array(nodes, int), places)
    return log, np.array(forces), settings.robot, Scene(scene)


@pytest.mark.parametrize("tip", [True, False])
@pytest.mark.parametrize("case", CASES)
def test_the_force_is_right_within_two_standard_deviations(case, tip):
    log, forces, robot, scene = played(case, 5, tip=tip)
    found = estimate_log(log, robot, scene, read_instruments(None, robot))
    pressed = forces > 0
    assert pressed.sum() > 30
    near = np.abs(found.force_n - forces) <= 2 * found.force_std_n
    assert near.mean() >= 0.9
    assert near[pressed].mean() >= 0.85  # three cables in space, whose play is that of their commands
    errors = np.abs(found.force_n - forces)[pressed] / forces[pressed]
    assert np.median(errors) < 0.1
    doubt = 0.9 if case == "two sections" else 0.4  # of two sections the tensions alone tell less
    assert np.median(found.force_std_n[pressed] / forces[pressed]) < doubt


def test_what_touches_and_which_way_it_pushes():
    log, forces, robot, scene = played("two obstacles", 2, tip=False)
    found = estimate_log(log, robot, scene, read_instruments(None, robot))
    sizes = np.linalg.norm(found.obstacle_forces_n, axis=2)
    assert sizes.sum(axis=1) == pytest.approx(found.force_n, abs=1e-9)
    touching = np.array([shape.contact.any(axis=(1, 2)) for shape in found.shapes])
    assert (touching[found.force_n > 0.01].any(axis=1)).mean() > 0.95
    assert found.obstacle_forces_n[forces > 0.05][:, :, 0].max() <= 1e-12  # the circles stand at +x


def columns(path):
    with path.open() as file:
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0]}


def test_the_example_agrees_with_its_truth(tmp_path, monkeypatch, capsys):
    files = ["--robot", EXAMPLE / "robot.json", "--scene", EXAMPLE / "scene.json", "--out", tmp_path]
    monkeypatch.setattr(sys, "argv", ["ccr-gym", "estimate", *map(str, [EXAMPLE / "log.csv", *files])])
    cli.main()
    printed = capsys.readouterr().out
    assert "Largest contact force: 0.7" in printed
    found, truth = columns(tmp_path / "estimate.csv"), columns(EXAMPLE / "truth.csv")
    force, deviation, true = (np.array(c, float) for c in (found["force_n"], found["force_std_n"], truth["force_n"]))
    assert (np.abs(force - true) <= 2 * deviation).mean() >= 0.9
    assert abs(float(found["rigidity_ratio"][-1]) / float(truth["rigidity_ratio"][-1]) - 1) < 0.05
    assert abs(float(found["tendon_loss"][-1]) - float(truth["tendon_loss"][-1])) < 0.02
    shapes = columns(tmp_path / "shape.csv")
    assert len(shapes["node"]) == len(true) * 19
    assert (tmp_path / "estimate.png").stat().st_size > 20_000
    known = json.loads((tmp_path / "estimate.json").read_text())
    assert known["latency_rows"] == float(truth["latency_rows"][0])
    assert type(known["latency_rows"]) is int
    checked = runpy.run_path(str(EXAMPLE / "check.py"))
    checked["main"](checked["Args"](results=tmp_path, out=tmp_path / "check.png"))
    assert "within two standard deviations in 1" in capsys.readouterr().out


def example_log(tmp_path, rows=None, **factors):
    """Write the example's log with other units, or its first rows; return the arguments of the command."""
    lines = [line.split(",") for line in (EXAMPLE / "log.csv").read_text().splitlines()]
    header, *table = lines
    for row in table:
        for name, factor in factors.items():
            row[header.index(name)] = repr(factor * float(row[header.index(name)]))
    log = tmp_path / "log.csv"
    log.write_text("".join(",".join(line) + "\n" for line in [header, *table[:rows]]))
    files = ["--robot", EXAMPLE / "robot.json", "--scene", EXAMPLE / "scene.json", "--out", tmp_path]
    return ["ccr-gym", "estimate", *map(str, [log, *files])]


@pytest.mark.parametrize(("factor", "ratio"), [(1e3, "3"), (1e-3, "0.3")])
def test_an_estimate_at_the_end_of_its_range_is_warned_of(factor, ratio, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", example_log(tmp_path, tension_n=factor))
    cli.main()
    printed = capsys.readouterr()
    warning = (
        f"rigidity over that of the robot's file is {ratio}, at the end of its range, 0.3 to 3: check that tensions"
    )
    assert f"ccr-gym: warning: {warning}" in printed.err
    assert "robot.json (at the end of its range)\n" in printed.out
    assert warning in json.loads((tmp_path / "estimate.json").read_text())["warnings"][0]


def test_the_example_is_within_all_ranges_and_without_contact_says_so(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", example_log(tmp_path, rows=40))
    cli.main()
    printed = capsys.readouterr()
    assert printed.err == ""
    assert "range" not in printed.out
    assert "Largest contact force: no contact\n" in printed.out
    assert json.loads((tmp_path / "estimate.json").read_text())["largest_force"] is None


def test_the_example_is_what_its_script_writes(tmp_path):
    example = runpy.run_path(str(EXAMPLE / "make_log.py"))
    example["main"](example["Args"](out=tmp_path))
    for name in ("robot.json", "scene.json", "log.csv", "truth.csv"):
        assert (tmp_path / name).read_text() == (EXAMPLE / name).read_text()


def test_errors_are_one_line(tmp_path, monkeypatch, capsys):
    log = tmp_path / "log.csv"
    log.write_text("cable_mm,tension_n\n1,x\n")
    files = ["--robot", EXAMPLE / "robot.json", "--scene", EXAMPLE / "scene.json", "--out", tmp_path]
    monkeypatch.setattr(sys, "argv", ["ccr-gym", "estimate", *map(str, [log, *files])])
    with pytest.raises(SystemExit) as caught:
        cli.main()
    assert caught.value.code == 2
    assert (
        capsys.readouterr().err
        == f"ccr-gym: {log}, line 2, column tension_n: 'x' is not a number up to 1e+09 in size\n"
    )


def test_results_that_cannot_be_written_are_named_before_the_work(tmp_path, monkeypatch, capsys):
    def work(*_):
        raise AssertionError("worked in vain")

    monkeypatch.setattr(replay, "estimate_log", work)
    taken = tmp_path / "estimate.png"
    taken.mkdir()
    files = ["--robot", EXAMPLE / "robot.json", "--scene", EXAMPLE / "scene.json", "--out", tmp_path]
    monkeypatch.setattr(sys, "argv", ["ccr-gym", "estimate", *map(str, [EXAMPLE / "log.csv", *files])])
    with pytest.raises(SystemExit) as caught:
        cli.main()
    assert caught.value.code == 2
    assert capsys.readouterr().err == f"ccr-gym: {taken} cannot be written: Is a directory\n"
    assert list(tmp_path.iterdir()) == [taken]


def test_a_missing_file_is_one_line(tmp_path, monkeypatch, capsys):
    missing = ["--robot", tmp_path / "no.json", "--scene", EXAMPLE / "scene.json"]
    monkeypatch.setattr(sys, "argv", ["ccr-gym", "estimate", *map(str, [EXAMPLE / "log.csv", *missing])])
    with pytest.raises(SystemExit):
        cli.main()
    assert capsys.readouterr().err == f"ccr-gym: {tmp_path / 'no.json'}: No such file or directory\n"


def test_what_is_known_at_the_end_has_six_digits_and_no_latency_without_positions():
    log, robot = read_log(EXAMPLE / "log.csv", Robot.prototype()), Robot.prototype()
    blind = replace(log, nodes=np.zeros(0, int), positions_mm=np.zeros((len(log.rows), 0, 2)))
    known = summary(estimate_log(blind, robot, Scene(CIRCLE), read_instruments(None, robot)))
    assert set(known) == {"rows", "at_the_end", "largest_force", "warnings"}
    for value in (*known["at_the_end"].values(), *known["largest_force"].values()):
        assert value == float(f"{value:.6g}")


def test_columns_that_were_not_logged_are_not_written(tmp_path):
    log = read_log(EXAMPLE / "log.csv", Robot.prototype())
    assert log.nodes.tolist() == [18]
    found = estimate_log(log.averaged(4), Robot.prototype(), Scene(CIRCLE), read_instruments(None, Robot.prototype()))
    assert np.isfinite(found.position_errors_mm).all()
    assert np.median(found.position_errors_mm) < 0.02 * 180
