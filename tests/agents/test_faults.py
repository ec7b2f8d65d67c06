"""Errors outside a command end in one line and an exit code, and nothing is lost or left half-written."""

import errno
import os
import resource
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import pytest

from agents import cli, commands
from agents.config import TrainConfig
from agents.errors import UserError
from agents.files import LOCK, PARTIAL, locked, replacing, write_text
from agents.learning import checkpoint, training
from agents.learning.actor import ACTOR, LearnedPolicy
from agents.learning.log import OWN
from agents.tuned import PPOSettings
from agents.workers import worker_pool

SMALL = [
    "ppo",
    "--steps",
    "1024",
    "--envs",
    "8",
    "--rollout",
    "32",
    "--batch-size",
    "64",
    "--epochs",
    "1",
    "--width",
    "8",
]
COMMAND = [sys.executable, "-c", "from agents.cli import main; main()"]
REGULATED = "/sys/ccr-gym"  # where not even root can make a folder


def started(*arguments, **options):
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([*COMMAND, *map(str, arguments)], **pipes, **options)


def ended(process, timeout=60):
    """Return the exit code and the lines of the error stream."""
    _, err = process.communicate(timeout=timeout)
    return process.returncode, err.splitlines()


def called(monkeypatch, capsys, *arguments):
    """Return the same for a command in this process."""
    monkeypatch.setattr(sys, "argv", ["ccr-gym", *map(str, arguments)])
    with pytest.raises(SystemExit) as caught:
        cli.main()
    return caught.value.code, capsys.readouterr().err.splitlines()


def assert_one_line(code, lines, *words):
    assert code == cli.FAILED
    assert len(lines) == 1, lines
    assert all(word in lines[0] for word in ("ccr-gym: ", *words)), lines


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("evaluate", "--runs", "nowhere"), "nowhere/actor.safetensors is missing; train first"),
        (("evaluate", "--pretrained", "."), "no trained policy found"),
        (("evaluate", "--pretrained", "nowhere"), "no trained policy found"),
        (("evaluate", "--policies", "PPO", "--pretrained", "nowhere"), "no trained policy found"),
        (("evaluate", "--out", "file", "--policies", "PI"), "file"),
        (("train", "--run", "file"), "file"),
        (("train", "--run", "."), "holds file but no config.json"),
        (("sweep", "--out", "file"), "file"),
        (("reproduce", "--out", "file"), "file"),
        (("bench", "--json", "file/bench.json"), "file"),
        (("bench", "--json", "taken"), "taken cannot be written: Is a directory"),
        (("bench", "--json", "."), ". cannot be written: Is a directory"),
        (("bench", "--json", "/"), "/ cannot be written: Is a directory"),
        (("reproduce", "--out", "out"), "out/paper.json cannot be written: Is a directory"),
        (("evaluate", "--out", "out", "--policies", "PI"), "out/evaluation.json cannot be written: Is a directory"),
        (("retrain", "--out", "file", "--jobs", "1", "--seeds", "1"), "file"),
    ],
)
def test_what_cannot_be_used_is_named(arguments, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("in the way")
    for folder in ("taken", "out/paper.json", "out/evaluation.json"):
        Path(folder).mkdir(parents=True)
    assert_one_line(*called(monkeypatch, capsys, *arguments), words)
    assert Path("file").read_text() == "in the way"


def test_more_threads_than_the_machine_takes_are_refused_before_anything_is_written(tmp_path, monkeypatch, capsys):
    run = tmp_path / "run"
    code, lines = called(monkeypatch, capsys, "train", "--run", run, "--threads", 100_000)
    assert_one_line(code, lines, "threads is 100000; it must be a whole number from 1 to ", "for each core")
    assert not run.exists()


@pytest.mark.skipif(not Path("/sys").is_dir(), reason="no folder that refuses every user")
@pytest.mark.parametrize("arguments", ["train --run", "evaluate --out", "sweep --out", "reproduce --out"])
def test_a_folder_that_cannot_be_written_is_named(arguments, monkeypatch, capsys):
    assert_one_line(*called(monkeypatch, capsys, *arguments.split(), REGULATED), REGULATED)


def test_a_damaged_study_is_named(tmp_path, monkeypatch, capsys):
    study = tmp_path / "PI-PushObstacle-v1.db"
    study.write_bytes(b"no data base" * 100)
    assert_one_line(*called(monkeypatch, capsys, "sweep", "--out", tmp_path, "--trials", 1), str(study))


@pytest.mark.parametrize("name", ["train", "evaluate", "retrain", "sweep", "bench", "reproduce"])
def test_a_bug_shows_where_it_is_and_an_interrupt_does_not(name, monkeypatch, capsys):
    def fail(error):
        raise error

    monkeypatch.setattr(sys, "argv", ["ccr-gym", name])
    monkeypatch.setattr(commands, name, lambda _: fail(ValueError("a bug")))
    with pytest.raises(ValueError, match="a bug"):
        cli.main()
    monkeypatch.setattr(commands, name, lambda _: fail(KeyboardInterrupt()))
    code, lines = called(monkeypatch, capsys, name)
    assert (code, len(lines)) == (cli.INTERRUPTED, 1)


@pytest.mark.parametrize("name", ["train", "evaluate", "retrain"])
@pytest.mark.parametrize("seconds", [0.2, 6.0], ids=["loading", "working"])
def test_an_interrupt_ends_a_command_in_one_line_and_leaves_no_process(name, seconds, tmp_path):
    """As in a terminal, all processes of the command get the signal."""
    process = started(name, "--run" if name == "train" else "--out", tmp_path / "out", start_new_session=True)
    time.sleep(seconds)
    os.killpg(process.pid, signal.SIGINT)
    code, lines = ended(process)
    assert (code, len(lines)) == (cli.INTERRUPTED, 1), lines
    assert not list(tmp_path.rglob(f"{PARTIAL}*"))


def test_another_projects_solver_is_named(tmp_path):
    (tmp_path / "solver.py").write_text("raise SystemExit('imported')")
    root = Path(cli.__file__).parents[1]
    code = "import sys; from agents.cli import main; sys.argv = ['ccr-gym', 'bench']; main()"
    folders = map(str, (tmp_path, root, sysconfig.get_path("purelib")))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(folders)}
    ran = subprocess.run(
        [sys.executable, "-S", "-c", code], capture_output=True, text=True, env=environment, cwd=tmp_path
    )
    assert ran.returncode == cli.FAILED
    assert_one_line(
        ran.returncode, ran.stderr.splitlines(), "'solver'", str(tmp_path / "solver.py"), "environment of its own"
    )


