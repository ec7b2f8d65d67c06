"""Well-formed checkpoints and policies that hold what no run can have written are refused before they are used."""

import json
import math
import shutil
import sys

import numpy as np
import pytest
import torch

from agents import cli
from agents.config import TrainConfig
from agents.errors import UserError
from agents.learning import checkpoint, distillation, training
from agents.learning.actor import ACTOR, LearnedPolicy
from agents.learning.tensors import read_tensors, write_tensors
from agents.tuned import DistilledSettings, PPOSettings, RecurrentPPOSettings, SACSettings

SMALL = {
    "PPO": PPOSettings(steps=256, envs=4, rollout=16, batch_size=32, epochs=2, width=8),
    "RecurrentPPO": RecurrentPPOSettings(steps=256, envs=4, rollout=16, batch_size=32, epochs=1, width=8, hidden=4),
    "SAC": SACSettings(steps=1024, envs=4, gradient_steps=1, batch_size=32, width=8, buffer=480),
    "Distilled": DistilledSettings(steps=64, envs=2, rollout=4, gradient_steps=2, batch_size=8, width=8),
}
ADAM = {"PPO": "policy.optimizer", "RecurrentPPO": "policy.optimizer", "SAC": "critic.optimizer", "Distilled": "adam"}


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """Return the folder of a run of each learner that was killed after its second checkpoint."""
    folders = {}
    with pytest.MonkeyPatch.context() as patch:
        for module in (training, distillation):
            patch.setattr(module, "VALIDATION_EPISODES", 2)
        patch.setattr(checkpoint, "WRITING", np.inf)
        patch.setattr(checkpoint, "CHECKPOINTS", 4)
        save = checkpoint.TrainingRun.save_if_due

        def save_and_end(run, steps, state):
            save(run, steps, state)
            if run.progress.steps >= run.config.learner.steps // 2:
                raise KeyboardInterrupt

        patch.setattr(checkpoint.TrainingRun, "save_if_due", save_and_end)
        for name, settings in SMALL.items():
            folders[name] = tmp_path_factory.mktemp(name)
            with pytest.raises(KeyboardInterrupt):
                training.train(TrainConfig(run=folders[name], learner=settings, threads=1), progress=False)
    return folders


@pytest.fixture
def refused(saved, tmp_path, monkeypatch):
    """Return a function that damages a checkpoint, and asserts that it is refused and nothing is changed."""

    def check(learner, damage, message):
        run = tmp_path / learner
        if not run.exists():
            shutil.copytree(saved[learner], run)
        tensors, values = read_tensors(saved[learner] / checkpoint.CHECKPOINT)
        damage(tensors, values)
        write_tensors(run / checkpoint.CHECKPOINT, tensors, values)
        before = {path.name: path.read_bytes() for path in run.rglob("*") if path.is_file()}
        with pytest.raises(
            UserError, match=rf"checkpoint.safetensors is damaged .*{message}.*again with --restart"
        ) as e:
            training.train(TrainConfig(run=run, learner=SMALL[learner], threads=1), progress=False)
        assert "\n" not in str(e.value)
        assert {path.name: path.read_bytes() for path in run.rglob("*") if path.is_file()} == before

    return check


def put(part, **entries):
    """Return a function that puts values into a part of a checkpoint's JSON."""
    return lambda tensors, values: values[part].update(entries)


def fill(name, value):
    """Return a function that puts a value into the first entry of a tensor."""

    def damage(tensors, values):
        tensors[name].view(-1)[0] = value

    return damage


def change(name, function):
    return lambda tensors, values: tensors.__setitem__(name, function(tensors[name]).contiguous())


def drop(*names):
    def damage(tensors, values):
        for name in list(tensors):
            if name.startswith(names):
                del tensors[name]

    return damage


def add(name, tensor):
    return lambda tensors, values: tensors.__setitem__(name, tensor)


@pytest.mark.parametrize("learner", ["PPO", "SAC"])
@pytest.mark.parametrize(
    ("entries", "message"),
    [
        *(({"steps": steps}, "steps is") for steps in ("x", -5, 0, 1.5, True, None, 10**12, 10**400, 100.0, math.nan)),
        ({"seconds": "abc"}, "seconds is"),
        ({"seconds": math.nan}, "seconds is"),
        ({"seconds": -1.0}, "seconds is"),
        ({"seconds": 1e300}, "seconds is"),
        ({"curve_steps": "abc"}, "learning curve"),
        ({"curve_steps": [64], "curve_returns": []}, "learning curve"),
        ({"curve_steps": [64, 64], "curve_returns": [1.0, 2.0]}, "a step of the learning curve is 64"),
        ({"curve_steps": [10**6], "curve_returns": [1.0]}, "a step of the learning curve"),
        ({"curve_steps": [32], "curve_returns": [math.nan]}, "a return of the learning curve is nan"),
        ({"curve_steps": [32], "curve_returns": ["x"]}, "a return of the learning curve"),
        ({"more": 1}, "'more' is not part of it"),
    ],
    ids=str,
)
def test_progress(learner, entries, message, refused):
    refused(learner, put("progress", **entries), message)


