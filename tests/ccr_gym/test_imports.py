"""Clear errors about packages of other projects that are named solver or agents, and about an uncompiled checkout."""

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from solver import _kernel

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def installed(tmp_path_factory) -> Path:
    """A folder with the packages and the compiled kernel, as an installation that is not editable has them."""
    folder = tmp_path_factory.mktemp("site-packages")
    for name in ("solver", "ccr_gym", "agents"):
        ignored = shutil.ignore_patterns("__pycache__", "native", "pretrained")
        shutil.copytree(ROOT / name, folder / name, ignore=ignored)
    kernel = Path(_kernel.__file__)
    shutil.copy(kernel, folder / "solver" / kernel.name)
    return folder


def run(code: str, *path: Path) -> subprocess.CompletedProcess:
    """Run Python code with these folders first on the path, in the first of them.

    Without ``site``, as an editable installation finds its packages before any folder on the path.
    """
    folders = map(str, (*path, sysconfig.get_path("purelib"), sysconfig.get_path("platlib")))
    environment = {"PYTHONPATH": os.pathsep.join(folders), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-S", "-c", code]
    return subprocess.run(command, cwd=path[0], env=environment, capture_output=True, text=True)


def last_line(done: subprocess.CompletedProcess) -> str:
    assert done.returncode == 1
    return done.stderr.strip().splitlines()[-1]


@pytest.mark.parametrize("file", ["solver/__init__.py", "solver.py"])
def test_a_foreign_solver_is_named_with_the_remedy(tmp_path, installed, file):
    foreign = tmp_path / file
    foreign.parent.mkdir(exist_ok=True)
    foreign.write_text("raise SystemExit('imported')")
    line = last_line(run("import ccr_gym", tmp_path, installed))
    assert line.startswith(f"ImportError: ccr-gym needs its own package 'solver', but Python finds {foreign}: ")
    assert "an environment of its own" in line


def test_foreign_agents_are_named_without_importing_them(tmp_path, installed):
    (tmp_path / "agents").mkdir()
    (tmp_path / "agents" / "__init__.py").write_text("raise SystemExit('imported')")
    done = run("import ccr_gym", tmp_path, installed)
    assert done.returncode == 0
    assert "package 'agents', but Python finds" in done.stderr
    code = "import sys, ccr_gym; sys.modules.pop('agents', None); ccr_gym.check_packages()"
    assert "package 'agents', but Python finds" in last_line(run(code, tmp_path, installed))


def test_own_packages_pass(installed):
    assert run("import ccr_gym; ccr_gym.check_packages()", installed).returncode == 0


def test_sources_without_a_kernel_are_named_with_the_remedy(tmp_path):
    for name in ("solver", "ccr_gym"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("*.so", "*.pyd", "__pycache__"))
    line = last_line(run("import ccr_gym", tmp_path))
    assert line.startswith(f"ImportError: Python finds {tmp_path / 'solver' / '__init__.py'}, sources without a kernel")
    assert "another folder" in line
    assert "pip install -e ." in line
