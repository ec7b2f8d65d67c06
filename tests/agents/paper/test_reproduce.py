"""The paper's claims. No verdict that rests on a measured time is asserted."""

import json
import sys

import numpy as np
import pytest

from agents import cli
from agents.paper import kinematics, published, statics, times
from agents.paper.model import calibrate, calibrated, force_per_load, pull, table_1
from agents.paper.verdict import Verdict
from solver import Scene, fitted_slopes

CLAIMS = {claim.sentence: claim for claim in (*kinematics.claims(), *statics.claims())}


def claim(words):
    (found,) = (claim for sentence, claim in CLAIMS.items() if words in sentence)
    return found


@pytest.mark.parametrize(
    ("words", "verdict"),
    [
        ("pose is predicted", Verdict.UNTESTABLE),
        ("perpendicular", Verdict.FAILS),
        ("uniquely", Verdict.FAILS),
        ("nodes 11 and 17", Verdict.HOLDS),
        ("multipliers that are not zero", Verdict.HOLDS),
        ("in a plane", Verdict.HOLDS),
        ("total strain energy", Verdict.FAILS),
        ("principle of virtual work", Verdict.FAILS),
        ("theoretical column", Verdict.UNTESTABLE),
        ("friction", Verdict.UNTESTABLE),
        ("average error", Verdict.HOLDS),
        ("less than 0.5 g", Verdict.UNTESTABLE),
        ("0.75%", Verdict.FAILS),
        ("offset d", Verdict.HOLDS),
        ("different contact points", Verdict.FAILS),
    ],
)
def test_verdicts(words, verdict):
    assert claim(words).verdict is verdict


def test_every_claim_but_those_about_times_is_in_the_list_above():
    assert len(CLAIMS) == 15


def test_theoretical_column_is_a_tautology():
    """Slopes of no robot at all give the column of Table 1, once μ is calibrated with them."""
    slopes = np.array([3.0, -0.5, -0.7])
    column = table_1(calibrated(*published.CALIBRATION, slopes), slopes)
    assert column == pytest.approx(table_1(*calibrate()), rel=1e-12)
    assert column == pytest.approx(published.THEORETICAL_G, abs=0.1)
    assert statics.column_spread() < 1e-10


def test_friction_is_a_fit():
    """−1.01 by the straight lines of Fig. 7; the disk slides down the cell, so its sign is that of friction."""
    estimator, _ = calibrate()
    assert estimator.friction == pytest.approx(-1.01, abs=0.005)
    assert "-1.01" in claim("friction").found
    low, high = (pull(published.load_cell(31.0), cable).cable_nodes[published.CELL_NODE] for cable in (5.0, 6.0))
    assert low[0] == pytest.approx(high[0], abs=1e-6)
    assert high[1] < low[1] - 1


def test_calibration_measurement_reproduces_the_column_best():
    """The paper does not say which of the 28 gave μ."""
    ratios = published.MEASURED / published.LOADS
    deviations = np.abs(ratios[..., None] * published.LOADS - published.THEORETICAL_G).max(axis=-1)
    assert published.is_calibration().ravel()[deviations.argmin()]
    assert deviations.min() == pytest.approx(0.06, abs=0.001)


def test_fig_10b_contradicts_fig_10a():
    """The same disk, 0.071 by the tip's slopes and 0.095 by its own."""
    estimator, tip = calibrate()
    own = fitted_slopes(statics.ROBOT, *statics.FIT_RANGE_MM, node=published.CELL_NODE)
    assert force_per_load(estimator, tip) == pytest.approx(0.071, abs=0.0005)
    assert force_per_load(estimator, own) == pytest.approx(0.095, abs=0.0005)


@pytest.mark.parametrize("node", [9, 14, 18])
def test_virtual_work_at_the_tip_is_off_by_beam_theory(node):
    """Propped cantilever with a cable along it: F = P·3a/2s, eq. 10 has P·2a/L."""
    length, arc = statics.ROD.length_mm, node * statics.ROD.segment_mm
    assert statics.estimate_over_force(node) == pytest.approx(4 * arc / (3 * length), rel=0.005)


def test_errors_of_table_1_as_printed():
    """By hand: |4 − 3.5| / 3 = 1/6, |23 − 24.9| = 1.9 g."""
    assert (statics.ERRORS / published.MEASURED).max() == pytest.approx(1 / 6)
    assert statics.ERRORS.max() == pytest.approx(1.9)
    others = ~published.is_calibration()
    assert statics.ERRORS[others].mean() < published.CLAIMED_MEAN_ERROR_G


def test_force_has_no_trend_over_the_distance():
    change, error = statics.trend()
    assert abs(change) < error < 0.05


def test_folded_robot_meets_eq_4_at_the_same_cost():
    moved, difference, violation = kinematics.fold(pull(Scene(), 5.0), 9)
    assert moved > 15
    assert difference < 1e-13
    assert violation < 1e-11


def test_objective_of_two_cables_depends_on_the_direction():
    """Small angles: 1 ± cos of the angle between the cables; twist counts twice."""
    assert kinematics.bending_costs(np.pi / 3) == pytest.approx(
        1 + 0.5 * np.cos(2 * np.linspace(0, np.pi, 181) - np.pi / 3 + np.pi), abs=1e-5
    )
    assert kinematics.twist_cost() == pytest.approx(2, abs=1e-5)


@pytest.mark.parametrize(("name", "obstacles"), [("no", 0), ("one", 1), ("two", 2)])
def test_timed_robots_touch(name, obstacles):
    """All the while, and as many obstacles as they are said to."""
    start = times.starts()[name]
    goal = pull(start.scene, start.cable_mm + times.INCREMENT_MM)
    for state in (start, goal):
        assert state.contact.any(axis=(1, 2)).sum() == obstacles


def test_the_command_writes_a_page_and_a_verdict_on_every_claim(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["ccr-gym", "reproduce", "--out", str(tmp_path)])
    cli.main()
    report = json.loads((tmp_path / "paper.json").read_text())
    assert len(report["claims"]) == len(CLAIMS) + 3
    assert {claim["verdict"] for claim in report["claims"]} == set(Verdict)
    assert len(report["table_1"]) == 6
    page = (tmp_path / "paper.md").read_text()
    assert page.index("table_1.png") < page.index("paper.png")
    assert all(sentence in page for sentence in CLAIMS)
    assert "cannot be" in capsys.readouterr().out
    for picture in ("table_1.png", "paper.png"):
        assert (tmp_path / picture).stat().st_size > 30_000
    assert (tmp_path / "two_models" / "circle.png").exists()
