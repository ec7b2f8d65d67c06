"""Pages of the documentation show what their examples print, and the picture that they begin with is small."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
PRINTED = re.compile(r"^```python\n(.*?)^```\n\n```text\n(.*?)^```", re.MULTILINE | re.DOTALL)
SHOWN = {
    f"{page.stem} {k}": block
    for page in sorted(DOCS.glob("*.md"))
    for k, block in enumerate(PRINTED.findall(page.read_text()))
}


@pytest.mark.parametrize("name", SHOWN)
def test_page_shows_what_is_printed(name, tmp_path):
    code, shown = SHOWN[name]
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout == shown


def test_first_example_shows_a_contact_and_a_force():
    assert re.search(r"node \[\d+\] force \[N\] \[\s*-0\.\d", SHOWN["index 0"][1])


def test_animation_is_small():
    assert (DOCS / "demo.gif").stat().st_size < 2e6
