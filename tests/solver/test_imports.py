"""Imports inside the solver: plane and space share what is common, and never import each other."""

import ast
from pathlib import Path

import pytest

import solver

ROOT = Path(solver.__file__).parent
ALLOWED = {
    "common": {"_kernel", "cache", "common"},
    "cache": {"cache", "common.validation"},
    "planar": {"_kernel", "common", "planar"},
    "spatial": {"_kernel", "common", "spatial"},
}


def imported(path):
    """Names below ``solver`` that a file imports, such as ``common.scene``."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module == "solver":
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("solver."):
            names.add(node.module.removeprefix("solver."))
        elif isinstance(node, ast.Import):
            names |= {alias.name.removeprefix("solver.") for alias in node.names if alias.name.startswith("solver")}
    return names


@pytest.mark.parametrize("folder", ALLOWED)
def test_imports_point_one_way(folder):
    files = list((ROOT / folder).glob("*.py"))
    assert files
    for path in files:
        for name in imported(path):
            assert any(name == allowed or name.startswith(f"{allowed}.") for allowed in ALLOWED[folder]), (path, name)


def test_cache_is_a_leaf_of_the_solver():
    assert imported(ROOT / "common" / "validation.py") == set()
