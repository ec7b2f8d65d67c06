"""Generator of the C source of segment and gap laws, run by the build: ``python codegen.py OUTPUT_DIRECTORY``."""

import sys
from pathlib import Path
from types import ModuleType

import casadi as ca

for name in ("solver", "solver.spatial"):  # whose __init__ needs the kernel, which is still to be built
    sys.modules[name] = package = ModuleType(name)
    package.__path__ = [str(Path(__file__).parent.joinpath(*name.split(".")[1:]))]

from solver.common import transition_laws  # noqa: E402
from solver.common.gap_laws import clearance_function, gap_function, growth_function  # noqa: E402
from solver.planar import formulation as planar  # noqa: E402
from solver.spatial import arc  # noqa: E402
from solver.spatial import formulation as spatial  # noqa: E402


def generate(name: str, functions: list[ca.Function], directory: Path) -> None:
    """Write the C source of some functions as ``name.c`` into an existing directory."""
    generator = ca.CodeGenerator(name, {"casadi_int": "int"})
    for function in functions:
        generator.add(function)
    generator.generate(f"{directory}/")


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    in_space = [spatial.closure_function(), spatial.bend_function(), spatial.hessian_contraction_function()]
    of_arcs = [arc.arc_function(), arc.arc_hessian_function(), arc.cable_function(), arc.cable_hessian_function()]
    generate("segment_laws", [planar.segment_function(), planar.arc_function(), *in_space], folder)
    generate("arc_laws", of_arcs, folder)
    generate("disk_laws", [planar.disk_gap_function()], folder)
    kinds = (*planar.GAP_LAWS, *spatial.GAP_LAWS)
    generate("gap_laws", [function(law) for law in kinds for function in (gap_function, clearance_function)], folder)
    in_inputs = [
        planar.segment_inputs_function("ccr_segment_pull", in_length=False),
        planar.segment_inputs_function("ccr_segment_inputs", in_length=True),
        planar.disk_gap_length_function(),
        spatial.input_contraction_function(),
        arc.cable_length_function(),
    ]
    round_kinds = planar.CIRCLE, planar.ELLIPSE, planar.CAPSULE, spatial.SPHERE, spatial.CAPSULE
    generate("slope_laws", [*in_inputs, *map(growth_function, round_kinds)], folder)
    generate("transition_laws", transition_laws.functions(), folder)