def test_help_loads_no_learning_library():
    code = "import sys; from agents.cli import main; sys.argv = ['ccr-gym', '--help']\n"
    code += "try:\n    main()\nfinally:\n    print(*sys.modules, file=sys.stderr)"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "usage: ccr-gym" in ran.stdout
    assert not {"torch", "stable_baselines3", "matplotlib", "scipy"} & set(ran.stderr.split())


def limited(size):
    """Return a function that limits the size of files, as if the disk were full."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


@pytest.mark.long
@pytest.mark.parametrize(("size", "file"), [(100, "config.json"), (4000, "checkpoint.safetensors")])
def test_training_on_a_full_disk_goes_on_when_there_is_space(size, file, tmp_path):
    run = tmp_path / "run"
    code, lines = ended(started("train", "--run", run, *SMALL, preexec_fn=limited(size)))
    assert_one_line(code, lines, f"{run / file} cannot be written: File too large")
    assert {path.name for path in run.iterdir()} <= {LOCK, OWN, "config.json", "log_1"}
    assert ended(started("train", "--run", run, *SMALL)) == (0, [])
    assert LearnedPolicy(run).training.curve.returns


def test_a_log_that_cannot_be_written_is_named(tmp_path):
    many = [*SMALL[:5], "--rollout", 8, *SMALL[7:]]
    code, lines = ended(started("train", "--run", tmp_path, *many, "--steps", 100_000, preexec_fn=limited(40_000)))
    assert_one_line(code, lines, f"{tmp_path / 'log_1'} cannot be written: File too large")


def test_evaluating_on_a_full_disk_leaves_nothing_half_written(tmp_path):
    arguments = ["--env-ids", "CCR/LoadCell-v1", "--policies", "PI", "P", "--episodes", 2, "--no-video", "--jobs", 1]
    out = tmp_path / "out"
    code, lines = ended(started("evaluate", "--out", out, *arguments, preexec_fn=limited(500)))
    assert_one_line(code, lines[-1:], f"{out / 'evaluation.json'} cannot be written: File too large")
    assert [path for path in out.rglob("*") if path.is_file()] == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("evaluate --policies PI --no-video --out", "worker processes cannot be started: File too large"),
        ("retrain --out", "worker processes cannot be started: File too large"),
        ("train --run", "config.json cannot be written: File too large"),
        ("sweep --trials 1 --out", "out"),
    ],
)
def test_a_disk_that_takes_nothing_is_named(arguments, words, tmp_path):
    code, lines = ended(started(*arguments.split(), tmp_path / "out", preexec_fn=limited(0)), timeout=240)
    assert_one_line(code, lines[-1:], words)


def test_a_file_that_cannot_be_written_stays_as_it_was(tmp_path):
    path = tmp_path / "file.txt"
    write_text(path, "before")

    def write_half():
        with replacing(path) as partial:
            partial.write_text("half")
            raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(UserError, match=r"file.txt cannot be written: No space left"):
        write_half()
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_a_disk_that_cannot_be_written_is_named_by_the_file(tmp_path, monkeypatch):
    def fail(path, *_, **__):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))

    for name in ("open", "unlink"):
        monkeypatch.setattr(Path, name, fail)
    with pytest.raises(UserError, match=r"/file.txt cannot be written: Read-only file system"):
        write_text(tmp_path / "file.txt", "text")


def test_a_run_that_is_killed_goes_on_from_its_checkpoint(tmp_path):
    run = tmp_path / "run"
    process = started("train", "--run", run, *SMALL)
    until = time.monotonic() + 60
    while not (run / checkpoint.CHECKPOINT).exists() and process.poll() is None and time.monotonic() < until:
        time.sleep(0.005)
    process.kill()
    process.communicate()
    config = TrainConfig.load(run / training.CONFIG)
    kept = checkpoint.TrainingRun(config).progress
    assert kept.steps > 0
    assert not (run / ACTOR).exists()
    policy = LearnedPolicy(training.train(config, progress=False))
    assert policy.training.curve.steps[: len(kept.curve_steps)] == tuple(kept.curve_steps)
    assert policy.training.seconds > kept.seconds


def test_a_lock_ends_with_its_process(tmp_path):
    code = "import sys, time; from pathlib import Path; from agents.files import locked\n"
    code += "with locked(Path(sys.argv[1])): print('has it', flush=True); time.sleep(60)"
    process = subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "has it\n"
    with pytest.raises(UserError, match="another process"), locked(tmp_path):
        pass
    process.kill()
    process.communicate()
    with locked(tmp_path):
        pass


def test_a_finished_run_says_so_and_ends_well(tmp_path, monkeypatch, capsys):
    run, settings = tmp_path / "run", PPOSettings(steps=512, envs=4, rollout=32, batch_size=64, epochs=1, width=8)
    training.train(TrainConfig(run=run, learner=settings, threads=1), progress=False)
    before = (run / ACTOR).stat().st_mtime_ns
    arguments = [
        text
        for name in ("steps", "envs", "rollout", "batch_size", "epochs", "width")
        for text in (f"--{name.replace('_', '-')}", str(getattr(settings, name)))
    ]
    monkeypatch.setattr(sys, "argv", ["ccr-gym", "train", "--run", str(run), "ppo", *arguments])
    cli.main()
    assert "is already finished; --restart trains it again" in capsys.readouterr().out
    assert (run / ACTOR).stat().st_mtime_ns == before


def test_a_worker_that_dies_is_reported():
    with pytest.raises(UserError, match="a worker process was killed"), worker_pool(1) as pool:
        pool.submit(os._exit, 1).result()


def test_workers_end_with_a_killed_parent(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "import os, time\n"
        "from agents.workers import worker_pool\n"
        "if __name__ == '__main__':\n"
        "    with worker_pool(1) as pool:\n"
        "        print(pool.submit(os.getpid).result(), flush=True)\n"
        "        pool.submit(time.sleep, 60).result()\n"
    )
    process = subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True)
    worker = int(process.stdout.readline())
    process.kill()
    process.communicate()
    for _ in range(100):
        if _has_ended(worker):
            return
        time.sleep(0.1)
    os.kill(worker, signal.SIGKILL)
    pytest.fail("the worker outlived its parent by 10 s")


def _has_ended(process):
    """Return whether a process has ended; one whom no parent has waited for yet is still listed."""
    status = Path(f"/proc/{process}/stat")
    return not status.exists() or status.read_text().rpartition(")")[2].split()[0] == "Z"
