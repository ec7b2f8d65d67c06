"""The tutorials as text; building the documentation runs them."""

import re
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "docs" / "tutorials"
TUTORIALS = sorted(set(FOLDER.glob("*.md")) - {FOLDER / "index.md"})


def test_the_index_lists_all():
    (listed,) = re.findall(r"^```\{toctree\}\n(?::[^\n]*\n)*(.*?)^```", (FOLDER / "index.md").read_text(), re.M | re.S)
    assert sorted(listed.split()) == [page.stem for page in TUTORIALS]
    assert len(TUTORIALS) == 7


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_has_code_a_figure_and_something_to_change(page):
    text = page.read_text()
    cells = re.findall(r"^```\{code-cell\} ipython3\n(.*?)^```", text, re.M | re.S)
    assert text.startswith("---\nfile_format: mystnb\n")
    assert "plt.subplots" in text
    assert re.findall(r"^## .*", text, re.M)[-1] == "## Change something"
    for cell in cells:
        compile(cell, page.name, "exec")
    for target in re.findall(r"\]\(([^)#:]+)\)", text):
        assert (FOLDER / target).exists(), target
