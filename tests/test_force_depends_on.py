"""The table of what a force depends on: the solver's derivatives are those of solving again."""

import runpy
from pathlib import Path

import pytest

EXAMPLE = runpy.run_path(str(Path(__file__).parents[1] / "examples" / "force_depends_on.py"))
PAGE = Path(__file__).parents[1] / "docs" / "force_depends_on.md"


@pytest.mark.parametrize("cable_mm", [7.0, 8.0, 10.0])
def test_derivatives_are_those_of_solving_again(cable_mm):
    setup = EXAMPLE["Setup"](cable_mm=cable_mm)
    own, again = EXAMPLE["derivatives"](setup), EXAMPLE["differences"](setup)
    assert {name: values[0] for name, values in again.items()} == pytest.approx(own, rel=1e-3, abs=1e-5)


def test_the_page_shows_the_table_that_the_script_prints():
    assert EXAMPLE["table"](EXAMPLE["Setup"]()) in PAGE.read_text()
