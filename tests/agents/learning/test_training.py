import contextlib
import errno
import io
import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from agents import commands, files
from agents.config import MAX_ENVS, PER_CORE, TrainConfig
from agents.environment import make_env
from agents.errors import UserError
from agents.files import locked
from agents.learning import checkpoint, distillation, log, training
from agents.learning.actor import ACTOR, LearnedPolicy, export
from agents.learning.checkpoint import learner_state
from agents.learning.learners import ALGORITHMS, make_envs, make_learner, normalized_envs, play_on
from agents.learning.network import CLIP, EPSILON, Network
from agents.learning.pretrained import trained
from agents.learning.tensors import read_tensors, write_tensors
from agents.learning.training import is_finished, train
from agents.tuned import DistilledSettings, PPOSettings, RecurrentPPOSettings, SACSettings, round_steps
from ccr_gym import vector_env

SMALL = {
    "PPO": PPOSettings(steps=1536, envs=4, rollout=64, batch_size=64, epochs=1, width=8),
    "RecurrentPPO": RecurrentPPOSettings(steps=1536, envs=4, rollout=64, batch_size=64, epochs=1, width=8, hidden=4),
    "SAC": SACSettings(steps=1536, envs=4, gradient_steps=1, batch_size=32, width=8),
}
IMITATION = DistilledSettings(steps=64, envs=2, rollout=4, gradient_steps=2, batch_size=8, width=8)


@pytest.fixture(autouse=True)
def few_validation_episodes(monkeypatch):
    monkeypatch.setattr(training, "VALIDATION_EPISODES", 4)
    monkeypatch.setattr(training, "CURVE_POINTS", 3)
    monkeypatch.setattr(checkpoint, "WRITING", np.inf)


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
    policy, statistics, rows = kept["policy"], kept["statistics"], make_envs(config, 1, 7)
    env = make_env(config.env_id, sensing=config.sensing, split="train")
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


@pytest.mark.parametrize("learner", [*SMALL.values(), IMITATION], ids=lambda learner: learner.name)
def test_the_command_says_how_many_steps_are_played(learner, tmp_path, monkeypatch, capsys):
    made, saved = [], []
    monkeypatch.setattr(training, "make_learner", lambda *given: made.append(make_learner(*given)) or made[0])
    monkeypatch.setattr(checkpoint.TrainingRun, "save_if_due", lambda run, steps, state: saved.append(steps))
    monkeypatch.setattr(training, "train", lambda config: train(config, progress=False))
    config = TrainConfig(run=tmp_path, learner=replace(learner, steps=50), threads=1)
    commands.train(config)
    played = made[0].num_timesteps if made else max(saved)
    assert played != 50
    whole = f"Training plays {played} steps, whole rounds of {round_steps(learner)}, where --steps asks for 50\n"
    said = capsys.readouterr().out
    assert whole in said
    assert f"for {played} steps on" in said


@pytest.fixture
def killed(monkeypatch):
    """End training after each checkpoint, as a kill would; returns the number of kills in a list of one."""

    def save_and_end(self, steps, state):
        before = self._next_steps
        save(self, steps, state)
        if self._next_steps != before:
            kills[0] += 1
            raise KeyboardInterrupt

    save, kills = checkpoint.TrainingRun.save_if_due, [0]
    monkeypatch.setattr(checkpoint.TrainingRun, "save_if_due", save_and_end)
    return kills


def until_finished(config):
    while not is_finished(config):
        with contextlib.suppress(KeyboardInterrupt):
            train(config, progress=False)
    return LearnedPolicy(config.run)


@pytest.mark.parametrize("name", sorted(SMALL))
def test_a_killed_run_goes_on_and_continues_its_curve(name, tmp_path, monkeypatch, killed):
    monkeypatch.setattr(checkpoint, "CHECKPOINTS", 2)
    config = TrainConfig(run=tmp_path, learner=SMALL[name], threads=1)
    with pytest.raises(KeyboardInterrupt):
        train(config, progress=False)
    kept = checkpoint.TrainingRun(config)
    assert 700 <= kept.progress.steps < config.learner.steps
    assert kept.seed != config.seed
    assert not (tmp_path / ACTOR).exists()
    assert kept.progress.curve_steps
    with pytest.raises(UserError, match="a run with other settings"):
        train(replace(config, seed=1), progress=False)
    training_ = until_finished(replace(config, threads=2)).training
    assert killed[0] >= 1
    assert training_.curve.steps[: len(kept.progress.curve_steps)] == tuple(kept.progress.curve_steps)
    assert list(training_.curve.steps) == sorted(set(training_.curve.steps))
    assert len(training_.curve.steps) > len(kept.progress.curve_steps)
    assert training_.seconds > kept.progress.seconds
    assert {path.name for path in tmp_path.iterdir()} == {".lock", log.OWN, ACTOR, training.CONFIG, log.LOG}


