"""What environments say of time: a step stands for ``dt``, and pictures run at its pace."""

import gymnasium
import pytest

import ccr_gym


@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/SpatialPush-v1"])
def test_pictures_run_at_the_pace_of_the_steps(env_id):
    assert ccr_gym.ContactEnv.metadata["dt"] == 0.05
    single, many = gymnasium.make(env_id), gymnasium.make_vec(env_id, 2)
    for metadata in (single.unwrapped.metadata, many.unwrapped.metadata):
        assert metadata["dt"] * metadata["render_fps"] == pytest.approx(1)
