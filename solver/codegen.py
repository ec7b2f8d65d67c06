"""Write the C source of the segment and gap laws: ``python codegen.py OUTPUT_DIRECTORY``, run by the build."""

import sys
from pathlib import Path

import casadi as ca
from formulation import GAP_LAWS, arc_function, gap_function, segment_function


def generate(name: str, functions: list[ca.Function], directory: Path) -> None:
    """Write ``name.c`` into an existing directory."""
    generator = ca.CodeGenerator(name, {"casadi_int": "int"})
    for function in functions:
        generator.add(function)
    generator.generate(f"{directory}/")


if __name__ == "__main__":
    generate("segment_laws", [segment_function(), arc_function()], Path(sys.argv[1]))
    generate("gap_laws", [gap_function(law) for law in GAP_LAWS], Path(sys.argv[1]))
