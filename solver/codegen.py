"""Write the C source of the segment and gap laws: ``python codegen.py OUTPUT_DIRECTORY``, run by the build."""

import sys
from pathlib import Path

import casadi as ca
from formulation import GAP_LAWS, gap_function, segment_function


def generate(directory: Path) -> None:
    """Write ``laws.c`` and ``laws.h`` into an existing directory."""
    generator = ca.CodeGenerator("laws", {"with_header": True, "casadi_int": "int"})
    generator.add(segment_function())
    for kind in GAP_LAWS:
        generator.add(gap_function(kind))
    generator.generate(f"{directory}/")


if __name__ == "__main__":
    generate(Path(sys.argv[1]))
