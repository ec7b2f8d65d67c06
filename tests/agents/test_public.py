"""The public names are imported on their first use, and nothing is imported before."""

import subprocess
import sys

import pytest

import agents


@pytest.mark.parametrize("name", agents.__all__)
def test_public_names_exist(name):
    assert getattr(agents, name).__name__ == name or name == "Observation"
    assert name in dir(agents)


def test_other_names_do_not():
    with pytest.raises(AttributeError, match="module 'agents' has no attribute 'Agent'"):
        _ = agents.Agent


def test_import_is_light():
    code = "import sys, agents; print(*(name for name in sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"torch", "stable_baselines3", "matplotlib", "scipy", "tyro", "solver"} & set(loaded)
