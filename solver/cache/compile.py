"""CasADi functions compiled at run time, for obstacles whose shape is an expression of the user's own."""

import ctypes
import functools
import os
import shlex
import shutil
import subprocess
from pathlib import Path

import casadi as ca

from solver.cache.artefacts import ArtefactStore, artefact_key

COMPILERS = ["cc", "gcc", "clang", "c++"]
FLAGS = ("-O2", "-fPIC", "-shared", "-ffp-contract=off")


@functools.cache
def store() -> ArtefactStore:
    """Where compiled laws are kept."""
    return ArtefactStore()


@functools.cache
def function_address(function: ca.Function) -> int:
    """Return the address of a compiled function, valid for good.

    Its type is that of CasADi's generated code, ``int f(const double**, double**, int*, double*, int)``.

    Raises:
        RuntimeError: If there is no C compiler, it fails, or what it makes cannot be loaded.
    """
    source = _source(function)
    compiler = _compiler()
    version = subprocess.run([*compiler, "--version"], capture_output=True, text=True, check=False).stdout
    key = artefact_key(source, ca.CasadiMeta.version(), shlex.join(compiler), version, " ".join(FLAGS))
    library = _load(store().path(key, lambda path: _compile(compiler, source, path), ".so"))
    _LIBRARIES.append(library)
    address = ctypes.cast(getattr(library, function.name()), ctypes.c_void_p).value
    assert address is not None
    return address


_LIBRARIES: list[ctypes.CDLL] = []  # stay loaded


def _load(path: Path) -> ctypes.CDLL:
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        raise RuntimeError(
            f"a compiled shape cannot be loaded ({error}); where the folder is mounted noexec, set CCR_GYM_CACHE to "
            "another, or use ReferenceSolver, which compiles nothing"
        ) from error


def _source(function: ca.Function) -> str:
    generator = ca.CodeGenerator("law", {"casadi_int": "int"})
    generator.add(function)
    return str(generator.dump())


def _compiler() -> list[str]:
    chosen = os.environ.get("CC", "").strip()
    candidates = [chosen] if chosen else COMPILERS
    for command in map(_words, candidates):
        if shutil.which(command[0]):
            return command
    raise RuntimeError(
        f"{' or '.join(candidates)} is not there, and a shape given as an expression is compiled for the solver; "
        "install a C compiler or set CC to one, or use ReferenceSolver, which needs none"
    )


def _words(command: str) -> list[str]:
    try:
        return shlex.split(command)
    except ValueError:  # quotes that do not close
        return [command]


def _compile(compiler: list[str], source: str, path: Path) -> None:
    written = path.with_suffix(".c")
    written.write_text(source)
    command = [*compiler, *FLAGS, str(written), "-o", str(path), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{shlex.join(command)} failed:\n{done.stderr}")
