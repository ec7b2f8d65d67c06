"""The command that measures what the tables of the docs show."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1]))  # last, so that an installed package goes first

from benchmarks import tables
from benchmarks.evaluation_text import headroom_table


def test_the_table_of_headroom():
    errors = {"MPC": [10.0, 9.0, 12.0], "Oracle": [0.0, 0.0, 0.1]}
    row = {
        "id": "CCR/LoadCell-v1",
        "sensing": "realistic",
        "set_point": 119.2,
        "errors": errors,
        "best": 10.0,
        "room": True,
    }
    text = headroom_table([row]).splitlines()[-1]
    assert text == ("| `LoadCell` | realistic | 119 |  |  | 10.0 [9.0, 12.0] |  |  | 0.0 [0.0, 0.1] | 8.4 % | yes |")


def test_what_is_kept_is_measured_once(tmp_path, monkeypatch):
    monkeypatch.setattr(tables, "KEPT", tmp_path)
    calls = []
    for _ in range(2):
        assert tables.kept("name", lambda: calls.append(1) or 3) == 3
    assert calls == [1]
    with pytest.raises(KeyError):
        tables.kept("other", lambda: {}["missing"])
    assert not (tmp_path / "other.pkl").exists()