@pytest.mark.parametrize("name", sorted(SMALL))
def test_a_learner_is_restored_bit_for_bit(name, tmp_path, monkeypatch, killed):
    def state(model):
        states.append(learner_state(model))
        return states[-1]

    states = []
    monkeypatch.setattr(training, "learner_state", state)
    config = TrainConfig(run=tmp_path, learner=SMALL[name], threads=1)
    monkeypatch.setattr(checkpoint, "CHECKPOINTS", 3)
    with pytest.raises(KeyboardInterrupt):
        train(config, progress=False)
    run, (kept,) = checkpoint.TrainingRun(config), states
    fresh = make_learner(normalized_envs(make_envs(config, config.learner.envs, run.seed), config), config)
    checkpoint.restore_learner(fresh, run.progress.steps, run.state)
    again = learner_state(fresh)
    assert again.counters == kept.counters
    assert kept.counters["updates"] > 0
    assert again.tensors.keys() == kept.tensors.keys()
    for key, tensor in kept.tensors.items():
        assert torch.equal(tensor, again.tensors[key]), key
    assert any("exp_avg_sq" in key for key in kept.tensors)
    assert fresh.num_timesteps == run.progress.steps


def test_a_resumed_run_goes_on_amid_the_episodes():
    class Still:
        def predict(self, rows, state, starts):
            seen.append(starts.copy())
            return np.zeros((4, 1), np.float32), state

    config, seen = TrainConfig(run=Path(), learner=SMALL["PPO"]), []
    envs = make_envs(config, 4, 7)
    length = envs.get_attr("max_episode_steps")[0]
    rows, starts = play_on(Still(), envs, 2 * length + 30)
    assert rows.shape == (4, *envs.observation_space.shape)
    assert [start.all() for start in seen] == [True] + 29 * [False]
    assert not starts.any()
    ends = [envs.step(np.zeros((4, 1), np.float32))[2] for _ in range(length - 30)]
    assert not np.any(ends[:-1])
    assert ends[-1].all()


ROLLOUTS = {"PPO": 24, "Distilled": 8}  # a checkpoint after each
LEARNING = {
    "PPO": PPOSettings(steps=ROLLOUTS["PPO"] * 1024, envs=16, rollout=64, batch_size=128, epochs=6, width=32),
    "Distilled": DistilledSettings(
        steps=ROLLOUTS["Distilled"] * 1536, envs=24, gradient_steps=60, batch_size=256, width=32
    ),
}


@pytest.mark.parametrize("name", [pytest.param("PPO", marks=pytest.mark.long), "Distilled"])
def test_a_run_killed_after_every_checkpoint_learns_as_one_left_alone(name, tmp_path, monkeypatch, request):
    """Mean return of 16 episodes, from about −80 (0 at the first point of an imitation) to 25."""
    for module in (training, distillation):
        monkeypatch.setattr(module, "VALIDATION_EPISODES", 16)
        monkeypatch.setattr(module, "CURVE_POINTS", 4)
    monkeypatch.setattr(checkpoint, "CHECKPOINTS", ROLLOUTS[name])
    kwargs = {"env_id": "CCR/LoadCell-v1", "sensing": "ideal", "learner": LEARNING[name], "threads": 1}
    alone = until_finished(TrainConfig(run=tmp_path / "alone", **kwargs)).training.curve.returns
    kills = request.getfixturevalue("killed")
    killed = until_finished(TrainConfig(run=tmp_path / "killed", **kwargs)).training.curve.returns
    assert kills[0] >= ROLLOUTS[name] - 1
    assert len(killed) == len(alone)
    assert killed[-1] > alone[-1] - 5
    if name != "Distilled":  # it has learned nearly all in its first round
        assert min(alone[-1], killed[-1]) > max(alone[0], killed[0]) + 15


