import json
from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
import pytest
import torch

from agents import training
from agents.actor import ACTOR, CLIP, EPSILON, LearnedPolicy, Network, export
from agents.config import TrainConfig
from agents.learners import KINDS, environments
from agents.suite import trained
from agents.training import train
from agents.tuned import DistilledSettings, PPOSettings, RecurrentPPOSettings, SACSettings

SMALL = {
    "PPO": PPOSettings(steps=1536, envs=4, rollout=64, batch_size=64, epochs=1, width=8),
    "RecurrentPPO": RecurrentPPOSettings(steps=1536, envs=4, rollout=64, batch_size=64, epochs=1, width=8, hidden=4),
    "SAC": SACSettings(steps=1536, envs=4, gradient_steps=1, batch_size=32, width=8),
}


@pytest.fixture(autouse=True)
def few_validation_episodes(monkeypatch):
    monkeypatch.setattr(training, "VALIDATION_EPISODES", 4)
    monkeypatch.setattr(training, "CURVE_POINTS", 3)


@pytest.mark.parametrize("name", sorted(SMALL))
def test_the_actor_acts_as_the_learner_does(name, tmp_path, monkeypatch):
    kept = {}

    def keep(path, network, statistics, *rest):
        kept["statistics"] = statistics
        export(path, network, statistics, *rest)

    def of(policy, settings):
        kept["policy"] = policy
        return make(policy, settings)

    make = Network.of
    monkeypatch.setattr(training, "export", keep)
    monkeypatch.setattr(training.Network, "of", of)
    config = TrainConfig(run=tmp_path, learner=SMALL[name], threads=1)
    actor = LearnedPolicy(train(config, progress=False))
    policy, statistics, rows = kept["policy"], kept["statistics"], environments(config, 1, 7)
    env = gymnasium.make(config.env_id, disable_env_checker=True, sensing=config.sensing, split="train")
    observation, _ = env.reset(seed=7)
    seen, state = rows.reset(), None
    for step in range(20):
        scaled = np.clip((seen - statistics.mean) / np.sqrt(statistics.var + EPSILON), -CLIP, CLIP).astype(np.float32)
        theirs, state = policy.predict(scaled, state, np.array([step == 0]), deterministic=True)
        action = actor.act(observation)
        assert env.action_space.contains(action)
        assert action == pytest.approx(theirs[0], abs=5e-3)  # half precision
        seen, *_ = rows.step(theirs)
        observation, *_ = env.step(theirs[0])
    assert actor.name == name
    assert actor.training.config == replace(config, run=Path())
    assert (tmp_path / ACTOR).stat().st_size < 20_000
    assert any(tmp_path.glob("log_1/events*"))


@pytest.mark.parametrize("name", sorted(SMALL))
def test_an_interrupted_run_goes_on_and_continues_its_curve(name, tmp_path, monkeypatch):
    config = TrainConfig(run=tmp_path, learner=SMALL[name], threads=1)

    def interrupted(self):
        keep(self)
        if self.num_timesteps >= 700:
            raise KeyboardInterrupt

    keep = training.Checkpoints.keep
    monkeypatch.setattr(training, "CHECKPOINTS", 4)
    monkeypatch.setattr(training.Checkpoints, "keep", interrupted)
    with pytest.raises(KeyboardInterrupt):
        train(config, progress=False)
    (kept,) = tmp_path.glob("checkpoint-*")
    done = int(kept.name.split("-")[1])
    assert 700 <= done < config.learner.steps
    assert not (tmp_path / ACTOR).exists()
    before = np.load(tmp_path / "evaluations.npz")["timesteps"]
    monkeypatch.setattr(training.Checkpoints, "keep", keep)
    with pytest.raises(ValueError, match="a run with other settings"):
        train(replace(config, seed=1), progress=False)
    resumed, _ = training._resumed(config, kept)
    assert resumed.get_env().unwrapped._seeds[0] != config.seed
    curve = LearnedPolicy(train(replace(config, threads=2), progress=False)).training.curve
    assert curve.steps[: len(before)] == tuple(before)
    assert list(curve.steps) == sorted(set(curve.steps))
    assert curve.steps[-1] <= config.learner.steps
    assert len(curve.steps) > len(before)
    assert [path.name for path in tmp_path.glob("log_*")] == ["log_1"]


