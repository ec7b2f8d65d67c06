"""The store of compiled functions: sound, bounded, shared."""

import subprocess
import sys

import pytest

from solver.artefacts import ArtefactStore, artefact_key

KEY = artefact_key("formulation", "casadi", "cc")


@pytest.fixture
def store(tmp_path):
    return ArtefactStore(tmp_path / "store")


def write(text):
    return lambda path: path.write_text(text)


def refuse(path):
    raise AssertionError("built again")


def test_an_artefact_is_built_once(store):
    built = store.path(KEY, write("law"), ".so")
    assert built.read_text() == "law"
    assert store.path(KEY, refuse, ".so") == built
    assert store.statistics[:3] == (1, 1, 0)
    assert store.statistics.bytes == 3


@pytest.mark.parametrize("damage", ["", "la", "lax", "law and more"])
def test_a_damaged_artefact_is_rebuilt(store, damage):
    store.path(KEY, write("law"), ".so").write_text(damage)
    assert store.path(KEY, write("law"), ".so").read_text() == "law"
    assert store.statistics[:3] == (0, 1, 1)


def test_a_failed_build_leaves_nothing(store, tmp_path):
    def fail(path):
        path.write_text("half")
        raise RuntimeError("no compiler")

    with pytest.raises(RuntimeError, match="no compiler"):
        store.path(KEY, fail, ".so")
    assert list((tmp_path / "store").iterdir()) == []


def test_the_least_recently_used_goes_first(tmp_path):
    store = ArtefactStore(tmp_path, capacity=10)
    keys = [artefact_key(name) for name in "abc"]
    for key in keys[:2]:
        store.path(key, write("12345"), ".so")
    store.path(keys[0], refuse, ".so")
    store.path(keys[2], write("12345"), ".so")
    store.path(keys[0], refuse, ".so")
    assert store.statistics.bytes == 10
    assert store.path(keys[1], write("anew!"), ".so").read_text() == "anew!"


def test_keys_keep_their_parts_apart():
    assert len({artefact_key("a", "bc"), artefact_key("ab", "c"), artefact_key("abc"), artefact_key("abc", "")}) == 4


def test_where_nothing_can_be_written_a_temporary_folder_serves(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    store = ArtefactStore(blocked / "store")
    with pytest.warns(UserWarning, match="cannot be written"):
        assert store.path(KEY, write("law"), ".so").read_text() == "law"
    assert store.path(KEY, refuse, ".so").read_text() == "law"


PROCESS = """
import sys, time
from pathlib import Path
from solver.artefacts import ArtefactStore
def build(path):
    path.write_text("law")
    time.sleep(0.3)
store = ArtefactStore(Path(sys.argv[1]))
for k in range(3):
    assert store.path(f"key{k}", build, ".so").read_text() == "law"
"""


def test_processes_build_at_once(tmp_path):
    processes = [subprocess.Popen([sys.executable, "-c", PROCESS, str(tmp_path)]) for _ in range(3)]
    assert [process.wait(60) for process in processes] == [0, 0, 0]
    assert len(list(tmp_path.iterdir())) == 3
