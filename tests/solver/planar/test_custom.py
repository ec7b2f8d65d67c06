"""Shapes given as expressions: a custom ellipse is the ellipse, and a new shape is as exact as any."""

import errno
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from solver import Custom, Ellipse, Family, ReferenceSolver, Robot, Scene, Solver, Status
from solver.cache import compile
from solver.cache.artefacts import ArtefactStore
from solver.cache.compile import store
from solver.common.robot import MODELS

ELLIPSE = Family.trace(lambda point, sizes: (point[0] / sizes[0]) ** 2 + (point[1] / sizes[1]) ** 2 - 1, sizes=2)
EGG = Family.trace(lambda point, sizes: (point[0] ** 2 + point[1] ** 2 + sizes[0] * point[0]) ** 2 - sizes[1] ** 4, 2)
PLACE = {"center": (44, 104), "axis": (1, 2)}
EVERY_MODEL = pytest.mark.parametrize("model", MODELS)


def egg(**changes):
    return Custom(**{"family": EGG, "sizes": (6, 12), "center": (44, 104), "axis": (1, 2), "reach": 20, **changes})


def pulled(robot, obstacle, solver=Solver):
    equilibrium = solver(robot, Scene([obstacle])).rest()
    solver = solver(robot, Scene([obstacle]))
    for cable in np.arange(0.25, 9.01, 0.25):
        equilibrium = solver.step(equilibrium, cable)
        yield equilibrium


def test_a_custom_ellipse_is_the_ellipse():
    custom = Custom(family=ELLIPSE, sizes=(15, 9), reach=16, **PLACE)
    ellipse = Ellipse(radii=(15, 9), **PLACE)
    points = np.array([[(30.0, 80.0), (50.0, 120.0)], [(44.0, 115.0), (60.0, 90.0)]])
    assert custom.gap(points) == pytest.approx(ellipse.gap(points), abs=1e-12)
    assert custom.normal_at(points) == pytest.approx(ellipse.normal_at(points), abs=1e-12)
    assert custom.extent.inradius == pytest.approx(ellipse.extent.inradius, rel=5e-3)
    assert custom.extent.min_curvature_radius == pytest.approx(ellipse.extent.min_curvature_radius, rel=1e-2)
    for ours, theirs in zip(
        pulled(Robot.prototype(model="paper"), custom), pulled(Robot.prototype(model="paper"), ellipse), strict=True
    ):
        assert ours.nodes == pytest.approx(theirs.nodes, abs=1e-9)
        assert ours.multipliers == pytest.approx(theirs.multipliers, abs=1e-12)


@EVERY_MODEL
@pytest.mark.parametrize("spring", [None, 0.5])
def test_certificate(model, spring):
    states = list(pulled(replace(Robot.prototype(model="paper"), model=model), egg(spring=spring)))
    assert states[-1].contact.any()
    for state in states:
        assert state.status is Status.CONVERGED
        assert max(state.residuals()) < 1e-9


