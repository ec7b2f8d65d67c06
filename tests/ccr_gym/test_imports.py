"""Imports of ccr_gym: no cycles, public names of the solver only, clear errors about foreign or uncompiled packages."""

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ALLOWED = ("solver", "solver.spatial", "solver.common")


def import_graph(package: Path) -> dict[str, set[str]]:
    """Return the modules that each module of a package imports anywhere in it, by their full names."""
    root = package.parent
    files = {".".join(path.relative_to(root).with_suffix("").parts): path for path in package.rglob("*.py")}
    files = {name.removesuffix(".__init__"): path for name, path in files.items()}
    return {name: _imports(ast.parse(path.read_text()), files.keys()) for name, path in files.items()}


def _imports(tree: ast.Module, modules) -> set[str]:
    """Return the modules that a file imports; ``from package import module`` counts as an import of the module."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports name their package in full"
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name if name in modules else str(node.module) for name in names}
    return found


def find_cycle(graph: dict[str, set[str]]) -> list[str]:
    """Return modules that import each other in a cycle, or nothing."""
    finished: set[str] = set()

    def visit(module: str, path: list[str]) -> list[str]:
        if module in path:
            return path[path.index(module) :]
        if module not in finished:
            for imported in sorted(graph[module] & graph.keys()):
                if cycle := visit(imported, [*path, module]):
                    return cycle
            finished.add(module)
        return []

    return next((cycle for module in sorted(graph) if (cycle := visit(module, []))), [])


def test_find_cycle():
    assert find_cycle({"a": {"b", "numpy"}, "b": {"c"}, "c": set()}) == []
    assert find_cycle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c"]


def test_no_module_imports_itself_through_others():
    assert find_cycle(import_graph(ROOT / "ccr_gym")) == []


def test_only_public_names_of_the_solver_are_imported():
    for module, imported in import_graph(ROOT / "ccr_gym").items():
        inner = {name for name in imported if name.split(".")[0] == "solver"}
        assert all(name in ALLOWED or name.startswith("solver.common.") for name in inner), module


def run(code: str, *path: Path) -> subprocess.CompletedProcess:
    """Run Python code with these folders first on the path, in the first of them."""
    environment = {"PYTHONPATH": ":".join(map(str, path)), "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run([sys.executable, "-c", code], cwd=path[0], env=environment, capture_output=True, text=True)


def last_line(done: subprocess.CompletedProcess) -> str:
    assert done.returncode == 1
    return done.stderr.strip().splitlines()[-1]


@pytest.mark.parametrize("file", ["solver/__init__.py", "solver.py"])
def test_a_foreign_solver_is_named_with_the_remedy(tmp_path, file):
    foreign = tmp_path / file
    foreign.parent.mkdir(exist_ok=True)
    foreign.write_text("raise SystemExit('imported')")
    line = last_line(run("import ccr_gym", tmp_path, ROOT))
    assert line.startswith(f"ImportError: ccr-gym needs its own package 'solver', but Python finds {foreign}: ")
    assert "an environment of its own" in line


def test_foreign_agents_are_named_without_importing_them(tmp_path):
    (tmp_path / "agents").mkdir()
    (tmp_path / "agents" / "__init__.py").write_text("raise SystemExit('imported')")
    assert run("import ccr_gym", tmp_path, ROOT).returncode == 0
    code = "import sys, ccr_gym; sys.modules.pop('agents', None); ccr_gym.check_packages()"
    assert "package 'agents', but Python finds" in last_line(run(code, tmp_path, ROOT))


def test_own_packages_pass():
    assert run("import ccr_gym; ccr_gym.check_packages()", ROOT).returncode == 0


def test_sources_without_a_kernel_are_named_with_the_remedy(tmp_path):
    for name in ("solver", "ccr_gym"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("*.so", "*.pyd", "__pycache__"))
    line = last_line(run("import ccr_gym", tmp_path))
    assert line.startswith(f"ImportError: Python finds {tmp_path / 'solver' / '__init__.py'}, sources without a kernel")
    assert "another folder" in line
    assert "pip install -e ." in line
