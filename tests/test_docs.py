"""README and docs show what their examples print, and the pictures that they begin with are small and there."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import ccr_gym

DOCS = Path(__file__).parents[1] / "docs"
PRINTED = re.compile(r"^```python\n(.*?)^```\n\n```text\n(.*?)^```", re.MULTILINE | re.DOTALL)
SHOWN = {
    f"{page.stem} {k}": block
    for page in [DOCS.parent / "README.md", *sorted(DOCS.glob("*.md"))]
    for k, block in enumerate(PRINTED.findall(page.read_text()))
}


@pytest.mark.parametrize("name", SHOWN)
def test_page_shows_what_is_printed(name, tmp_path):
    code, shown = SHOWN[name]
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout == shown


@pytest.mark.parametrize("page", ["README", "index"])
def test_first_example_shows_a_contact_and_a_force(page):
    code, shown = SHOWN[f"{page} 0"]
    assert re.search(r"node \[\d+\] force \[N\] \[\s*-0\.\d", shown)
    assert len(code.strip().splitlines()) <= 7


def test_every_example_is_listed():
    examples = DOCS.parent / "examples"
    files = {path.relative_to(examples).as_posix() for kind in ("py", "yml") for path in examples.rglob(f"*.{kind}")}
    rows = re.findall(r"^\| `([\w/]+\.\w+)` \|", (DOCS / "tutorials/index.md").read_text(), re.MULTILINE)
    assert len(rows) == len(set(rows))
    assert set(rows) == files


def test_animation_is_small():
    assert (DOCS / "demo.gif").stat().st_size < 2e6


def test_every_environment_has_a_thumbnail():
    names = {env_id.split("/")[1] for env_id in ccr_gym.ENV_IDS}
    assert {path.stem for path in (DOCS / "thumbnails").glob("*.png")} == names
