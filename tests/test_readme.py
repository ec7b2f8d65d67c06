"""Every block of README and docs runs as printed: Python in a fresh process, commands as far as one can tell."""

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
PAGES = [README, *(page.read_text() for page in sorted((ROOT / "docs").glob("*.md")))]
BLOCKS = [block for page in PAGES for block in re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)]
COMMANDS = sorted(
    {
        command.strip(" ()")
        for page in PAGES
        for block in re.findall(r"^```console\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
        for line in block.replace("\\\n", " ").splitlines()
        for command in line.split("#")[0].split("&&")
        if command.strip()
    }
)
OTHERS = {"cd", "cp", "git", "tensorboard"}


@pytest.mark.parametrize("code", BLOCKS, ids=range(len(BLOCKS)))
def test_python_block_runs_by_itself(code, tmp_path):
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("command", COMMANDS)
def test_command_is_there(command):
    program, *arguments = shlex.split(command)
    if program == "make":
        assert re.search(rf"^{arguments[0]}:", (ROOT / "Makefile").read_text(), re.MULTILINE)
    elif program == "pip":
        extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
        assert set(re.findall(r"\[(\w+)\]", command)) <= set(extras)
    elif program == "ccr-gym":
        from agents.commands import parse

        parse(arguments)
    elif program == "python":
        module = arguments[1].replace(".", "/") if arguments[0] == "-m" else arguments[0]
        assert any((ROOT / f"{module}{suffix}").exists() for suffix in ("", ".py"))
    else:
        assert program in OTHERS


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))], ids=lambda page: page.name
)
def test_links_lead_to_files(page):
    for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
        assert (page.parent / target).exists(), target


def test_an_address_of_the_project_is_the_same_everywhere_and_none_is_a_placeholder():
    project, citation = (ROOT / "pyproject.toml").read_text(), (ROOT / "CITATION.cff").read_text()
    for text in (*PAGES, project, citation):
        assert not re.search(r"https?://[A-Z<{$]", text)
    given = tomllib.loads(project)["project"].get("urls", {}).get("Repository")
    assert yaml.safe_load(citation).get("repository-code") == given


def test_there_are_blocks_and_commands():
    assert len(BLOCKS) >= 5
    assert len(COMMANDS) >= 15