def test_writing_takes_a_small_share_of_the_time(tmp_path, monkeypatch):
    def write(*_):
        written.append(clock[0])
        clock[0] += 1.0

    clock, written = [0.0], []
    monkeypatch.setattr(checkpoint.time, "perf_counter", lambda: clock[0])
    monkeypatch.setattr(checkpoint, "write_tensors", write)
    monkeypatch.setattr(checkpoint, "WRITING", 0.05)
    run = checkpoint.TrainingRun(TrainConfig(run=tmp_path, learner=PPOSettings(steps=100)))
    for steps in range(1, 101):
        clock[0] += 1.0
        run.save_if_due(steps, lambda: checkpoint.LearnerState({}))
    assert len(written) == 5
    assert np.diff(written).min() >= 20


def test_a_checkpoint_that_was_being_written_does_not_count(tmp_path, monkeypatch):
    def fail(self, target):
        if target.name == checkpoint.CHECKPOINT:
            raise OSError(errno.ENOSPC, "No space left on device")
        return replace_path(self, target)

    replace_path = files.Path.replace
    config = TrainConfig(run=tmp_path, learner=SMALL["PPO"], threads=1)
    monkeypatch.setattr(checkpoint, "CHECKPOINTS", 4)
    monkeypatch.setattr(files.Path, "replace", fail)
    with pytest.raises(UserError, match=r"checkpoint.safetensors cannot be written: No space left"):
        train(config, progress=False)
    assert {path.name for path in tmp_path.iterdir()} == {".lock", log.OWN, training.CONFIG, log.LOG}


FOREIGN = ["checkpoint-256/model.zip", "log_1/thesis.txt", "evaluations.npz", ACTOR, "checkpoint.safetensors"]


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("restart", [False, True])
@pytest.mark.parametrize("name", FOREIGN)
def test_a_folder_of_something_else_is_left_as_it_is(tmp_path, name, restart):
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_bytes(b"mine")
    with pytest.raises(UserError, match="choose a new or empty folder"):
        train(TrainConfig(run=tmp_path, learner=SMALL["PPO"], threads=1, restart=restart), False)
    assert contents(tmp_path) == {name: b"mine"}


def test_a_finished_run_stays_and_begins_again_if_asked(tmp_path):
    config = TrainConfig(run=tmp_path, learner=SMALL["PPO"], threads=1)
    first = LearnedPolicy(train(config, progress=False)).training
    weights = contents(tmp_path)[ACTOR]
    others = {"notes.txt": b"mine", f"{log.LOG}/thesis.txt": b"mine", "old/config.json": b"mine"}
    for name, content in others.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)
    before = contents(tmp_path)
    train(config, progress=False)
    assert contents(tmp_path) == before
    again = LearnedPolicy(train(replace(config, restart=True), progress=False)).training
    assert again.curve == first.curve
    assert contents(tmp_path)[ACTOR] != weights  # other seconds
    assert others.items() <= contents(tmp_path).items()
    assert len(list((tmp_path / log.LOG).glob(f"{log.EVENTS}*"))) == 1
    train(replace(config, restart=True, seed=5), progress=False)
    assert TrainConfig.load(tmp_path / training.CONFIG).seed == 5


def test_a_finished_run_whose_policy_is_damaged_says_so(tmp_path):
    config = TrainConfig(run=tmp_path, learner=SMALL["PPO"], threads=1)
    train(config, progress=False)
    whole = (tmp_path / ACTOR).read_bytes()
    (tmp_path / ACTOR).write_bytes(whole[:-1])
    with pytest.raises(UserError, match=r"is not a trained policy.*remove it, and train again"):
        train(config, progress=False)
    assert (tmp_path / ACTOR).read_bytes() == whole[:-1]
    (tmp_path / ACTOR).unlink()
    LearnedPolicy(train(config, progress=False))


