"""Imports point one way, between packages and inside them, and the environments need no learning or drawing library."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from itertools import chain
from pathlib import Path
from statistics import median

import pytest
from sizes import PACKAGES, ROOT, files, functions, lines

OPTIONAL = ["torch", "stable_baselines3", "matplotlib", "pygame"]
PUBLIC = {"solver", "solver.spatial", "ccr_gym", "agents"}
# What the modules of a room may import of this project, beside their own room.
ROOMS = {
    "solver.cache": {"solver.common.signals", "solver.common.validation"},
    "solver.common": {"solver._kernel", "solver.cache"},
    "solver.planar": {"solver._kernel", "solver.common", "solver.cache"},
    "solver.spatial": {"solver._kernel", "solver.common", "solver.cache"},
    "ccr_gym": {"solver", "solver.spatial", "solver.common"},
    "agents": {"solver", "solver.spatial", "ccr_gym"},
}


def imported(path: Path) -> set[str]:
    """Modules of this project that a file imports anywhere in it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports by a relative name"
            names |= {_module(node.module or "", alias.name) for alias in node.names}
    return {name for name in names if name.split(".")[0] in PACKAGES}


def _module(module: str, name: str) -> str:
    """The submodule where a name is one, else the module."""
    inner = ROOT.joinpath(*module.split("."), name)
    is_module = name == "_kernel" or inner.with_suffix(".py").exists() or inner.is_dir()
    return f"{module}.{name}" if is_module else module


def sources(room: str) -> list[Path]:
    return sorted(ROOT.joinpath(*room.split(".")).rglob("*.py"))


@pytest.mark.parametrize("room", ROOMS)
def test_imports_point_down(room):
    assert sources(room)
    for path in sources(room):
        for name in imported(path):
            allowed = name in ROOMS[room] or any(name.startswith(f"{other}.") for other in ROOMS[room] - PUBLIC)
            assert allowed or name == room or name.startswith(f"{room}."), f"{path} imports {name}"


@pytest.mark.parametrize("package", PACKAGES)
def test_no_circle(package):
    modules = {_name(path): path for path in sources(package)}
    graph = {name: {other for other in imported(path) if other in modules} - {name} for name, path in modules.items()}
    assert list(TopologicalSorter(graph).static_order())


def _name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def test_users_import_four_packages():
    users = [*(ROOT / "examples").glob("*.py"), *(ROOT / "docs").rglob("*.py")]
    for path in users:
        assert imported(path) <= PUBLIC, path


@pytest.mark.parametrize("package", ["solver", "ccr_gym", "agents"])
def test_import_is_light(package):
    code = f"import sys, {package}; print(*(name for name in {OPTIONAL} if name in sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert loaded == []


def test_files_and_functions_are_small():
    every = [path for package in PACKAGES for path in files(package)]
    bodies = dict(chain.from_iterable(functions(path).items() for path in every))
    assert {path.name: lines(path) for path in every if lines(path) > 350} == {}
    assert {name: size for name, size in bodies.items() if size > 50} == {}
    assert median(bodies.values()) <= 6