def test_the_reference_solver_needs_no_compiler(monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    shape = egg(family=Family.trace(lambda point, _: point[0] ** 2 + 2 * point[1] ** 2 - 200), sizes=())
    reference = list(pulled(Robot.prototype(model="paper"), shape, ReferenceSolver))[-1]
    assert reference.status is Status.CONVERGED
    with pytest.raises(RuntimeError, match=r"no C compiler found \(tried no-such-compiler\)"):
        Solver(Robot.prototype(model="paper"), Scene([shape]))
    monkeypatch.undo()
    assert list(pulled(Robot.prototype(model="paper"), shape))[-1].nodes == pytest.approx(reference.nodes, abs=1e-6)


@pytest.mark.parametrize(("command", "said"), [("false", ""), ("true", "it wrote no file")])
def test_a_compiler_that_fails_is_named(monkeypatch, command, said):
    monkeypatch.setenv("CC", command)
    with pytest.raises(RuntimeError, match=rf"{command} .* failed:\n{said}"):
        Solver(
            Robot.prototype(model="paper"),
            Scene([egg(family=Family.trace(lambda point, _: point[0] ** 2 + point[1] ** 2 - 90), sizes=())]),
        )


@pytest.mark.filterwarnings("ignore:.*cannot be written")
def test_a_disk_that_takes_nothing_is_named(monkeypatch):
    def fail(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(compile, "store", ArtefactStore)
    monkeypatch.setattr(compile, "_compile", fail)
    with pytest.raises(RuntimeError, match=r"a compiled shape cannot be written .*No space left.* make room"):
        Solver(
            Robot.prototype(model="paper"),
            Scene([egg(family=Family.trace(lambda p, _: p[0] ** 2 + p[1] ** 2 - 92), sizes=())]),
        )


@pytest.mark.parametrize("command", ["", "  "])
def test_an_empty_name_of_a_compiler_is_none(monkeypatch, command):
    monkeypatch.setenv("CC", command)
    Solver(
        Robot.prototype(model="paper"),
        Scene([egg(family=Family.trace(lambda p, _: p[0] ** 2 + 3 * p[1] ** 2 - 90), sizes=())]),
    )


def test_quotes_that_do_not_close_are_no_compiler(monkeypatch):
    monkeypatch.setenv("CC", "gcc '")
    with pytest.raises(RuntimeError, match=r"no C compiler found \(tried gcc '\)"):
        Solver(
            Robot.prototype(model="paper"),
            Scene([egg(family=Family.trace(lambda p, _: p[0] ** 2 + p[1] ** 2 - 91), sizes=())]),
        )


NOEXEC = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c"]


def test_a_folder_that_nothing_runs_from_is_named(tmp_path):
    run = (
        f"mount -t tmpfs -o noexec,mode=700 none {tmp_path} && CCR_GYM_CACHE={tmp_path}/cache exec {sys.executable} -c"
    )
    if subprocess.run([*NOEXEC, f"mount -t tmpfs none {tmp_path}"], capture_output=True).returncode:
        pytest.skip("needs mounts of its own")
    done = subprocess.run([*NOEXEC, f"{run} '{SOLVE}'"], capture_output=True, text=True)
    assert done.returncode == 1
    assert "a compiled shape cannot be loaded" in done.stderr.splitlines()[-1]


def test_outline():
    shape = egg()
    outline = shape.outline()
    assert shape.gap(outline) == pytest.approx(0, abs=1e-10)
    assert np.linalg.norm(shape.normal_at(outline), axis=-1) == pytest.approx(1, abs=1e-10)
    assert shape.shifted((3, -2)).outline() == pytest.approx(outline + np.array([3, -2]), abs=1e-10)


SOLVE = """
from solver import Custom, Family, Robot, Scene, Solver
family = Family.trace(lambda point, sizes: (point[0] / sizes[0]) ** 2 + (point[1] / sizes[1]) ** 2 - 1, sizes=2)
shape = Custom(family=family, sizes=(14, 9), center=(44, 104), reach=16)
solver = Solver(Robot.prototype(model="paper"), Scene([shape]))
print(solver.step(solver.rest(), 8.0).tension.hex())
"""


def solve(folder):
    command = [sys.executable, "-c", SOLVE]
    return subprocess.run(
        command, env={"CCR_GYM_CACHE": str(folder), "PATH": "/usr/bin:/bin"}, capture_output=True, text=True, check=True
    ).stdout


@pytest.mark.parametrize("damage", [b"", b"not a library", None])
def test_a_damaged_library_is_rebuilt(tmp_path, damage):
    before = solve(tmp_path)
    (library,) = tmp_path.glob("*.so")
    library.write_bytes(library.read_bytes()[:5000] if damage is None else damage)
    assert solve(tmp_path) == before
    (rebuilt,) = tmp_path.glob("*.so")
    assert rebuilt.read_bytes()[:4] == b"\x7fELF"


def test_families_of_one_expression_share_a_library():
    again = Family.trace(lambda point, sizes: (point[0] / sizes[0]) ** 2 + (point[1] / sizes[1]) ** 2 - 1, sizes=2)
    assert again == ELLIPSE
    Solver(Robot.prototype(model="paper"), Scene([Custom(family=ELLIPSE, sizes=(15, 9), reach=16, **PLACE)]))
    built = store().statistics.builds
    Solver(Robot.prototype(model="paper"), Scene([Custom(family=again, sizes=(11, 10), reach=16, **PLACE)]))
    assert store().statistics.builds == built


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"sizes": (6,)}, r"sizes is \(6.0,\); its family takes 2 numbers"),
        ({"reach": 8}, "reach is 8.0; the shape extends beyond it"),
        ({"reach": -1}, "reach is -1; it must be positive"),
        ({"sizes": (6, 0)}, "is not negative at its centre"),
        ({"axis": (0, 0)}, r"axis is \(0, 0\)"),
        ({"center": (0, np.nan)}, "center is .*nan.*; it must be finite"),
    ],
)
def test_bad_shapes_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        egg(**change)


