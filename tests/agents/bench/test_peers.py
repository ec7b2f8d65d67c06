import json
import sys

import numpy as np
import pytest

from agents.bench.peers import (
    CAP,
    CONTACTS,
    MujocoChain,
    free_tip_error,
    mujoco_path,
    our_path,
    rod,
    sqp_times,
)


def test_the_sqp_method_finds_our_nodes():
    found = sqp_times(pulls=(1.25, 5.0, 5.25))
    assert found["failures"] == 0
    assert found["difference_mm"] < 1e-4
    assert found["touching"] == [False, False, True]
    json.dumps(found)


def test_without_mujoco_the_remedy_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(ModuleNotFoundError, match="pip install mujoco"):
        MujocoChain(rod(), None)


def test_mujocos_free_tip_is_ours():
    pytest.importorskip("mujoco")
    assert free_tip_error() < 2.0


def test_mujoco_comes_to_rest_in_contact_near_our_force():
    pytest.importorskip("mujoco")
    ours = our_path(repeats=1)
    assert np.count_nonzero(ours["forces"]) == 12
    found = mujoco_path(CONTACTS["tuned"], True, ours["forces"], repeats=1)
    assert found["unsettled"] == 0
    assert found["substeps_max"] < CAP
    assert found["error_median"] < 0.1
    assert found["mismatches"] == 0
    json.dumps(found)
