"""What environments say of time and of what their pictures need."""

import re
import tomllib
from pathlib import Path

import gymnasium
import pytest

import ccr_gym


@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/SpatialPush-v1"])
def test_pictures_run_at_the_pace_of_the_steps(env_id):
    assert ccr_gym.ContactEnv.metadata["dt"] == 0.05
    single, many = gymnasium.make(env_id), gymnasium.make_vec(env_id, 2)
    for metadata in (single.unwrapped.metadata, many.unwrapped.metadata):
        assert metadata["dt"] * metadata["render_fps"] == pytest.approx(1)


def test_the_extra_for_pictures_brings_what_gymnasium_writes_videos_with():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    names = [re.match(r"[\w-]+", entry).group() for entry in project["optional-dependencies"]["render"]]
    assert "moviepy" in names  # RecordVideo raises DependencyNotInstalled without it


@pytest.mark.parametrize("env_id", sorted(ccr_gym.ENV_IDS))
def test_ranges_in_docstrings_have_two_ends_in_order(env_id):
    text = " ".join((ccr_gym.ENV_IDS[env_id].__doc__ or "").split())
    start = text.partition("## Starting State ")[2].partition(" ## ")[0]
    ranges = [(float(low), float(high)) for low, high in re.findall(r"([\d.]*\d)–([\d.]*\d)", start)]
    assert ranges
    assert all(low < high for low, high in ranges)


def test_a_docstring_says_what_single_breaths_and_the_drift_are():
    text = " ".join((ccr_gym.ENV_IDS["CCR/MovingObstacle-v1"].__doc__ or "").split())
    depth, period = ccr_gym.MovingObstacle().variation
    assert f"the depth varies by up to {depth:g} of it either way, the period by {period:g}" in text
    assert "`drift`, 0 L by default" in text
