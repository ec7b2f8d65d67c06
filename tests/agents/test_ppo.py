import json
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from stable_baselines3.common.vec_env import VecFrameStack, VecNormalize

from agents import cli, ppo
from agents.config import EvaluateConfig, TrainConfig
from agents.sb3_adapter import FleetVecEnv


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


def test_frames_are_stacked_as_in_training(tmp_path):
    kwargs = {"sensing": "realistic", "frames": 3}
    config = TrainConfig(run=tmp_path, steps=256, envs=2, batch_size=64, epochs=1, **kwargs)
    policy = ppo.PPOPolicy(ppo.train(config, progress=False))
    told = {"sensing": "realistic", "split": "train"}
    environments = FleetVecEnv(config.env_id, 1, 7, **told)
    normalizer = VecNormalize.load(str(tmp_path / ppo.NORMALIZER), environments)
    normalizer.training = False
    stacked = VecFrameStack(normalizer, 3)
    env = gymnasium.make(config.env_id, disable_env_checker=True, **told)
    rows, (observation, _) = stacked.reset(), env.reset(seed=7)
    for _ in range(5):
        action = policy.act(observation)
        assert action == pytest.approx(policy._model.predict(rows[0], deterministic=True)[0], abs=1e-6)
        rows, *_ = stacked.step(action[None])
        observation, *_ = env.step(action)


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
    assert [policy["policy"] for policy in report["policies"]] == ["PPO", "PI", "Newton"]
    assert (run / "evaluation.png").stat().st_size > 10_000
    assert (run / "evaluation.mp4").stat().st_size > 10_000


def test_an_untrained_folder_is_refused_by_the_command(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["ccr-gym", "evaluate", "--run", str(tmp_path)])
    with pytest.raises(SystemExit, match="train first"):
        cli.main()


def test_a_folder_whose_saving_was_interrupted_does_not_load(run, tmp_path, monkeypatch):
    def fail(*_):
        raise OSError("disk full")

    for piece in (ppo.CONFIG, ppo.POLICY, ppo.NORMALIZER):
        (tmp_path / piece).write_bytes((run / piece).read_bytes())
    monkeypatch.setattr(ppo.VecNormalize, "save", fail)
    with pytest.raises(OSError, match="disk full"):
        ppo.train(TrainConfig(run=tmp_path, steps=64, envs=1, batch_size=64, epochs=1), progress=False)
    with pytest.raises(FileNotFoundError, match=ppo.CONFIG):
        ppo.PPOPolicy(tmp_path)


@pytest.mark.parametrize("text", ["", "[]", '{"steps": 3}', '{"run": "here", "stepz": 3}'])
def test_a_foreign_configuration_is_refused(tmp_path, text):
    (tmp_path / ppo.CONFIG).write_text(text)
    with pytest.raises(ValueError, match="not the configuration"):
        TrainConfig.load(tmp_path / ppo.CONFIG)


def test_an_unknown_environment_is_refused_by_the_command(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["ccr-gym", "train", "--run", str(tmp_path), "--env-id", "CCR/Nope-v0"])
    with pytest.raises(SystemExit, match="Nope"):
        cli.main()


@pytest.mark.parametrize(
    "arguments",
    [("train", "--steps", "0"), ("evaluate", "--episodes", "0"), ("train", "--help"), ("train", "--frames", "0")],
)
def test_the_command_line_exits_before_any_work(arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(
        sys, "argv", ["ccr-gym", *arguments, *(() if "--help" in arguments else ("--run", str(tmp_path)))]
    )
    with pytest.raises(SystemExit):
        cli.main()
    written = capsys.readouterr()
    said = written.out + written.err
    assert "at least 1" in said or "from 1 to 64" in said or "--steps INT" in written.out


def test_training_and_evaluation_seeds_cannot_meet():
    with pytest.raises(ValueError, match="seed is 999999"):
        TrainConfig(seed=999_999)
    with pytest.raises(ValueError, match="beyond the training seeds"):
        EvaluateConfig(seed=999_999)
