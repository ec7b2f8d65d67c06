import json
import sys

import numpy as np
import pytest

from agents import cli
from agents.paper import published
from agents.paper.model import calibrate, table_1


def test_table_1_by_straight_line_slopes():
    """Paper, Table 1: μ from d = 31 mm, 250 g, then its theoretical column and its mean error."""
    column = table_1(*calibrate())
    assert column == pytest.approx(published.THEORETICAL_G, abs=0.1)
    errors = np.abs(np.array(list(published.MEASURED_G.values())) - column)
    assert errors.size == 28
    assert errors.mean() < published.CLAIMED_MEAN_ERROR_G
    assert errors.max() > published.CLAIMED_MAX_ERROR_G


def test_the_command_writes_a_page_and_a_verdict_on_every_claim(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["ccr-gym", "reproduce", "--out", str(tmp_path)])
    cli.main()
    report = json.loads((tmp_path / "paper.json").read_text())
    verdicts = {claim["sentence"]: claim["holds"] for claim in report}
    assert verdicts["The multipliers peak at nodes 11 and 17, the contacts of Fig. 4b (Fig. 5)."]
    assert verdicts["Theoretical column of Table 1."]
    assert verdicts["Two cables pulled at once bend the robot in a plane between those of each alone (Fig. 11)."]
    assert capsys.readouterr().out.count("holds: ") >= 3
    assert (tmp_path / "paper.png").stat().st_size > 50_000
