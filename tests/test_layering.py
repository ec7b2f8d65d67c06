"""Imports point one way, agents → ccr_gym → solver, and the environments need no learning or drawing library."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LAYERS = ["solver", "ccr_gym", "agents"]
OPTIONAL = ["torch", "stable_baselines3", "matplotlib", "pygame"]


def imported(path: Path) -> set[str]:
    """Top-level names a file imports anywhere in it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add((node.module or "").split(".")[0] if node.level == 0 else path.relative_to(ROOT).parts[0])
    return names


@pytest.mark.parametrize("layer", LAYERS)
def test_imports_point_down(layer):
    above = set(LAYERS[LAYERS.index(layer) + 1 :])
    files = list((ROOT / layer).rglob("*.py"))
    assert files
    for path in files:
        assert not imported(path) & above, path


@pytest.mark.parametrize("package", ["solver", "ccr_gym"])
def test_import_is_light(package):
    code = f"import sys, {package}; print(*(name for name in {OPTIONAL} if name in sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert loaded == []
