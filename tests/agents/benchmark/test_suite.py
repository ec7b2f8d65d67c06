import itertools
import json
import re
import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import optuna
import pytest
import torch

from agents import cli
from agents.benchmark import figures, report, suite
from agents.benchmark.evaluate import METRICS, Episode, measure, run_episode, scores
from agents.benchmark.suite import CONTROLLERS, Entry, play
from agents.benchmark.sweep import sweep
from agents.config import EVALUATION_SEED, PRETRAINED, EvaluateConfig, RetrainConfig, SweepConfig, TrainConfig
from agents.errors import UserError
from agents.learning import training
from agents.learning.actor import ACTOR, LearnedPolicy
from agents.learning.pretrained import SUFFIX, trained
from agents.learning.retrain import retrain
from agents.learning.tensors import read_tensors, write_tensors
from agents.learning.training import train
from agents.tuned import LEARNERS, PPOSettings, sensing_of
from solver import Status

SCORES = json.loads((PRETRAINED / "scores.json").read_text())
SCENES = 8  # of the table that are played again
SMALL = PPOSettings(steps=512, envs=4, rollout=32, batch_size=64, epochs=1, width=8)


def episode(true, goal=0.1, cost=0.0):
    true = np.asarray(true, float)
    goals = np.full(len(true), goal)
    errors = np.abs(true - goals)
    return Episode(
        goals, errors, 2 * errors, true, true, np.full(len(true), cost), (Status.CONVERGED,) * len(true), (), 1.0
    )


def test_the_metrics_of_a_known_episode():
    force = np.concatenate([np.zeros(10), np.full(14, 0.2), np.full(20, 0.11), [0.0], np.full(19, 0.1)])
    found = measure(episode(force))
    assert found.rmse_mn == pytest.approx(1e3 * np.sqrt((20 * 0.01**2 + 0.1**2) / 40))
    assert found.estimate_rmse_mn == pytest.approx(2 * found.rmse_mn)
    assert found.steady_mn == pytest.approx(0, abs=1e-9)
    assert (found.success, found.settling_step, found.contact_losses) == (1, 46, 1)
    assert (found.overshoot, found.peak_mn) == (pytest.approx(1), pytest.approx(200))
    never = measure(episode(np.full(64, 0.2), cost=0.01))
    assert (never.success, never.settling_step, never.violations) == (0, 65, 64)
    assert never.cost_mn == pytest.approx(640)


def test_seconds_are_cpu_time_of_the_policy_alone(monkeypatch):
    clock = itertools.count()
    monkeypatch.setattr(time, "process_time", lambda: next(clock))
    (policy,) = Entry("Oracle", "CCR/LoadCell-Paper-v1", "ideal").load()
    found = run_episode(policy, "CCR/LoadCell-Paper-v1", 0)
    assert found.seconds == len(found.force) == next(clock) / 2


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    return train(TrainConfig(run=tmp_path_factory.mktemp("run"), learner=SMALL, threads=1), progress=False)


def test_evaluate_writes_table_figures_and_videos(run, tmp_path, monkeypatch, capsys):
    arguments = ["evaluate", "--runs", str(run), "--out", str(tmp_path), "--episodes", "3", "--jobs", "1"]
    monkeypatch.setattr(sys, "argv", ["ccr-gym", *arguments, "--policies", "PI", "Oracle", "PPO"])
    cli.main()
    assert "CCR/PushObstacle-v1, realistic sensing" in capsys.readouterr().out
    written = json.loads((tmp_path / "evaluation.json").read_text())
    assert [result["policy"] for result in written["results"]] == ["PPO", "PI", "Oracle"]
    for result in written["results"]:
        assert np.shape(result["episodes"]["rmse_mn"]) == (1, 3)
        low, high = result["summary"]["rmse_interval_mn"]
        assert low <= result["summary"]["rmse_iqm_mn"] <= high
        assert sum(result["summary"]["statuses"].values()) == 3 * 64
    for name in ("PushObstacle-v1.png", "scores.png", "profiles.png", "curves.png"):
        assert (tmp_path / name).stat().st_size > 10_000
    assert len(list((tmp_path / "videos").glob("*.mp4"))) == 3
    assert "| PPO |" in (tmp_path / "evaluation.md").read_text()


