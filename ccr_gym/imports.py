"""Checks that the packages named solver and agents are those of ccr-gym: both names are in use elsewhere too."""

import importlib
import importlib.util
from pathlib import Path

MARKER = 'PART_OF = "ccr-gym"'  # in the __init__.py of solver and agents


def check_packages(*names: str) -> None:
    """Raise an error if another package has taken one of the names; imports nothing.

    Args:
        *names: Top-level names; by default ``"solver"`` and ``"agents"``.

    Raises:
        ImportError: Naming the path that was found and the remedy.
    """
    for name in names or ("solver", "agents"):
        spec = importlib.util.find_spec(name)
        found = (
            "nothing"
            if spec is None
            else spec.origin or f"the folder {', '.join(spec.submodule_search_locations or ())}"
        )
        if not (
            spec and spec.origin and spec.has_location and MARKER in Path(spec.origin).read_text("utf-8", "replace")
        ):
            raise ImportError(
                f"ccr-gym needs its own package {name!r} but Python finds {found}: install ccr-gym in an environment "
                f"of its own, or uninstall or rename the other {name!r} and reinstall ccr-gym",
                name=name,
            )


def check_kernel() -> None:
    """Raise an error if solver is the source folder of a checkout, in which no kernel is compiled.

    Raises:
        ImportError: Naming the folder and the remedy.
    """
    try:
        importlib.import_module("solver")
    except ImportError as error:
        if error.name != "solver._kernel" and "cannot import name '_kernel'" not in str(error):
            raise
        spec = importlib.util.find_spec("solver")
        folder = Path(spec.origin).parent if spec and spec.origin else "solver"
        raise ImportError(
            f"{folder} holds sources without a compiled kernel, and hides an installed ccr-gym: run Python from "
            "another folder, or install the sources with `pip install -e .`",
            name="solver._kernel",
        ) from None