@pytest.mark.parametrize(
    "learner", [SMALL["PPO"], pytest.param(IMITATION, marks=pytest.mark.long)], ids=lambda s: s.name
)
def test_only_the_event_files_of_the_run_are_deleted(tmp_path, monkeypatch, learner):
    monkeypatch.setattr(distillation, "VALIDATION_EPISODES", 2)
    config = TrainConfig(run=tmp_path, learner=learner, threads=1)
    copied = tmp_path / log.LOG / f"{log.EVENTS}mine"
    train(config, progress=False)
    (own,) = copied.parent.iterdir()
    copied.write_bytes(b"mine")
    train(replace(config, restart=True), progress=False)
    assert not own.exists()
    assert copied.read_bytes() == b"mine"
    assert len(list(copied.parent.iterdir())) == 2


def test_a_killed_run_deletes_the_event_files_of_all_its_parts(tmp_path, killed):
    config = TrainConfig(run=tmp_path, learner=SMALL["PPO"], threads=1)
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            train(config, progress=False)
    before = set((tmp_path / log.LOG).iterdir())
    assert len(before) == 2
    with pytest.raises(KeyboardInterrupt):
        train(replace(config, restart=True), progress=False)
    assert len(list((tmp_path / log.LOG).iterdir())) == 1
    assert not before & set((tmp_path / log.LOG).iterdir())


@pytest.mark.parametrize("record", ["", "{}", "3", "[3]", '["../config.json"]', '["events.out.tfevents.x/../../mine"]'])
def test_a_damaged_record_deletes_nothing(tmp_path, record):
    config = TrainConfig(run=tmp_path, learner=SMALL["PPO"], threads=1)
    config.save(tmp_path / training.CONFIG)
    for name, content in ((log.OWN, record), (ACTOR, "actor"), ("mine", "mine")):
        (tmp_path / name).write_text(content)
    before = contents(tmp_path)
    with pytest.raises(UserError, match=r"\.log\.json is damaged .*; delete it"):
        train(replace(config, restart=True), progress=False)
    assert {**contents(tmp_path), ".lock": b""} == {**before, ".lock": b""}


def test_a_folder_in_the_place_of_a_file_is_named(tmp_path):
    config = TrainConfig(run=tmp_path, learner=SMALL["PPO"], threads=1)
    config.save(tmp_path / training.CONFIG)
    (tmp_path / ACTOR).write_bytes(b"finished")
    (tmp_path / checkpoint.CHECKPOINT).mkdir()
    with pytest.raises(UserError, match=r"checkpoint.safetensors is a folder"):
        train(replace(config, restart=True), progress=False)
    assert (tmp_path / ACTOR).read_bytes() == b"finished"


def test_two_processes_do_not_train_in_one_folder(tmp_path):
    config = TrainConfig(run=tmp_path, learner=SMALL["PPO"], threads=1)
    with locked(tmp_path), pytest.raises(UserError, match="another process is training in"):
        train(config, progress=False)
    assert [path.name for path in tmp_path.iterdir()] == [".lock"]
    train(config, progress=False)


def test_every_learner_has_an_algorithm():
    assert {kind.name for kind in ALGORITHMS} == set(SMALL)


class Payload:
    """Runs code when it is unpickled."""

    def __init__(self, witness):
        self.witness = witness

    def __reduce__(self):
        return Path.touch, (self.witness,)