@pytest.mark.parametrize(("learner", "steps"), [("PPO", 65), ("RecurrentPPO", 65), ("SAC", 66), ("Distilled", 33)])
def test_steps_within_a_round(learner, steps, refused):
    refused(learner, put("progress", steps=steps), "it must be a multiple of")


@pytest.mark.parametrize("part", ["progress", "counters"])
@pytest.mark.parametrize("value", [None, [], "text", 3])
def test_json_of_another_structure(part, value, refused):
    refused("PPO", lambda tensors, values: values.update({part: value}), "")
    refused("PPO", lambda tensors, values: values.pop(part), part)


@pytest.mark.parametrize(
    ("learner", "entries", "message"),
    [
        ("PPO", {"updates": "x"}, "updates is 'x'; after 128 steps it must be 4"),
        ("PPO", {"updates": 0}, "updates is 0"),
        ("PPO", {"updates": 4.0}, "updates is 4.0"),
        ("PPO", {"position": 0}, "'position' is not part of it"),
        ("SAC", {"updates": -1}, "updates is -1"),
        ("SAC", {"position": 7}, "position is 7"),
        ("SAC", {"position": 10**9}, "position is"),
        ("SAC", {"full": 0}, "full is 0"),
        ("SAC", {"full": "yes"}, "full is 'yes'"),
        ("Distilled", {"updates": 1}, "'updates' is not part of it"),
    ],
)
def test_counters(learner, entries, message, refused):
    refused(learner, put("counters", **entries), message)


def test_other_steps_than_the_learner_has_learned_from(refused):
    for learner, steps in (("PPO", 256), ("SAC", 1024), ("Distilled", 64)):
        refused(learner, put("progress", steps=steps), "")


@pytest.mark.parametrize("learner", sorted(SMALL))
def test_statistics(learner, refused):
    for name in ("observations", "returns")[: 1 if learner == "Distilled" else 2]:
        for part, value in (("count", math.nan), ("count", -1.0), ("count", 0.0), ("var", -1.0), ("mean", math.inf)):
            refused(learner, fill(f"{name}.{part}", value), f"{name}.{part} is")
        refused(learner, change(f"{name}.mean", lambda mean: mean.reshape(1, *mean.shape)), f"{name}.mean is of shape")
        refused(learner, change(f"{name}.var", lambda var: var.float()), "float32; it must be of")


@pytest.mark.parametrize("learner", sorted(SMALL))
def test_weights_and_moments(learner, refused, saved):
    adam, tensors = f"{ADAM[learner]}/0", read_tensors(saved[learner] / checkpoint.CHECKPOINT)[0]
    weights = next(name for name in sorted(tensors) if name.endswith("weight") or "weight_ih" in name)
    for value in (math.nan, math.inf, 1e38):
        refused(learner, fill(weights, value), f"{weights} is")
    refused(learner, change(weights, lambda weight: weight.T), f"{weights} is of shape")
    refused(learner, change(weights, torch.Tensor.double), f"{weights} is of shape")
    refused(learner, change(f"{adam}.exp_avg", lambda moment: moment[:0]), f"{adam}.exp_avg is of shape")
    refused(learner, drop(f"{adam}.exp_avg_sq"), f"{adam}.exp_avg_sq is missing")
    for part, value in (("exp_avg_sq", -1.0), ("exp_avg_sq", math.nan), ("exp_avg", math.inf), ("step", 0.0)):
        refused(learner, fill(f"{adam}.{part}", value), f"{adam}.{part} is")
    refused(learner, drop(ADAM[learner]), "is missing")
    refused(learner, add(f"{ADAM[learner]}/99.exp_avg", torch.zeros(1)), r"99.exp_avg\\?' is not part of it")
    refused(learner, add("extra", torch.zeros(1)), r"extra\\?' is not part of it")


def test_what_only_one_learner_has(refused):
    refused("PPO", fill("policy/log_std", 1e4), "log_std is")
    refused("SAC", fill("log_ent_coef", math.nan), "log_ent_coef is")
    refused("SAC", fill("replay.rewards", math.nan), "replay.rewards is not finite")
    refused("SAC", fill("replay.actions", 3.0), "replay.actions is from")
    refused("SAC", fill("replay.dones", -1.0), "replay.dones is from")
    refused("SAC", change("replay.next_observations", lambda rows: rows[:-1]), "replay.next_observations is of shape")
    refused("SAC", change("replay.observations", lambda rows: rows[..., :1]), "replay.observations is of shape")
    refused("Distilled", fill("rows", math.nan), "rows is not finite")
    refused("Distilled", fill("labels", 2.0), "labels is from")
    refused("Distilled", change("rows", lambda rows: rows[:-1]), "rows is of shape")


