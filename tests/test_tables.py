"""The command that writes the tables of the docs."""

import importlib.util
import json
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SPEC = importlib.util.spec_from_file_location("tables", ROOT / "benchmarks/tables.py")
tables = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(tables)

RESULTS = {"headroom": tables.headroom_table, "knowledge": tables.knowledge_table, "cost_of_flags": tables.cost_table}


def test_tables_are_written_between_their_marks_and_nowhere_else():
    text = "a\n<!-- numbers: x -->\n| old |\n<!-- /numbers -->\nb\n<!-- numbers: y -->\n<!-- /numbers -->\nc\n"
    filled = tables.fill(text, {"x": "| 1 |\n| 2 |", "y": "| 3 |"})
    assert filled == (
        "a\n<!-- numbers: x -->\n| 1 |\n| 2 |\n<!-- /numbers -->\nb\n<!-- numbers: y -->\n| 3 |\n<!-- /numbers -->\nc\n"
    )
    assert tables.fill(filled, {"x": "| 1 |\n| 2 |", "y": "| 3 |"}) == filled
    with pytest.raises(ValueError, match="'y' names no table"):
        tables.fill(text, {"x": ""})


def test_every_mark_in_the_docs_names_a_table():
    names = {"headroom", "knowledge", "cost of flags", "errors", "policies"}
    found = "".join(tables.fill((ROOT / doc).read_text(), dict.fromkeys(names, "@")) for doc in tables.DOCS)
    assert found.count("@\n<!-- /numbers -->") == found.count("<!-- numbers: ") == 6


@pytest.mark.parametrize("name", RESULTS)
def test_the_docs_show_what_was_measured(name):
    rows = json.loads((ROOT / f"docs/results/{name}.json").read_text())
    assert RESULTS[name](rows) in (ROOT / "docs/sensing.md").read_text()


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
    text = tables.headroom_table([row]).splitlines()[-1]
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
