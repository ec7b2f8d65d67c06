"""Run-time compilation of CasADi functions, for obstacles whose shape is a user's expression."""

import ctypes
import functools
import os
import shlex
import shutil
import subprocess
from pathlib import Path

import casadi as ca

from solver.cache.artefacts import ArtefactStore, artefact_key
from solver.common.signals import held_signals

COMPILERS = ["cc", "gcc", "clang", "c++"]
FLAGS = ("-O2", "-fPIC", "-shared", "-ffp-contract=off")


@functools.cache
def store() -> ArtefactStore:
    """Return the store of compiled functions."""
    return ArtefactStore()


@functools.cache
def function_address(function: ca.Function) -> int:
    """Return the address of a compiled function, valid for the life of the process.

    Its signature is that of CasADi's generated code, ``int f(const double**, double**, int*, double*, int)``.

    Raises:
        RuntimeError: If there is no C compiler, it fails, or its output cannot be written or loaded.
    """
    source = _source(function)
    compiler = _compiler()
    version = subprocess.run([*compiler, "--version"], capture_output=True, text=True, check=False).stdout
    key = artefact_key(source, ca.CasadiMeta.version(), shlex.join(compiler), version, " ".join(FLAGS))
    try:
        path = store().path(key, lambda path: _compile(compiler, source, path), ".so")
    except OSError as error:
        raise RuntimeError(
            f"a compiled shape cannot be written ({error}); make room, or set CCR_GYM_CACHE to a folder that has it"
        ) from error
    library = _load(path)
    _LIBRARIES.append(library)
    address = ctypes.cast(getattr(library, function.name()), ctypes.c_void_p).value
    assert address is not None
    return address


_LIBRARIES: list[ctypes.CDLL] = []  # which stay loaded


def _load(path: Path) -> ctypes.CDLL:
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        raise RuntimeError(
            f"a compiled shape cannot be loaded ({error}); if its folder is mounted noexec, set CCR_GYM_CACHE to "
            "another, or use ReferenceSolver, which compiles nothing"
        ) from error


@held_signals()
def _source(function: ca.Function) -> str:
    """Return the C source of a function."""
    generator = ca.CodeGenerator("law", {"casadi_int": "int"})
    generator.add(function)
    return str(generator.dump())


def _compiler() -> list[str]:
    """Return the command of the C compiler: ``$CC``, or the first of the usual ones that is installed."""
    chosen = os.environ.get("CC", "").strip()
    candidates = [chosen] if chosen else COMPILERS
    for command in map(_split, candidates):
        if shutil.which(command[0]):
            return command
    raise RuntimeError(
        f"no C compiler found (tried {', '.join(candidates)}); custom obstacles are compiled at run time: install one, "
        "set CC, or use ReferenceSolver, which needs none"
    )


def _split(command: str) -> list[str]:
    """Return the words of a command, the whole of it where its quotes do not close."""
    try:
        return shlex.split(command)
    except ValueError:
        return [command]


def _compile(compiler: list[str], source: str, path: Path) -> None:
    input_path = path.with_suffix(".c")
    input_path.write_text(source)
    command = [*compiler, *FLAGS, str(input_path), "-o", str(path), "-lm"]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0 or not path.is_file():
        raise RuntimeError(f"{shlex.join(command)} failed:\n{result.stderr or 'it wrote no file'}")
