"""Logs: every cell is checked, and an error names its line and column."""

import numpy as np
import pytest

from agents import read_log
from agents.errors import UserError
from agents.replay.commands import commands_mm
from solver import Robot
from solver.spatial import SpatialRobot

ROBOT, SNAKE = Robot.prototype(), Robot.preset("snake_arm")


def read(path, text, robot=ROBOT):
    path.write_text(text)
    return read_log(path, robot)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "log.csv"


def test_columns_come_in_any_order(path):
    log = read(path, "tip_y_mm,tension_n,time_s,cable_mm,tip_x_mm\n180,0.1,0,0,1\n\n179,0.2,0.5,1.5,2\n")
    assert log.rows.tolist() == [2, 4]
    assert log.time_s.tolist() == [0, 0.5]
    assert log.cables_mm.tolist() == [[0], [1.5]]
    assert log.tensions_n.tolist() == [[0.1], [0.2]]
    assert log.nodes.tolist() == [18]
    assert log.positions_mm.tolist() == [[[1, 180]], [[2, 179]]]


def test_nodes_and_the_tip_in_space(path):
    header = (
        "cable_0_mm,cable_1_mm,tension_0_n,tension_1_n,node_9_x_mm,node_9_y_mm,node_9_z_mm,tip_x_mm,tip_y_mm,tip_z_mm"
    )
    log = read(path, header + "\n0,1,2,3,4,5,6,7,8,9\n", SpatialRobot.preset("prototype"))
    assert log.nodes.tolist() == [9, 18]
    assert log.positions_mm.tolist() == [[[4, 5, 6], [7, 8, 9]]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no rows"),
        ("cable_mm,tension_n\n", "has no rows"),
        ("cable_mm\n1\n", "line 1: the column tension_n is missing"),
        ("cable_mm,tension_n,tip_x_mm\n1,2,3\n", "line 1: the column tip_y_mm is missing"),
        ("cable_mm,tension_n,Force\n1,2,3\n", "line 1: the column 'Force' is unknown"),
        ("cable_mm,tension_n,tip_z_mm\n1,2,3\n", "line 1: the column 'tip_z_mm' is unknown"),
        ("cable_mm,tension_n,tension_n\n1,2,3\n", "line 1: the column tension_n is given twice"),
        ("cable_mm,tension_n,node_19_x_mm,node_19_y_mm\n1,2,3,4\n", "column node_19_x_mm: the nodes of this robot are"),
        ("cable_mm;tension_n\n1,5;2,0\n", "cells are separated by semicolons; they must be separated by commas"),
        ("cable_mm\ttension_n\n1\t2\n", "cells are separated by tabs; they must be separated by commas"),
        ("cable_mm,tension_n\n1,2\n1\n", "line 3: there are 1 cells; the header has 2"),
        ("cable_mm,tension_n\n1,2\n1,\n", "line 3, column tension_n: the cell is empty"),
        ("cable_mm,tension_n\n1,=cmd()\n", "line 2, column tension_n: '=cmd()' is not a number"),
        ("cable_mm,tension_n\n1,nan\n", "line 2, column tension_n: 'nan' is not a number"),
        ("cable_mm,tension_n\n1,1e400\n", "line 2, column tension_n: '1e400' is not a number"),
        ("cable_mm,tension_n\n1,1_0\n", "line 2, column tension_n: '1_0' is not a number"),
        ("cable_mm,tension_n\n-1,1\n", "line 2, column cable_mm: -1 is out of range; it must be from 0 to 25.1327 mm"),
        ("time_s,cable_mm,tension_n\n1,1,1\n1,1,1\n", "line 3, column time_s: 1 must be above 1, the line before"),
        ('cable_mm,tension_n\n1,"2\n', "line 2: unexpected end of data"),
    ],
)
def test_what_is_wrong_is_one_line(text, message, path):
    with pytest.raises(UserError) as caught:
        read(path, text)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_wrong_sign_is_noticed(path):
    with pytest.raises(UserError, match=r"tensions of pulled cables are -2\.5 N on average"):
        read(path, "cable_mm,tension_n\n1,-2\n2,-3\n")
    read(path, "cable_mm,tension_n\n1,-0.02\n2,0.01\n")  # noise


def test_bytes_that_are_no_text(path):
    path.write_bytes(b"cable_mm,tension_n\n\xff\xfe,1\n")
    with pytest.raises(UserError, match="not a text in UTF-8"):
        read_log(path, ROBOT)


def test_rows_are_averaged(path):
    log = read(path, "time_s,cable_mm,tension_n\n" + "".join(f"{k},{k},{2 * k}\n" for k in range(7)))
    means = log.averaged(3)
    assert means.cables_mm[:, 0].tolist() == means.time_s.tolist() == [1, 4]
    assert means.tensions_n[:, 0].tolist() == [2, 8]
    assert means.rows.tolist() == [4, 7]
    assert means.positions_mm.shape == (2, 0, 2)


def snake_log(path, *rows):
    header = [f"cable_{k}_mm" for k in range(4)] + [f"tension_{k}_n" for k in range(4)]
    lines = [",".join(map(str, [*row, 0, 0, 0, 0])) for row in rows]
    return read(path, "\n".join([",".join(header), *lines]), SNAKE)


def test_commands_follow_the_cables_that_are_pulled(path):
    log = snake_log(path, (3, -3, 8, -8), (3, -9, 8, -20), (3, -3, 3, -3))  # the second lets idle cables hang
    assert commands_mm(log, SNAKE, "log") == pytest.approx(np.array([[3, 5], [3, 5], [3, 0]]), abs=1e-4)


@pytest.mark.parametrize("cables", [(3, 3, 8, -8), (3, 1, 8, -8)])
def test_cables_that_contradict_each_other_are_named(cables, path):
    log = snake_log(path, (0, 0, 0, 0), cables)
    with pytest.raises(UserError, match=r"log, line 3, column cable_[01]_mm: .* contradicts the other cables"):
        commands_mm(log, SNAKE, "log")


@pytest.mark.parametrize("other", [Robot.prototype(segments=9, between=2), SpatialRobot.prototype(), SNAKE])
def test_a_log_of_another_robot_does_not_fit(path, other):
    log = read(path, "cable_mm,tension_n,node_18_x_mm,node_18_y_mm\n0,0,0,180\n")
    log.check_fits(ROBOT)
    with pytest.raises(ValueError, match="node 18; robot has"):
        log.check_fits(other)