LIBRARY = """
#include <stdio.h>
__attribute__((constructor)) static void loaded(void) { fclose(fopen("WITNESS", "w")); }
static const long long scalar[] = {1, 1, 0, 1, 0}, point[] = {2, 1, 0, 2, 0, 1}, none[] = {0, 1, 0, 0};
int planted(const double** a, double** r, long long* i, double* w, int m) { r[0][0] = a[0][0] - 1; return 0; }
long long planted_n_in(void) { return 2; }
long long planted_n_out(void) { return 1; }
const long long* planted_sparsity_in(long long i) { return i ? none : point; }
const long long* planted_sparsity_out(long long i) { return scalar; }
int planted_work(long long* a, long long* r, long long* i, long long* w) { *a = 2; *r = 1; *i = *w = 0; return 0; }
"""


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_a_family_from_elsewhere_loads_no_library(tmp_path):
    """CasADi's own text of a function names a library, which deserialising it loads."""
    witness, library = tmp_path / "loaded", tmp_path / "planted.so"
    (tmp_path / "planted.c").write_text(LIBRARY.replace("WITNESS", str(witness)))
    subprocess.run(["cc", "-shared", "-fPIC", str(tmp_path / "planted.c"), "-o", str(library)], check=True)
    external = "import casadi, sys; print(casadi.external('planted', sys.argv[1]).serialize(), end='')"
    listed = subprocess.run([sys.executable, "-c", external, str(library)], capture_output=True, text=True, check=True)
    witness.unlink()
    refused = "import sys; from solver import Family; Family(sys.argv[1]).function"
    run = subprocess.run([sys.executable, "-c", refused, listed.stdout], capture_output=True, text=True)
    assert "make families by Family.trace" in run.stderr
    assert not witness.exists()


def test_a_family_is_rebuilt_from_its_text():
    def function(point, sizes):
        bent = ca.if_else(point[0] > 1, point[1], sizes[0]) + ca.fmax(point[1], 0.1) ** 2.5
        return (
            (point[0] / sizes[0]) ** 2 + bent * ca.sin(sizes[1]) - sizes[0] ** point[1] + ca.atan2(*ca.vertsplit(point))
        )

    point, sizes = ca.SX.sym("point", 2), ca.SX.sym("sizes", 2)
    traced = ca.Function("traced", [point, sizes], [function(point, sizes)])
    points = np.random.default_rng(0).uniform(-3, 3, (2, 100))
    again = Family(Family.trace(function, sizes=2).text)
    ours, theirs = (np.asarray(function(points, [2.0, 0.7])) for function in (again.function, traced))
    assert np.array_equal(ours, theirs, equal_nan=True)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[" * 100_000,
        '{"sizes": 0}',
        '{"sizes": -1, "steps": [["CONST", 0, 1.0], ["OUTPUT", 0]]}',
        '{"sizes": 1000000000000, "steps": [["CONST", 0, 1.0], ["OUTPUT", 0]]}',
        '{"sizes": 0, "steps": []}',
        '{"sizes": 0, "steps": [["INPUT", 0, 0, 2], ["OUTPUT", 0]]}',
        '{"sizes": 0, "steps": [["CONST", 0, 1.0], ["ADD", 0, 0], ["OUTPUT", 0]]}',
        '{"sizes": 0, "steps": [["SIN", 0, 1], ["OUTPUT", 0]]}',
    ],
)
def test_a_text_that_is_no_family_is_refused(text):
    with pytest.raises(ValueError, match="make families by"):
        Family(text)