def damaged(content, witness):
    whole, end = content, len(content)
    yield from (b"", b"nothing", whole[: end // 2], whole[:-1], whole[:4], b"\xff" * 8 + whole[8:], bytes(64))
    for save in (lambda file: pickle.dump(Payload(witness), file), lambda file: torch.save(Payload(witness), file)):
        file = io.BytesIO()
        save(file)
        yield file.getvalue()


def test_a_foreign_actor_is_refused_and_runs_nothing(tmp_path):
    with pytest.raises(FileNotFoundError, match="train first"):
        LearnedPolicy(tmp_path)
    for content in damaged(trained("PPO", "CCR/LoadCell-v1")[0].read_bytes(), tmp_path / "witness"):
        (tmp_path / ACTOR).write_bytes(content)
        with pytest.raises(UserError, match="not a trained policy"):
            LearnedPolicy(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [ACTOR]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": 3}, "its format is 3"),
        ({"env_id": "planted:Env-v1"}, "env_id is"),
        ({"sensing": "none"}, "sensing is"),
        ({"learner": {"name": "PPO", "width": 10**9}}, "not a trained policy"),
        ({"learner": {"name": "PPO", "gamma": "x"}}, "gamma is"),
    ],
)
def test_an_actor_of_another_make_is_refused_and_imports_nothing(tmp_path, monkeypatch, change, message):
    (tmp_path / "planted.py").write_text("from pathlib import Path; Path(__file__).with_suffix('.witness').touch()")
    monkeypatch.syspath_prepend(tmp_path)
    tensors, values = read_tensors(trained("PPO", "CCR/LoadCell-v1")[0])
    config = json.loads(values["config"])
    values |= {key: value for key, value in change.items() if key == "format"}
    values["config"] = json.dumps(config | change) if "format" not in change else values["config"]
    write_tensors(tmp_path / ACTOR, tensors, values)
    with pytest.raises(UserError, match=message):
        LearnedPolicy(tmp_path)
    assert not (tmp_path / "planted.witness").exists()


def test_an_actor_that_is_not_finite_is_refused(tmp_path):
    tensors, values = read_tensors(trained("PPO", "CCR/LoadCell-v1")[0])
    write_tensors(tmp_path / ACTOR, tensors | {"mean": tensors["mean"] * torch.nan}, values)
    with pytest.raises(UserError, match="not finite"):
        LearnedPolicy(tmp_path)


@pytest.mark.parametrize("learner_settings", [SMALL["PPO"], DistilledSettings(steps=64, envs=2, rollout=4)], ids=str)
def test_a_damaged_checkpoint_is_refused_and_runs_nothing(tmp_path, monkeypatch, killed, learner_settings):
    config = TrainConfig(run=tmp_path, learner=learner_settings, threads=1)
    monkeypatch.setattr(distillation, "VALIDATION_EPISODES", 2)
    with pytest.raises(KeyboardInterrupt):
        train(config, progress=False)
    path = tmp_path / checkpoint.CHECKPOINT
    tensors, values = read_tensors(path)
    last = max(tensors)
    del tensors[last]
    write_tensors(tmp_path / "fewer", tensors, values)
    contents_ = [*damaged(path.read_bytes(), tmp_path / "witness"), (tmp_path / "fewer").read_bytes()]
    for content in contents_:
        path.write_bytes(content)
        with pytest.raises(UserError, match=r"is damaged .*; start the run again with --restart"):
            train(config, progress=False)
        assert path.read_bytes() == content
    assert not (tmp_path / "witness").exists()
    with pytest.raises(KeyboardInterrupt):
        train(replace(config, restart=True), progress=False)
    assert path.read_bytes() != content


@pytest.mark.parametrize("name", ["PPO", "SAC"])
def test_a_policy_without_a_force_sensor_trains_and_acts(name, tmp_path):
    config = TrainConfig(run=tmp_path, sensing="sensorless", learner=replace(SMALL[name], steps=512), threads=1)
    policy = LearnedPolicy(train(config, progress=False))
    assert policy.training.config.sensing == "sensorless"
    env = make_env(config.env_id, sensing="sensorless")
    assert env.action_space.contains(policy.act(env.reset(seed=0)[0]))
    with pytest.raises(ValueError, match="with sensorless sensing"):
        policy.act(make_env(config.env_id, sensing="realistic").reset(seed=0)[0])


def test_an_observation_of_another_environment_is_refused():
    policy = LearnedPolicy(trained("Distilled", "CCR/PushObstacle-v1")[0])
    env = make_env("CCR/TrackForce-v1", sensing="realistic")
    with pytest.raises(ValueError, match="trained on CCR/PushObstacle-v1 with realistic sensing"):
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


def test_bounds_are_those_of_the_environments():
    assert MAX_ENVS == vector_env.MAX_ENVS
    assert PER_CORE == vector_env.THREADS_PER_CORE


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
    (tmp_path / ACTOR).write_bytes(b"finished")
    before = contents(tmp_path)
    for other in (replace(config, seed=3), replace(config, learner=DistilledSettings(steps=64))):
        with pytest.raises(UserError, match="other settings"):
            train(other, progress=False)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("restart", [False, True])
def test_a_truncated_configuration_is_refused(tmp_path, restart):
    config = TrainConfig(run=Path(tmp_path), learner=SMALL["PPO"], restart=restart)
    (tmp_path / training.CONFIG).write_text(config.dumps()[:40])
    before = contents(tmp_path)
    with pytest.raises(UserError, match="not the configuration of a training run"):
        train(config, progress=False)
    assert contents(tmp_path) == before
