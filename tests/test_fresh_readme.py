import sys
import time
from pathlib import Path

import fresh_readme
import psutil
import pytest
from fresh_readme import Shell, Step, describe, pages_in, run, steps_of

PAGE = """# A page
```console
mkdir made && cd made   # a comment
$ export GREETING=hello
pip install '.[render]'
```
Text, and a block:
```python
import os
print(os.environ["GREETING"])
open("picture.png", "w").close()
```
```json
{}
```
```console
ccr-gym retrain
false
```
"""


@pytest.fixture
def shell(tmp_path):
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "python").symlink_to(sys.executable)
    return Shell(tmp_path, tmp_path, {"PATH": f"{tmp_path / 'bin'}:/usr/bin:/bin"})


def test_steps_are_those_of_the_page_in_its_order():
    first, second, third, block, *last = steps_of(PAGE)
    assert first == Step("console", "mkdir made && cd made")
    assert second.code == "export GREETING=hello"
    assert third.code == "pip install '.[render]'"
    assert block.language == "python"
    assert block.title == 'print(os.environ["GREETING"])'
    assert [(step.code, step.kind) for step in last] == [("ccr-gym retrain", "hours"), ("false", "seconds")]


def test_folder_and_variables_last_and_what_is_made_is_listed(shell, tmp_path):
    steps = [step for step in steps_of(PAGE) if not step.code.startswith("pip")]
    *passed, left_out, failed = run(steps, shell, tmp_path, {"hours"})
    assert [result.outcome for result in passed] == ["passed"] * 3
    assert passed[-1].output == "hello\n"
    assert passed[-1].made == [tmp_path / "made" / "picture.png"]
    assert left_out.outcome == "left out (hours)"
    assert failed.outcome == "FAILED"
    assert "made made/picture.png" in describe(passed[-1], tmp_path)


def test_a_server_is_asked_for_its_page_and_stopped(shell):
    server = f"'{sys.executable}' -u -c \"{SERVER}\""
    assert shell.serve(Step("console", server))
    assert not shell.serve(Step("console", "echo no address"))


def test_a_command_that_does_not_end_fails_with_all_that_it_started(shell, tmp_path, monkeypatch):
    monkeypatch.setattr(fresh_readme, "STOP_SECONDS", 0.5)
    stubborn = "trap '' TERM; sleep 600 & echo $! > child; wait; sleep 600"
    assert not shell.run(Step("console", stubborn), 1.0)
    child = int((tmp_path / "child").read_text())
    deadline = time.monotonic() + 10
    while running(child) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not running(child)
    assert shell.run(Step("console", "true"))


def running(process):
    """Return whether a process has not ended, whether or not anybody has taken note of its end."""
    try:
        return psutil.Process(process).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def test_every_kind_but_servers_has_a_limit():
    kinds = {step.kind for step in steps_of((Path(__file__).parents[1] / "README.md").read_text())}
    assert kinds - {"server"} <= fresh_readme.LIMITS.keys()


def test_the_readme_installs_before_it_imports():
    steps = list(steps_of((Path(__file__).parents[1] / "README.md").read_text()))
    blocks = [k for k, step in enumerate(steps) if step.language == "python"]
    assert any(step.code.startswith("pip install .") for step in steps[: blocks[0]])


SERVER = (
    "import http.server as h; s = h.HTTPServer(('127.0.0.1', 0), h.SimpleHTTPRequestHandler); "
    "print(f'http://127.0.0.1:{s.server_port}/'); s.serve_forever()"
)


def test_pages_of_other_folders_are_not_listed(tmp_path):
    for name in (".venv", "runs"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "page.html").touch()
    assert list(pages_in(tmp_path)) == [tmp_path / "runs" / "page.html"]
