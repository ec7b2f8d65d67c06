"""Checks that the packages named solver and agents are those of ccr-gym; other projects use these names as well."""

import importlib
import importlib.util
import warnings
from importlib.machinery import ModuleSpec

MARKER = 'PART_OF = "ccr-gym"'  # in the __init__.py of solver and agents


def check_packages(*names: str) -> None:
    """Raise an error if Python finds another package under one of the names; imports none of them.

    Args:
        *names: Top-level names; by default ``"solver"`` and ``"agents"``.

    Raises:
        ImportError: Naming the path that was found and the remedy.
    """
    for name in names or ("solver", "agents"):
        spec = importlib.util.find_spec(name)
        if spec is None or not _is_ours(spec):
            raise ImportError(
                f"ccr-gym needs its own package {name!r}, but Python finds {_location(spec)}: rename or uninstall that "
                "one and reinstall ccr-gym, or install ccr-gym in an environment of its own",
                name=name,
            )


def warn_of_foreign_agents() -> None:
    """Warn in one line if another package is named agents; the environments themselves do without ours."""
    if importlib.util.find_spec("agents") is None:
        return
    try:
        check_packages("agents")
    except ImportError as error:
        warnings.warn(str(error), stacklevel=3)


def check_kernel() -> None:
    """Raise an error if solver has no compiled kernel, as in a checkout whose sources hide the installed package.

    Raises:
        ImportError: Naming the path that was found and the remedy.
    """
    try:
        importlib.import_module("solver")
    except ImportError as error:
        if error.name != "solver._kernel" and "cannot import name '_kernel'" not in str(error):
            raise
        raise ImportError(
            f"Python finds {_location(importlib.util.find_spec('solver'))}, sources without a kernel compiled for this "
            "Python: run it from another folder to use the installed ccr-gym, or compile them by `pip install -e .`",
            name="solver._kernel",
        ) from None


def _is_ours(spec: ModuleSpec) -> bool:
    """Return whether the source of a package has the marker; one without source is given the benefit of the doubt."""
    get_source = getattr(spec.loader, "get_source", None)
    source = get_source(spec.name) if get_source else None
    return source is None or MARKER in source


def _location(spec: ModuleSpec | None) -> str:
    """Return the file of a package, or the folders of one without an ``__init__.py``."""
    if spec is None:
        return "none of this name"
    return spec.origin or ", ".join(spec.submodule_search_locations or ())
