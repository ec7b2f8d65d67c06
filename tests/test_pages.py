"""The command that writes the numbers of README and docs."""

import json
import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1]))  # last, so that an installed package goes first

from benchmarks import markdown, pages


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
