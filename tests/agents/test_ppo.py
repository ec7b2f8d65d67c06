import json
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from agents import cli, ppo
from agents.config import TrainConfig


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    config = TrainConfig(run=tmp_path_factory.mktemp("run"), steps=512, envs=4, batch_size=64, epochs=1)
    return ppo.train(config, progress=False)


def test_a_run_folder_gives_the_policy_back(run):
    first, second = ppo.PPOPolicy(run), ppo.PPOPolicy(run)
    env = gymnasium.make("CCR/PushObstacle-v0", disable_env_checker=True)
    observation, _ = env.reset(seed=0)
    for _ in range(10):
        action = first.act(observation)
        assert np.array_equal(action, second.act(observation))
        assert env.action_space.contains(action)
        observation, *_ = env.step(action)
    assert first.config == TrainConfig.load(run / ppo.CONFIG)
    assert any(run.glob("log_1/events*"))


def test_the_observation_is_scaled_as_in_training(run):
    policy = ppo.PPOPolicy(run)
    env = gymnasium.make("CCR/PushObstacle-v0", obs_mode="flat", disable_env_checker=True)
    observation, _ = env.reset(seed=0)
    statistics = policy._normalizer.obs_rms
    scaled = np.clip((observation - statistics.mean) / np.sqrt(statistics.var + 1e-8), -10, 10)
    assert policy._normalizer.normalize_obs(observation) == pytest.approx(scaled, abs=1e-5)


def test_a_missing_piece_is_named(run, tmp_path):
    for piece in (ppo.CONFIG, ppo.POLICY):
        (tmp_path / piece).write_bytes((run / piece).read_bytes())
    with pytest.raises(FileNotFoundError, match=ppo.NORMALIZER):
        ppo.PPOPolicy(tmp_path)


def test_evaluate_writes_table_figure_and_video(run, monkeypatch, capsys):
    arguments = ["ccr-gym", "evaluate", "--run", str(run), "--episodes", "4", "--video-episodes", "1"]
    monkeypatch.setattr(sys, "argv", arguments)
    cli.main()
    assert "PI" in capsys.readouterr().out
    report = json.loads((run / "evaluation.json").read_text())
    assert [policy["policy"] for policy in report["policies"]] == ["PPO", "PI"]
    assert (run / "evaluation.png").stat().st_size > 10_000
    assert (run / "evaluation.mp4").stat().st_size > 10_000


def test_an_untrained_folder_is_refused_by_the_command(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["ccr-gym", "evaluate", "--run", str(tmp_path)])
    with pytest.raises(SystemExit, match="train first"):
        cli.main()
