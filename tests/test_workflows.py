"""The hosted workflows run commands that exist, and every group of clients."""

import re
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
WORKFLOWS = {path.stem: yaml.safe_load(path.read_text()) for path in (ROOT / ".github" / "workflows").glob("*.yml")}
TARGETS = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))


def steps(workflow):
    return [step for job in WORKFLOWS[workflow]["jobs"].values() for step in job["steps"]]


@pytest.mark.parametrize("workflow", sorted(WORKFLOWS))
def test_commands_are_those_of_the_makefile(workflow):
    made = [step["run"].split()[1] for step in steps(workflow) if step.get("run", "").startswith("make ")]
    assert made
    assert set(made) <= TARGETS


def test_what_ci_runs_is_run():
    """The hosted workflow runs the native tests without sanitizers, too, on macOS."""
    local = set(re.findall(r"^make .*$", (ROOT / ".ci" / "run").read_text(), re.MULTILINE))
    wanted = {word for line in local for word in line.split() if word in TARGETS} - {"clean"}
    hosted = {step["run"].split()[1] for step in steps("ci") if step.get("run", "").startswith("make ")}
    assert hosted - {"sanitize"} | {"address", "thread"} == wanted | {"native"}
    assert "sanitize" in hosted


def test_every_client_is_run(monkeypatch):
    monkeypatch.setattr(sys, "path", [str(ROOT / "tests" / "clients"), *sys.path])
    from matrix import GROUPS

    (job,) = WORKFLOWS["clients"]["jobs"].values()
    named = [group for groups in job["strategy"]["matrix"]["groups"] for group in groups.split()]
    assert sorted(named) == sorted(GROUPS)
    assert all(f"requirements-{group}.txt" in {p.name for p in (ROOT / "tests/clients").iterdir()} for group in named)