def test_videos_show_the_scene_where_policies_differ_most_of_those_where_the_best_reaches_the_set_point():
    def result(errors, reached):
        metrics = {"rmse_mn": np.array([errors]), "success": np.array([reached])}
        return suite.Result(suite.Entry("PI", "CCR/LoadCell-v1", "ideal"), metrics, {})

    results = [result([1.0, 2.0, 1.0, 40.0], [1, 1, 1, 0]), result([2.0, 5.0, 2.0, 3.0], [0, 0, 0, 1])]
    assert suite.telling_scene(results) == 1
    assert suite.telling_scene(results[::-1]) == 1
    assert suite.telling_scene([result([1.0, 2.0], [0, 0]), result([9.0, 3.0], [0, 0])]) == 0


@pytest.mark.parametrize(
    ("steps", "settled", "shown"), [(64.0, 0.6, "64"), (64.0, 0.5, "never"), (64.5, 0.5, "never"), (65.0, 0.4, "never")]
)
def test_what_does_not_settle_never_does(steps, settled, shown):
    summary = {"settling_step": steps, "steps": 64, "success": settled}
    assert report.COLUMNS["settled [step]"](summary) == shown


@pytest.mark.parametrize(
    ("steps", "median"), [([63, 63, 65, 65], 65), ([10, 20, 65, 65], 65), ([10, 20, 30, 65], 25), ([10, 65, 65], 65)]
)
def test_episodes_that_do_not_settle_count_as_infinite(steps, median):
    metrics = {name: np.ones((1, len(steps))) for name in METRICS}
    metrics |= {"settling_step": np.array([steps], float), "success": np.array([steps]) <= 64}
    assert suite.summarize(metrics)["settling_step"] == median


def test_printed_tables_fit_80_columns_and_leave_out_what_is_empty(capsys):
    metrics = {name: np.full((1, 3), 234.5) for name in METRICS}
    extra = {"statuses": {"CONVERGED": 3}, "decisions_per_second": 1e3, "training_seconds": 0.0}
    summary = suite.summarize(metrics) | extra
    entries = [suite.Entry(policy, "CCR/PushObstacle-v1", "realistic") for policy in ("RecurrentPPO", "PI", "Oracle")]
    by_id = report.group([suite.Result(entry, metrics, summary) for entry in entries])
    report.show(by_id)
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    notes = [line.partition(":")[0] for line in lines if re.match(r"\w[\w ]*[\w%]:", line)]
    assert notes == ["force error", "worst tenth", "steady", "within 5 %", "settled", "overshoot", "peak"]
    assert any("RecurrentPPO" in line and "never" in line for line in lines)
    assert "training" not in report.markdown(by_id)


