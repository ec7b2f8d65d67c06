"""Sizes of files and functions: ``python tests/sizes.py`` prints the table of CONTRIBUTING."""

import ast
from itertools import chain
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parents[1]
PACKAGES = ("solver", "ccr_gym", "agents")
CODE = ("**/*.py", "native/**/*.cpp", "native/**/*.hpp")


def files(package: str) -> list[Path]:
    """Return the source files of a package, Python and C++."""
    return sorted(chain.from_iterable((ROOT / package).glob(pattern) for pattern in CODE))


def functions(path: Path) -> dict[str, int]:
    """Return the lines of code of every function in a Python file, signature and docstring not counted."""
    if path.suffix != ".py":
        return {}
    defined = (ast.FunctionDef, ast.AsyncFunctionDef)
    nodes = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, defined)]
    return {f"{path.relative_to(ROOT)}:{node.name}": _body_lines(node) for node in nodes}


def _body_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    body = node.body[ast.get_docstring(node) is not None :]
    return body[-1].end_lineno - body[0].lineno + 1 if body else 0


def lines(path: Path) -> int:
    """Return the number of lines of a file."""
    return len(path.read_text().splitlines())


def table() -> str:
    """Return the sizes of each package as a Markdown table."""
    rows = ["| package | files | lines | longest file | functions | median | longest |", "| --- " * 7 + "|"]
    for package in PACKAGES:
        sizes = {path.relative_to(ROOT): lines(path) for path in files(package)}
        bodies = dict(chain.from_iterable(functions(path).items() for path in files(package)))
        longest, largest = max(sizes, key=sizes.__getitem__), max(bodies, key=bodies.__getitem__)
        rows.append(
            f"| `{package}` | {len(sizes)} | {sum(sizes.values()):,} | {sizes[longest]} (`{longest}`) "
            f"| {len(bodies)} | {median(bodies.values()):g} | {bodies[largest]} (`{largest}`) |"
        )
    return "\n".join(rows)


if __name__ == "__main__":
    print(table())