def disc(point):
    return ca.norm_2(point) - 12


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (
            lambda point, _: ca.floor(disc(point)) + 0.5,
            "is not finite at the point .* of the shape's outline",
        ),
        (lambda point, _: ca.if_else(disc(point) < 0, -1, 1), "the gap or its slope is not finite at the point"),
        (lambda point, _: ca.sign(disc(point)), "the gap or its slope is not finite at the point"),
        (lambda point, _: disc(point) ** 3, "at the point .* give a function that is smooth there"),
        (lambda point, _: disc(point) * 1e-200, "the gap or its slope is not finite at the point"),
        (lambda point, _: disc(point) + 3 * ca.sign(disc(point)), "the function jumps at the point"),
        (
            lambda point, _: disc(point) * (1 + 0.5 * ca.sin(1e8 * disc(point))),
            "at the point .* of the shape's outline",
        ),
        (
            lambda point, _: ca.fmin(ca.norm_2(point) - 5, ca.norm_2(point - ca.DM([12, 0])) - 5),
            "the ray from the centre meets the outline more than once at the point .*; move the centre",
        ),
    ],
)
def test_functions_that_give_no_distance_are_refused(function, message):
    with pytest.raises(ValueError, match=message):
        Custom(family=Family.trace(function), center=(44, 104), axis=(1, 2), reach=20)


def test_the_point_named_is_on_the_outline():
    bent = Family.trace(lambda point, _: ca.if_else(point[0] > 0, 1, disc(point) ** 2) * disc(point))
    with pytest.raises(ValueError, match="at the point") as refusal:
        Custom(family=bent, center=(44, 104), axis=(1, 2), reach=20)
    x, y = map(float, re.search(r"\((\S+), (\S+)\)", str(refusal.value)).groups())
    assert np.hypot(x - 44, y - 104) == pytest.approx(12, abs=1e-4)


@pytest.mark.parametrize("sharpness", [2, 4, 8, 16])
def test_smooth_shapes_are_taken_however_they_are_scaled(sharpness):
    for scale in (1e-12, 1.0, 1e12):
        power = Family.trace(lambda point, sizes, scale=scale: scale * (ca.sum1((point / sizes) ** sharpness) - 1), 2)
        shape = Custom(family=power, sizes=(15, 9), center=(44, 104), axis=(1, 2), reach=20)
        assert np.abs(shape.gap(shape.outline())).max() < 1e-9


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: egg(family=None), TypeError, "family is None; it must be a Family: trace a function"),
        (lambda: egg(sizes=("6", 12)), ValueError, "a number of sizes is '6'; it must be finite"),
        (lambda: egg(sizes=6), ValueError, "sizes is 6; it must be a tuple of numbers"),
        (lambda: egg(reach=True), ValueError, "reach is True; it must be positive"),
        (lambda: Family([]), TypeError, r"text is \[\]; it must be a str: make families by"),
        (lambda: Family.trace(None), TypeError, "function is None; it must be a function"),
        (lambda: Family.trace(lambda point, _: point), ValueError, "it must return one CasADi expression"),
        (lambda: Family.trace(lambda point, _: 3.0), ValueError, "function returned 3.0; it must return one CasADi"),
        (lambda: Family.trace(lambda point, _: point[0], -1), ValueError, "sizes is -1; it must be a whole number"),
        (lambda: Family.trace(lambda point, sizes: sizes[1], 1), ValueError, "function fails on CasADi symbols"),
    ],
)
def test_bad_families_are_refused(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_a_function_that_calls_another_makes_no_family():
    def function(point, _):
        inner = ca.SX.sym("inner", 2)
        return ca.Function("inner", [inner], [inner[0] - 1], {"never_inline": True})(point)

    with pytest.raises(ValueError, match="calls another function"):
        Family.trace(function)