def test_a_policy_without_error_is_seen_among_others(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(figures, "_save", lambda figure, path: drawn.append(figure))
    summaries = {"PI": (9.0, 8.0, 10.0), "Oracle": (0.001, 0.0, 0.002)}
    summaries = {name: {"rmse_iqm_mn": m, "rmse_interval_mn": ends} for name, (m, *ends) in summaries.items()}
    figures.draw_scores({"CCR/LoadCell-v1": summaries}, tmp_path)
    (axis,) = drawn[0].axes
    marks = [line for line in axis.lines if line.get_marker() == "D"]
    assert [tuple(line.get_ydata()) for line in marks] == [(1,)]  # the row of the oracle
    assert not marks[0].get_clip_on()


@pytest.mark.parametrize("trained", [True, False])
def test_scores_are_written_of_trained_policies_alone(trained, tmp_path, monkeypatch):
    for name in ("show", "_draw", "_write_cards"):
        monkeypatch.setattr(report, name, lambda *_: None)
    (tmp_path / "scores.json").write_text('{"PPO CCR/TrackForce-v1": [1.0]}')  # of an earlier evaluation
    metrics = {name: np.full((1, 3), 2.0) for name in METRICS}
    summary = suite.summarize(metrics) | {
        "statuses": {"CONVERGED": 3},
        "decisions_per_second": 1.0,
        "training_seconds": 0,
    }
    files = (tmp_path / "0.safetensors",) if trained else ()
    entry = suite.Entry("PPO" if trained else "PI", "CCR/LoadCell-v1", "realistic", files)
    report.write([suite.Result(entry, metrics, summary)], EvaluateConfig(out=tmp_path))
    written = tmp_path / "scores.json"
    assert written.exists() is trained
    assert not trained or json.loads(written.read_text()) == {"PPO CCR/LoadCell-v1": [2.0, 2.0, 2.0]}


def test_every_column_of_a_table_is_explained():
    assert {name for name in report.HEADINGS if name != "policy"} == report.NOTES.keys()
    assert report.PRINTED.keys() <= set(report.HEADINGS)


def test_every_policy_plays_the_same_scenes():
    first, second = (play(Entry(name, "CCR/LoadCell-v1", "realistic"), 1_000_000, 2) for name in ("P", "PI"))
    for a, b in zip(first.shown, second.shown, strict=True):
        assert np.array_equal(a.goal, b.goal)
        assert a.equilibria[0].scene == b.equilibria[0].scene


def test_the_share_that_is_closed_and_whether_intervals_are_apart():
    def result(name, errors):
        metrics = {metric: np.ones((1, 20)) for metric in METRICS} | {"rmse_mn": np.array([errors], float)}
        return suite.Result(Entry(name, "CCR/LoadCell-v1", "realistic"), metrics, suite.summarize(metrics))

    rivals = [result("PI", 9 + np.linspace(0, 2, 20)), result("Oracle", np.zeros(20))]
    good, poor = result("PPO", np.full(20, 2.5)), result("SAC", np.linspace(5, 14, 20))
    assert report.closed(good, rivals) == pytest.approx(0.75)
    assert report.is_below(good, rivals)
    assert not report.is_below(poor, rivals)
    assert report.closed(good, rivals[1:]) is None
    exact = [result("PI", np.full(20, 2e-5)), rivals[1]]
    assert report.closed(good, exact) is None


def test_the_oracle_is_no_bound_where_the_paper_s_estimate_is_regulated_by_imperfect_sensors():
    def result(name, sensing, error):
        metrics = {metric: np.full((1, 20), error) for metric in METRICS}
        return suite.Result(Entry(name, "CCR/LoadCell-Paper-v1", sensing), metrics, suite.summarize(metrics))

    for sensing, share in (("ideal", pytest.approx(2.0)), ("realistic", None), ("sensorless", None)):
        rivals = [result("PI", sensing, 10.0), result("Oracle", sensing, 9.0)]
        assert report.closed(result("MPC", sensing, 8.0), rivals) == share


def test_environments_without_a_learner_have_no_learning_curves(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(report, "draw_curves", lambda curves, out: drawn.append(list(curves)))
    for name in ("draw_episodes", "draw_scores", "draw_profiles"):
        monkeypatch.setattr(report, name, lambda *_: None)
    learned = LearnedPolicy(trained("PPO", "CCR/LoadCell-v1")[0]).training
    metrics = {metric: np.ones((1, 20)) for metric in METRICS}
    results = [
        suite.Result(Entry(name, env_id, "realistic"), metrics, suite.summarize(metrics), trainings=trainings)
        for name, env_id, trainings in (("PPO", "CCR/LoadCell-v1", (learned,)), ("PI", "CCR/SpatialPush-v1", ()))
    ]
    report._draw(report.group(results), EvaluateConfig(out=tmp_path))
    assert drawn == [["CCR/LoadCell-v1"]]


def test_retraining_fills_a_folder_as_that_of_the_shipped_policies(tmp_path):
    config = RetrainConfig(out=tmp_path, learners=("PPO",), env_ids=("CCR/LoadCell-v1",), seeds=2, share=1e-6, jobs=1)
    retrain(config)
    files = trained("PPO", "CCR/LoadCell-v1", tmp_path)
    assert [file.name for file in files] == ["0.safetensors", "1.safetensors"]
    assert [LearnedPolicy(file).training.config.seed for file in files] == [0, 1000]
    before = [file.stat().st_mtime_ns for file in tmp_path.glob(f"PPO/LoadCell-v1/*/{ACTOR}")]
    retrain(config)
    assert [file.stat().st_mtime_ns for file in tmp_path.glob(f"PPO/LoadCell-v1/*/{ACTOR}")] == before
    with pytest.raises(ValueError, match="a run with other settings"):
        retrain(replace(config, share=1.0))


def test_a_sweep_goes_on_where_it_was_left(tmp_path, monkeypatch, capsys):
    arguments = ["sweep", "--what", "PI", "--trials", "2", "--episodes", "2", "--out", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", ["ccr-gym", *arguments, "--env-id", "CCR/LoadCell-v1"])
    cli.main()
    cli.main()
    cli.main()
    assert "Best of 6" in capsys.readouterr().out
    study = optuna.load_study(study_name=None, storage=f"sqlite:///{tmp_path}/PI-LoadCell-v1.db")
    assert len({tuple(trial.params.values()) for trial in study.trials}) == 6


@pytest.mark.parametrize("name", [name for name in CONTROLLERS if name != "Oracle"])
def test_a_sweep_tunes_every_controller(name, tmp_path, monkeypatch):
    def instead(policy, *_, **__):
        tried.append(policy)
        return np.zeros(1)

    tried = []
    monkeypatch.setattr("agents.benchmark.sweep.scores", instead)
    arguments = ["sweep", "--what", name, "--env-id", "CCR/LoadCell-v1", "--trials", "2", "--out", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", ["ccr-gym", *arguments])
    cli.main()
    shipped = CONTROLLERS[name]("CCR/LoadCell-v1", "realistic")
    assert [(type(policy), policy.name) for policy in tried] == [(type(shipped), shipped.name)] * 2
    study = optuna.load_study(study_name=None, storage=f"sqlite:///{tmp_path}/{name}-LoadCell-v1.db")
    first, second = (trial.params for trial in study.trials)
    assert first.keys() == second.keys()
    assert first != second


def test_a_sweep_has_no_oracle():
    with pytest.raises(ValueError, match="what is 'Oracle'; it must be one of P, PI, MPC, Harmonic, Newton"):
        SweepConfig(what="Oracle")


@pytest.mark.parametrize("learner", sorted(LEARNERS))
def test_a_sweep_finds_settings_of_every_learner(learner, tmp_path, monkeypatch):
    def instead(config, progress):
        tried.append(config.learner)
        return trained("PPO", "CCR/LoadCell-v1")[0]

    tried = []
    monkeypatch.setattr(training, "train", instead)
    config = SweepConfig(what=learner, env_id="CCR/LoadCell-v1", trials=2, episodes=1, steps=640, out=tmp_path)
    sweep(config)
    assert [(settings.name, settings.steps) for settings in tried] == [(learner, 640)] * 2
    assert tried[0] != tried[1]


@pytest.mark.parametrize(
    "arguments",
    [
        ("train", "ppo", "--steps", "0"),
        ("evaluate", "--episodes", "0"),
        ("evaluate", "--policies", "PID"),
        ("evaluate", "--seed", "5"),
        ("retrain", "--share", "0"),
        ("sweep", "--env-id", "CCR/Nope-v1"),
        ("train", "--env-id", "Pendulum-v1"),
        ("train", "--env-id", "nope"),
        ("train", "--threads", "0"),
        ("train", "ppo", "--learning-rate", "nan"),
        ("train", "ppo", "--gamma", "2"),
        ("train", "ppo", "--batch-size", "1"),
        ("train", "sac", "--tau", "-1"),
        ("train", "sarsa"),
        ("evaluate", "--policies", "PI", "PI"),
        ("bench", "--steps", "0"),
        ("bench", "--steps", "150"),
        ("bench", "--seeds", "0"),
    ],
)
def test_the_command_line_exits_before_any_work(arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["ccr-gym", *arguments])
    with pytest.raises(SystemExit, match="2"):
        cli.main()
    words = ("at least", "must name", "must be one of", "must be above", "must be from", "sarsa")
    written = " ".join(capsys.readouterr().err.split())
    assert any(word in written for word in words)
    assert list(tmp_path.iterdir()) == []


def test_runs_of_different_sensing_are_not_compared(run, tmp_path):
    ideal = train(TrainConfig(run=tmp_path, sensing="ideal", learner=SMALL, threads=1), progress=False)
    with pytest.raises(ValueError, match="runs must have the same sensing"):
        suite.entries(EvaluateConfig(runs=(run, ideal)))


def test_shipped_policies_of_another_sensing_are_said_to_be_so():
    config = EvaluateConfig(policies=("PPO",), env_ids=("CCR/PushObstacle-v1",), sensing="sensorless")
    with pytest.raises(UserError, match=r"were trained with realistic sensing .* not with sensorless"):
        suite.entries(config)


def test_a_policy_in_the_folder_of_another_is_named(tmp_path, monkeypatch, capsys):
    file = tmp_path / "Distilled" / "TrackForce-v1" / f"0{SUFFIX}"
    file.parent.mkdir(parents=True)
    arguments = ["--policies", "Distilled", "--env-ids", "CCR/TrackForce-v1", "--pretrained", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", ["ccr-gym", "evaluate", "--out", str(tmp_path / "out"), *arguments])
    for learner, env_id in (("Distilled", "CCR/PushObstacle-v1"), ("PPO", "CCR/TrackForce-v1")):
        shutil.copyfile(trained(learner, env_id)[0], file)
        with pytest.raises(SystemExit) as ended:
            cli.main()
        (line,) = capsys.readouterr().err.splitlines()
        assert ended.value.code == cli.FAILED
        assert f"{file} is a policy that {learner} trained on {env_id}, in the folder of Distilled" in line
    file.unlink()
    file.mkdir()
    with pytest.raises(UserError, match="is a folder"):
        suite.entries(EvaluateConfig(policies=("Distilled",), env_ids=("CCR/TrackForce-v1",), pretrained=tmp_path))
    assert not (tmp_path / "out").exists()


def test_a_run_too_short_for_a_learning_curve_is_evaluated(tmp_path, monkeypatch, capsys):
    short = PPOSettings(steps=64, envs=4, rollout=16, batch_size=64, epochs=1, width=8)
    run = train(TrainConfig(run=tmp_path / "run", learner=short, threads=1), progress=False)
    assert LearnedPolicy(run).training.curve.steps == ()
    arguments = ["--policies", "PPO", "--episodes", "2", "--jobs", "1", "--no-video", "--out", str(tmp_path / "out")]
    monkeypatch.setattr(sys, "argv", ["ccr-gym", "evaluate", "--runs", str(run), *arguments])
    cli.main()
    assert (tmp_path / "out" / "curves.png").exists()
    assert "videos" not in capsys.readouterr().out
    assert not (tmp_path / "out" / "videos").exists()


def test_names_of_policies_and_environments_are_checked():
    with pytest.raises(ValueError, match="beyond the training seeds"):
        EvaluateConfig(seed=999_999)
    with pytest.raises(ValueError, match="must name some of"):
        RetrainConfig(learners=())
    with pytest.raises(ValueError, match="trials is 0"):
        SweepConfig(trials=0)


@pytest.mark.parametrize("file", sorted(PRETRAINED.rglob(f"*{SUFFIX}")), ids=str)
def test_shipped_policies_load_and_are_of_their_environment(file):
    policy = LearnedPolicy(file)
    assert file in trained(policy.name, policy.training.config.env_id)
    assert policy.training.config.sensing == sensing_of(policy.training.config.env_id)


def agrees(found, table):
    """Return whether at least a third of some scenes' errors are those of the table, to 1 %.

    In single precision another processor rounds differently. Most scenes do not care, but where a closed loop is on the
    edge, as at a switch of the memory, it amplifies the last bit, up to twice the error: three of eight scenes of one
    policy, none of most. Errors of another policy agree by chance, at most one of eight.
    """
    return np.mean(np.abs(found - table) <= 0.01 * np.abs(table) + 2e-3) >= 1 / 3


def first_scores(file, env_id):
    return scores(LearnedPolicy(file), env_id, EVALUATION_SEED, SCENES, sensing=sensing_of(env_id), split="test")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.long if k % 2 else []) for k, name in enumerate(sorted(SCORES))]
)
def test_shipped_policies_give_the_numbers_of_the_table(name):
    """``scores.json`` is what ``ccr-gym evaluate`` wrote of their first test scenes."""
    policy, env_id = name.split()
    assert agrees(first_scores(*trained(policy, env_id), env_id), np.array(SCORES[name][:SCENES]))


@pytest.mark.parametrize("env_id", sorted({name.split()[1] for name in SCORES}))
def test_no_policy_gives_the_numbers_of_another(env_id):
    table = {name: np.array(errors[:SCENES]) for name, errors in SCORES.items() if name.split()[1] == env_id}
    for one, other in itertools.permutations(table, 2):
        assert not agrees(table[one], table[other]), (one, other)


@pytest.mark.parametrize("noise", [0.05, None], ids=["other weights", "untrained"])
def test_other_weights_do_not_give_the_numbers_of_the_table(noise, tmp_path):
    env_id = "CCR/LoadCell-v1"
    tensors, values = read_tensors(trained("PPO", env_id)[0])
    torch.manual_seed(0)
    for name, weight in tensors.items():
        if name.startswith("weights"):
            spread = 0.1 if noise is None else noise * weight.float().abs().mean()
            other = (torch.zeros_like(weight) if noise is None else weight) + spread * torch.randn(weight.shape)
            tensors[name] = other.half()
    write_tensors(tmp_path / f"0{SUFFIX}", tensors, values)
    found = first_scores(tmp_path / f"0{SUFFIX}", env_id)
    assert not agrees(found, np.array(SCORES[f"PPO {env_id}"][:SCENES]))


def test_shipped_policies_are_those_of_the_table():
    files = {f"{file.parts[-3]} CCR/{file.parts[-2]}" for file in PRETRAINED.rglob(f"*{SUFFIX}")}
    assert SCORES.keys() == files
    assert {f"{learner} CCR/PushObstacle-v1" for learner in ("PPO", "Distilled")} < files


def test_shipped_policies_are_small():
    assert sum(file.stat().st_size for file in PRETRAINED.rglob(f"*{SUFFIX}")) < 2_000_000
