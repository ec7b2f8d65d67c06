"""The store of compiled functions: sound, bounded, shared."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from solver.cache import artefacts
from solver.cache.artefacts import ArtefactStore, artefact_key

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


def test_on_a_full_disk_a_temporary_folder_serves(tmp_path):
    def fill(path):
        path.write_text("half")
        if path.is_relative_to(tmp_path):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    store = ArtefactStore(tmp_path)
    with pytest.warns(UserWarning, match="cannot be written .No space left"):
        assert store.path(artefact_key("full"), fill, ".so").read_text() == "half"
    assert list(tmp_path.iterdir()) == []


PROCESS = """
import sys, time
from pathlib import Path
from solver.cache.artefacts import ArtefactStore
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


@pytest.fixture
def planted(tmp_path):
    """A folder with an artefact that was put there under its right name, and a file of that name."""
    folder = tmp_path / "shared" / "store"
    entry = ArtefactStore(folder).path(KEY, write("planted"), ".so")
    return folder, entry


@pytest.mark.parametrize("mode", [0o777, 0o720, 0o702])
@pytest.mark.parametrize("shared", ["folder", "above"])
def test_a_folder_that_others_may_write_to_is_not_trusted(planted, shared, mode):
    folder, entry = planted
    (folder if shared == "folder" else folder.parent).chmod(mode)
    store = ArtefactStore(folder)
    with pytest.warns(UserWarning, match="set CCR_GYM_CACHE to"):
        built = store.path(artefact_key("another", shared, oct(mode)), write("built"), ".so")
    assert folder not in built.parents
    assert store.path(KEY + shared + oct(mode), write("law"), ".so").read_text() == "law"
    assert entry.read_text() == "planted"


def test_the_sticky_bit_keeps_others_from_putting_something_else_there(planted):
    folder, entry = planted
    folder.parent.chmod(0o1777)
    assert ArtefactStore(folder).path(KEY, refuse, ".so") == entry


@pytest.mark.parametrize("whose", ["folder", "above"])
def test_a_folder_of_somebody_else_is_not_trusted(planted, whose, monkeypatch):
    folder, _ = planted
    lent = folder if whose == "folder" else folder.parent
    real = Path.stat if whose == "above" else Path.lstat

    def of_another(path, **options):
        found = real(path, **options)
        return os.stat_result((*found[:4], found.st_uid + 1234, *found[5:])) if path == lent else found

    monkeypatch.setattr(artefacts.Path, real.__name__, of_another)
    with pytest.warns(UserWarning, match="set CCR_GYM_CACHE to"):
        ArtefactStore(folder).path(artefact_key("of", whose), write("law"), ".so")


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o606])
def test_an_artefact_that_others_may_write_to_is_rebuilt(planted, mode):
    folder, entry = planted
    entry.chmod(mode)
    assert ArtefactStore(folder).path(KEY, write("law"), ".so").read_text() == "law"


def test_a_link_is_no_artefact(planted, tmp_path):
    folder, entry = planted
    entry.replace(tmp_path / "elsewhere")
    entry.symlink_to(tmp_path / "elsewhere")
    assert ArtefactStore(folder).path(KEY, write("law"), ".so").read_text() == "law"


def test_nothing_is_open_to_others_whatever_the_umask(tmp_path):
    before = os.umask(0)
    try:
        entry = ArtefactStore(tmp_path / "new" / "store").path(KEY, write("law"), ".so")
    finally:
        os.umask(before)
    assert [path.stat().st_mode & 0o777 for path in (entry, *entry.parents[:2])] == [0o700] * 3
    assert ArtefactStore(tmp_path / "new" / "store").path(KEY, refuse, ".so") == entry
