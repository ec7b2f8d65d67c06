"""The pictures of both models: what is written beside them is what is drawn."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from agents.paper.scenes import CASES, page, read, states
from agents.paper.two_models import arrows, draw_case
from solver import Status

DOCS = Path(__file__).parents[3] / "docs"


@pytest.fixture(name="pairs", scope="module")
def pairs_fixture():
    return {case.name: states(case) for case in CASES}


def test_page_in_the_docs_has_these_numbers(pairs):
    readings = {name: {model: read(state) for model, state in both.items()} for name, both in pairs.items()}
    assert page(readings) == (DOCS / "two_models.md").read_text()


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_both_robots_touch_and_only_the_paper_kinks(case, pairs):
    paper, rod = (read(pairs[case.name][model]) for model in ("paper", "rod"))
    for state in pairs[case.name].values():
        assert state.status is Status.CONVERGED
        assert state.contact.any()
    assert rod.tilt < 0.25
    assert paper.tilt > 5 * rod.tilt
    assert paper.turn > rod.turn
    assert rod.force > 5 * paper.force


def test_sphere_is_that_of_the_kirchhoff_rod(pairs):
    """The force of the design's independent solution, with GJ/EI 0.75 instead of 0.77."""
    assert read(pairs["sphere"]["rod"]).force == pytest.approx(0.1417, rel=0.01)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_arrows_are_forces_on_the_obstacles_to_scale(case, pairs):
    for state in pairs[case.name].values():
        shown = arrows(state, 100.0)
        pushing = [index for index, force in enumerate(state.forces) if force.any()]
        assert [arrow.obstacle for arrow in shown] == pushing
        for arrow in shown:
            assert arrow.vector == pytest.approx(-100.0 * state.forces[arrow.obstacle], rel=1e-12)
            assert arrow.force == pytest.approx(np.linalg.norm(state.forces[arrow.obstacle]), rel=1e-12)


def test_picture_is_drawn_alike_every_time(pairs, tmp_path):
    case = CASES[0]
    for name in ("first.png", "second.png"):
        draw_case(tmp_path / name, case, pairs[case.name])
    assert (tmp_path / "first.png").read_bytes() == (tmp_path / "second.png").read_bytes()
    assert imread(tmp_path / "first.png").shape[:2] == (530, 900)


def test_docs_have_a_picture_of_every_scene():
    assert {path.stem for path in (DOCS / "two_models").glob("*.png")} == {case.name for case in CASES}
