"""The command that measures what the tables of the docs show."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1]))  # last, so that an installed package goes first

from agents.config import PRETRAINED
from agents.learning.pretrained import SUFFIX, folder_name
from agents.tuned import sensing_of
from benchmarks import pages, tables
from benchmarks.evaluation_text import headroom_table, knowledge_table


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
    lines = headroom_table([row, {**row, "sensing": "sensorless"}]).splitlines()
    text = "| `LoadCell` | 119 |  |  | **10.0 [9.0, 12.0]** |  |  | 0.0 [0.0, 0.1] | 8.4 % | yes |"
    assert [line for line in lines if "LoadCell" in line] == [text, text]
    assert [line for line in lines if "sensing=" in line] == ['`sensing="realistic"`:', '`sensing="sensorless"`:']


def test_the_table_of_knowledge_shows_the_last_step_and_folds_the_others():
    rows = [
        {"id": env_id, "sensing": sensing, "step": step, "loss": [0.01, 0.987]}
        for env_id in ("CCR/LoadCell-v1", "CCR/TrackForce-v1")
        for sensing in ("realistic", "sensorless")
        for step in (8, 64)
    ]
    shown, *folded = knowledge_table(rows).split("<details>")
    assert shown.count("| 64 |") == 4
    assert "| 8 |" not in shown
    assert len(folded) == 2
    for part, env_id in zip(folded, ("CCR/LoadCell-v1", "CCR/TrackForce-v1"), strict=True):
        assert part.startswith(f"<summary>{env_id}, step by step</summary>\n\n| sensing | step |")
        assert part.count("| 8 |  |  | 0.0100 (99) |  |  |") == part.count("| 64 |  |  | 0.0100 (99) |  |  |") == 2
        assert part.rstrip().endswith("\n\n</details>")


def test_the_docs_show_what_the_probe_tells(tmp_path, monkeypatch):
    monkeypatch.setattr(tables, "ROOT", tmp_path)
    (tmp_path / "docs").mkdir()
    (tmp_path / "examples").symlink_to(pages.ROOT / "examples")
    measured, shown = tables.probe(), pages.load("probe")
    assert measured.keys() == shown.keys()
    for label, errors in measured.items():
        assert errors == pytest.approx(shown[label], rel=0.05)
    assert (tmp_path / "docs/probe.png").stat().st_size > 10_000


def test_what_is_kept_is_measured_once(tmp_path, monkeypatch):
    monkeypatch.setattr(tables, "KEPT", tmp_path)
    calls = []
    for _ in range(2):
        assert tables.kept("name", lambda: calls.append(1) or 3) == 3
    assert calls == [1]
    with pytest.raises(KeyError):
        tables.kept("other", lambda: {}["missing"])
    assert not (tmp_path / "other.pkl").exists()


def test_all_rows_of_the_docs_and_all_shipped_policies_are_measured():
    found = {(e.policy, e.env_id, e.sensing) for e in tables.entries(tables.Args())}
    shown = {(row["policy"], row["env_id"], row["sensing"]) for row in pages.load("evaluation")["results"]}
    assert shown == {entry for entry in found if entry[2] == sensing_of(entry[1])}
    headroom = {(p, row["id"], row["sensing"]) for row in pages.load("headroom") for p in row["errors"]}
    assert headroom <= found
    learned = {(policy, folder_name(env_id)) for policy, env_id, _ in found if policy in ("PPO", "Distilled")}
    assert learned == {file.parts[-3:-1] for file in PRETRAINED.rglob(f"*{SUFFIX}")}
