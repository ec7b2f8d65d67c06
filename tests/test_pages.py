"""The command that writes the numbers of README and docs."""

import json
import re
import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1]))  # last, so that an installed package goes first

from benchmarks import evaluation_text, markdown, pages, speed_text


@pytest.mark.parametrize("page", pages.PAGES, ids=lambda page: page.name)
def test_page_shows_the_numbers_of_the_result_files(page):
    text = page.read_text()
    assert pages.fill(text, pages.blocks()) == text, "run make numbers"


def test_every_block_is_on_a_page():
    shown = "".join(page.read_text() for page in pages.PAGES)
    assert [name for name in pages.BLOCKS if f"<!-- numbers: {name} -->" not in shown] == []


def test_blocks_are_written_between_their_marks_and_nowhere_else():
    text = "a\n<!-- numbers: x -->\nold\n<!-- /numbers -->\nb\n<!-- numbers: y -->\n<!-- /numbers -->\nc\n"
    filled = "a\n<!-- numbers: x -->\n1\n<!-- /numbers -->\nb\n<!-- numbers: y -->\n2\n3\n<!-- /numbers -->\nc\n"
    assert pages.fill(text, {"x": "1", "y": "2\n3"}) == filled
    assert pages.fill(filled, {"x": "1", "y": "2\n3"}) == filled
    with pytest.raises(ValueError, match="'y' names no block"):
        pages.fill(text, {"x": ""})


def test_a_benchmark_without_what_the_docs_compare_with_is_not_taken(tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "RESULTS", tmp_path)
    path = tmp_path / "new.json"
    path.write_text(json.dumps({"kernel": {}, "peers": {"sqpmethod": {}}}))
    with pytest.raises(SystemExit, match="pip install mujoco"):
        pages.take_bench(path)
    assert not (tmp_path / "bench.json").exists()


@pytest.mark.parametrize("text", ["{}", '{"PPO CCR/LoadCell-v1": [1.0]}', '{"results": []}', "[]"])
def test_a_file_that_is_no_evaluation_is_not_taken(text, tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "RESULTS", tmp_path)
    path = tmp_path / "scores.json"
    path.write_text(text)
    with pytest.raises(SystemExit, match=r"scores\.json holds no results of policies: give the evaluation\.json"):
        pages.take_evaluation(path)
    assert not (tmp_path / "evaluation.json").exists()


@pytest.mark.parametrize(
    ("shares", "text"), [((0, 3), "none, of those in space at most 0.30 %"), ((0.001, 0), "0.01 %")]
)
def test_no_event_is_called_none(shares, text):
    ids = "CCR/LoadCell-v1", "CCR/SpatialPush-v1"
    rows = [
        {"policy": "PI", "env_id": env_id, "summary": {"statuses": {"CONVERGED": 1000 - share, "STALLED": share}}}
        for env_id, share in zip(ids, shares, strict=True)
    ]
    assert text in evaluation_text.events({"results": rows})


def test_each_time_is_named_after_its_model():
    bench, demo = pages.load("bench"), pages.load("demo")
    paper = bench["kernel"]["paper"]
    both = {**bench, "kernel": {**bench["kernel"], "rod": {**paper, "mean_us": 7.5, "ipopt_ratio": 432}}}
    short = speed_text.speed_in_short(both, demo).splitlines()[0]
    assert "**7.5 µs** (the rod) and **" in short
    assert "µs** (the paper's model) a step" in short
    assert f" takes 432 and {markdown.digits(paper['ipopt_ratio'])} times as long" in short
    assert len(speed_text.statuses_line(both).split(" random steps of ")) == 3
    for row in speed_text.kernel_table(both).splitlines()[2:]:
        assert re.match(r"\| (the rod|the paper's model)\b", row)
    assert "| the rod: step, 18 segments" in speed_text.kernel_table(both)


@pytest.mark.parametrize(
    ("value", "count", "text"),
    [(6.23, None, "6.2"), (12.4, None, "12"), (134_321, None, "134 000"), (0.157, None, "0.16"), (1.284, 3, "1.28")],
)
def test_significant_digits(value, count, text):
    assert markdown.digits(value, count) == text


def test_new_results_are_taken_without_their_episodes(tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "RESULTS", tmp_path)
    monkeypatch.setattr(pages, "PAGES", ())
    monkeypatch.setattr(pages, "blocks", dict)
    result = {
        "policy": "PI",
        "env_id": "CCR/LoadCell-v1",
        "sensing": "realistic",
        "files": [],
        "episodes": {"cost": [1]},
    }
    found = {"episodes": 2, "results": [result | {"summary": {"rmse_iqm_mn": 1.23456789, "statuses": {"SNAPPED": 1}}}]}
    path = tmp_path / "new.json"
    path.write_text(json.dumps(found))
    monkeypatch.setattr(sys, "argv", ["numbers", "--evaluation", str(path)])
    pages.main()
    (kept,) = pages.load("evaluation")["results"]
    assert kept["summary"] == {"rmse_iqm_mn": 1.234568, "statuses": {"SNAPPED": 1}}
    assert "episodes" not in kept