def test_a_checkpoint_that_was_being_written_does_not_count(tmp_path, monkeypatch):
    config = TrainConfig(run=tmp_path, learner=SMALL["PPO"], threads=1)
    monkeypatch.setattr(training, "CHECKPOINTS", 4)

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr(training.VecNormalize, "save", fail)
    with pytest.raises(OSError, match="disk full"):
        train(config, progress=False)
    assert not list(tmp_path.glob("checkpoint-*"))


def test_checkpoints_of_unknown_settings_are_not_gone_on_with(tmp_path):
    (tmp_path / "checkpoint-256").mkdir()
    curve = LearnedPolicy(train(TrainConfig(run=tmp_path, learner=SMALL["PPO"], threads=1), False)).training.curve
    assert curve.steps[0] == 512
    assert not (tmp_path / "checkpoint-256").exists()


def test_a_finished_run_is_trained_anew(tmp_path):
    config = TrainConfig(run=tmp_path, learner=SMALL["PPO"], threads=1)
    first, second = (torch.load(train(config, progress=False) / ACTOR, weights_only=True) for _ in range(2))
    for name, weight in first["weights"].items():
        assert torch.equal(weight, second["weights"][name])
    assert [path.name for path in tmp_path.glob("log_*")] == ["log_1"]


def test_every_learner_has_an_algorithm():
    assert {kind.name for kind in KINDS} == set(SMALL)


def test_a_foreign_file_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match="train first"):
        LearnedPolicy(tmp_path)
    (tmp_path / ACTOR).write_bytes(b"nothing")
    with pytest.raises(ValueError, match="not a trained policy"):
        LearnedPolicy(tmp_path)
    torch.save({"format": 2}, tmp_path / ACTOR)
    with pytest.raises(ValueError, match="its format is 2"):
        LearnedPolicy(tmp_path)


def test_an_observation_of_another_environment_is_refused():
    policy = LearnedPolicy(trained("Distilled", "CCR/PushObstacle-v0")[0])
    env = gymnasium.make("CCR/TrackForce-v0", sensing="realistic", disable_env_checker=True)
    with pytest.raises(ValueError, match=r"those of CCR/PushObstacle-v0 with realistic sensing are"):
        policy.act(env.reset(seed=0)[0])


@pytest.mark.parametrize("text", ["", "[]", '{"seed": 3}', '{"run": "here", "learner": {"name": "PPO", "stepz": 3}}'])
def test_a_foreign_configuration_is_refused(tmp_path, text):
    path = tmp_path / "config.json"
    path.write_text(text)
    with pytest.raises(ValueError, match="not the configuration"):
        TrainConfig.load(path)


@pytest.mark.parametrize("name", sorted(SMALL))
def test_a_configuration_is_read_as_it_was_written(tmp_path, name):
    config = TrainConfig(run=tmp_path, learner=SMALL[name], seed=7)
    config.save(tmp_path / "config.json")
    assert TrainConfig.load(tmp_path / "config.json") == config
    assert json.loads(config.dumps())["learner"]["name"] == name


def test_training_seeds_end_where_validation_begins():
    with pytest.raises(ValueError, match="seed is 899999"):
        TrainConfig(seed=899_999)
    with pytest.raises(ValueError, match="steps is 0"):
        TrainConfig(learner=PPOSettings(steps=0))
    with pytest.raises(ValueError, match="weaning is 0"):
        TrainConfig(learner=DistilledSettings(weaning=0))


def test_a_run_folder_is_not_touched_by_another_configuration(tmp_path):
    config = TrainConfig(run=Path(tmp_path), learner=SMALL["PPO"], threads=1)
    config.save(tmp_path / training.CONFIG)
    (tmp_path / "checkpoint-256").mkdir()
    with pytest.raises(ValueError, match="other settings"):
        train(replace(config, seed=3), progress=False)
    (tmp_path / ACTOR).write_bytes(b"finished")
    for other in (replace(config, seed=3), replace(config, learner=DistilledSettings(steps=64))):
        with pytest.raises(ValueError, match="other settings"):
            train(other, progress=False)
    assert (tmp_path / ACTOR).read_bytes() == b"finished"
    assert (tmp_path / "checkpoint-256").is_dir()
    assert TrainConfig.load(tmp_path / training.CONFIG) == config