@pytest.mark.parametrize("learner", sorted(SMALL))
def test_what_is_not_damaged_is_taken(learner, saved, tmp_path, monkeypatch):
    for module in (training, distillation):
        monkeypatch.setattr(module, "VALIDATION_EPISODES", 2)
    shutil.copytree(saved[learner], tmp_path, dirs_exist_ok=True)
    training.train(TrainConfig(run=tmp_path, learner=SMALL[learner], threads=1), progress=False)
    assert LearnedPolicy(tmp_path).name == learner


def test_a_damaged_checkpoint_ends_the_command_in_one_line(saved, tmp_path, monkeypatch, capsys):
    shutil.copytree(saved["PPO"], tmp_path, dirs_exist_ok=True)
    tensors, values = read_tensors(tmp_path / checkpoint.CHECKPOINT)
    values["progress"]["steps"] = "x"
    write_tensors(tmp_path / checkpoint.CHECKPOINT, tensors, values)
    numbers = {"steps": 256, "envs": 4, "rollout": 16, "batch-size": 32, "epochs": 2, "width": 8}
    flags = [text for name, value in numbers.items() for text in (f"--{name}", str(value))]
    monkeypatch.setattr(sys, "argv", ["ccr-gym", "train", "--run", str(tmp_path), "ppo", *flags])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    (line,) = capsys.readouterr().err.splitlines()
    assert ended.value.code == cli.FAILED
    assert "checkpoint.safetensors is damaged" in line
    assert "steps is 'x'" in line


@pytest.mark.parametrize("learner", sorted(SMALL))
def test_actors(learner, tmp_path, monkeypatch):
    for module in (training, distillation):
        monkeypatch.setattr(module, "VALIDATION_EPISODES", 2)
    run = training.train(TrainConfig(run=tmp_path / "run", learner=SMALL[learner], threads=1), progress=False)

    def refused(damage, message):
        tensors, values = read_tensors(run / ACTOR)
        damage(tensors, values)
        write_tensors(tmp_path / ACTOR, tensors, values)
        with pytest.raises(UserError, match=rf"is not a trained policy .*{message}.*; remove it, and train again"):
            LearnedPolicy(tmp_path)

    for value in (0.0, -1.0, math.nan):
        refused(fill("deviation", value), "deviation is")
    refused(fill("mean", math.inf), "mean is not finite")
    refused(change("mean", lambda mean: mean[None]), "mean is of shape")
    refused(fill("weights.layers.0.bias", math.nan), "weights.layers.0.bias is not finite")
    refused(change("weights.layers.0.bias", torch.Tensor.double), "weights.layers.0.bias is of shape")
    refused(change("weights.layers.0.bias", lambda bias: bias.to(torch.int32)), "weights.layers.0.bias is of shape")
    refused(drop("weights.layers.0.bias"), "weights.layers.0.bias is missing")
    refused(add("extra", torch.zeros(1)), "is not part of it")
    for name, value in (("seconds", "x"), ("seconds", math.nan), ("returns", [math.nan]), ("steps", "abc")):
        refused(put("training", **{name: value}), "")
    refused(lambda tensors, values: values.pop("training"), "training")


def test_an_actor_that_is_a_folder_is_named(tmp_path):
    (tmp_path / ACTOR).mkdir()
    for path in (tmp_path, tmp_path / ACTOR):
        with pytest.raises(UserError, match=r"actor.safetensors is a folder"):
            LearnedPolicy(path)


@pytest.mark.parametrize(
    "entries",
    [{"seed": "x"}, {"seed": 1.5}, {"seed": True}, {"threads": 1.5}, {"threads": "2"}, {"run": 3}, {"env_id": 3}],
    ids=str,
)
def test_a_configuration_with_wrong_types(entries):
    config = json.loads(TrainConfig(learner=SMALL["PPO"]).dumps())
    with pytest.raises(ValueError, match="not the configuration of a training run"):
        TrainConfig.loads(json.dumps(config | entries))


@pytest.mark.parametrize("entries", [{"steps": 10**400}, {"envs": True}, {"width": "8"}, {"gamma": math.nan}], ids=str)
def test_a_configuration_of_a_learner_with_wrong_types(entries):
    config = json.loads(TrainConfig(learner=SMALL["PPO"]).dumps())
    config["learner"] |= entries
    with pytest.raises(ValueError, match="not the configuration of a training run"):
        TrainConfig.loads(json.dumps(config))
