"""Runs the README on a fresh clone in a fresh virtual environment: every command and block as printed, in order.

``make readme`` calls it. Each command runs in the same shell state as the one before, so that ``cd``, ``export`` and
``source`` last; each block of Python in a process of its own. Servers are started, asked for their page, and stopped;
what does not end within a generous time has failed. Commands that take hours are left out unless ``--hours`` is given;
``--fast`` leaves out those that take minutes, too. A table says what passed and how long it took, with the pictures and
pages it made, to be looked at.
"""

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[1]
HOURS = r"ccr-gym retrain|ccr-gym sweep|ccr-gym evaluate\s*$|make (bench|clients|soak|sanitize)"
MINUTES = r"make (demo|test|native|docs)|ccr-gym (train|evaluate|reproduce)|examples/"
SERVERS = r"tensorboard|ccr-gym play"
PAGES = {".png", ".gif", ".svg", ".mp4", ".html", ".pdf", ".md", ".csv"}
IGNORED = {".git", ".venv", "venv", "build", "cache"}
INHERITED = ("PYTHONPATH", "VIRTUAL_ENV", "MAKE", "MFLAGS")  # of make and of another environment
STATE = "state.sh"  # tells a folder of this script from others
START_SECONDS = 120  # within which a server must show its page
STOP_SECONDS = 20  # within which a process ends that is asked to
LIMITS = {"seconds": 1800.0, "minutes": 4 * 3600.0, "hours": 72 * 3600.0}  # after which a step has failed [s]


@dataclass(frozen=True)
class Step:
    """A command, or a block of Python."""

    language: str
    code: str

    @property
    def kind(self) -> str:
        """What it takes: ``hours``, ``minutes`` or ``seconds``, or that it is a ``server``."""
        if self.language == "python":
            return "seconds"
        kinds = {"server": SERVERS, "hours": HOURS, "minutes": MINUTES}
        return next((kind for kind, pattern in kinds.items() if re.search(pattern, self.code)), "seconds")

    @property
    def title(self) -> str:
        """Its first line that says something."""
        lines = [line for line in self.code.splitlines() if line and not line.startswith(("import ", "from "))]
        return lines[0][:90]


@dataclass
class Result:
    """How a step ended."""

    step: Step
    outcome: str
    seconds: float = 0.0
    output: str = ""
    made: list[Path] = field(default_factory=list)


def steps_of(text: str) -> Iterator[Step]:
    """Yield the commands and the blocks of Python of a page, in its order."""
    for language, block in re.findall(r"^```(python|console)\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        if language == "python":
            yield Step(language, block)
            continue
        for line in block.splitlines():
            command = re.split(r"\s#\s", line.removeprefix("$ "))[0].strip()
            if command and not command.startswith("#"):
                yield Step(language, command)


class Shell:
    """A shell whose state is kept from command to command.

    Args:
        folder: Where its state, what it prints and the blocks of Python are.
        home: Working directory of the first command.
        environment: Environment of the first command.
    """

    def __init__(self, folder: Path, home: Path, environment: dict[str, str]) -> None:
        self._folder, self._home, self._environment = folder, home, environment
        self._state, self._printed, self._blocks = folder / STATE, folder / "printed.txt", 0
        self._state.write_text("")

    def start(self, step: Step) -> subprocess.Popen[bytes]:
        """Return the process of a step."""
        code = step.code
        if step.language == "python":
            self._blocks += 1
            block = self._folder / f"block_{self._blocks}.py"
            block.write_text(code)
            code = f"python '{block}'"
        keep = f"code=$?; {{ export -p; printf 'cd %q\\n' \"$PWD\"; }} > '{self._state}'; exit $code"
        script = f"source '{self._state}'\n{code}\n{keep}"
        with self._printed.open("wb") as printed:
            return subprocess.Popen(
                ["bash", "-c", script],
                stdin=subprocess.DEVNULL,
                stdout=printed,
                stderr=subprocess.STDOUT,
                cwd=self._home,
                env=self._environment,
                start_new_session=True,
            )

    @property
    def printed(self) -> str:
        """What the present step has printed so far."""
        return self._printed.read_text(errors="replace")

    def run(self, step: Step, limit: float | None = None) -> bool:
        """Return whether a step succeeded, within a number of seconds that is by default that of its kind."""
        process = self.start(step)
        try:
            return process.wait(LIMITS[step.kind] if limit is None else limit) == 0
        except subprocess.TimeoutExpired:
            return False
        finally:
            if process.poll() is None:
                stop(process)

    def serve(self, step: Step) -> bool:
        """Return whether a server shows a page at the address that it prints; stop it."""
        process, end = self.start(step), time.monotonic() + START_SECONDS
        try:
            while time.monotonic() < end and process.poll() is None:
                address = re.search(r"https?://[\w.\-]+:\d+", self.printed)
                if address and answers(address[0]):
                    return True
                time.sleep(0.2)
            return False
        finally:
            if process.poll() is None:
                stop(process)


def stop(process: subprocess.Popen[bytes]) -> None:
    """End a step with all that it started: kindly, and what stays then at once."""
    for end in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(process.pid, end)
        except ProcessLookupError:
            break
        try:
            process.wait(STOP_SECONDS)
        except subprocess.TimeoutExpired:
            continue


def answers(address: str) -> bool:
    """Return whether there is a page at an address."""
    try:
        with urllib.request.urlopen(address, timeout=5) as page:
            return bool(page.status == 200)
    except OSError:
        return False


def pages_in(folder: Path) -> dict[Path, float]:
    """Return pictures and pages below a folder with the times of their last change."""
    found = {}
    for base, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if name not in IGNORED]
        pages = [Path(base) / name for name in names if Path(name).suffix in PAGES]
        found.update({page: page.stat().st_mtime for page in pages})
    return found


def run(steps: list[Step], shell: Shell, folder: Path, left_out: set[str]) -> Iterator[Result]:
    """Yield the result of each step."""
    for step in steps:
        if step.kind in left_out:
            yield Result(step, f"left out ({step.kind})")
            continue
        before, start = pages_in(folder), time.monotonic()
        passed = shell.serve(step) if step.kind == "server" else shell.run(step)
        seconds = time.monotonic() - start
        made = [page for page, changed in pages_in(folder).items() if before.get(page) != changed]
        if "git clone" in step.code:  # these are the repository's own
            made = []
        yield Result(step, "passed" if passed else "FAILED", seconds, shell.printed, sorted(made))


def prepare(folder: Path, text: str, pinned: bool) -> Shell:
    """Return a shell with a fresh virtual environment, in a fresh clone unless the page makes it itself."""
    if folder.exists() and any(folder.iterdir()) and not (folder / STATE).exists():
        sys.exit(f"{folder} holds other files; give an empty folder or a new one as --out")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / STATE).touch()
    subprocess.run([sys.executable, "-m", "venv", folder / "venv"], check=True)
    kept = {name: value for name, value in os.environ.items() if not name.startswith(INHERITED)}
    environment = {
        **kept,
        "PATH": f"{folder / 'venv' / 'bin'}{os.pathsep}{os.environ['PATH']}",
        "CCR_GYM_CACHE": str(folder / "cache"),
        "MPLBACKEND": "agg",
    }
    if pinned:
        environment["PIP_CONSTRAINT"] = str(ROOT / "constraints.txt")
    cloned = re.search(r"git clone (\S+)", text)
    if cloned:  # the page's own command, which then clones this repository
        names = {"KEY_0": f"url.{ROOT}.insteadOf", "VALUE_0": cloned[1], "COUNT": "1"}
        return Shell(folder, folder, environment | {f"GIT_CONFIG_{name}": value for name, value in names.items()})
    subprocess.run(["git", "clone", "--quiet", ROOT, folder / "clone"], check=True)
    return Shell(folder, folder / "clone", environment)


def describe(result: Result, folder: Path) -> str:
    """Return a line about a result, the pages that it made, and what a failed step printed last."""
    lines = [f"{result.outcome:20s} {result.seconds:7.1f} s  {result.step.title}"]
    lines += [f"{'':32s}made {page.relative_to(folder)}" for page in result.made]
    if result.outcome == "FAILED":
        lines += [f"    | {line}" for line in result.output.splitlines()[-30:]]
    return "\n".join(lines)


def main() -> int:
    """Run a page; return the number of steps that failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", type=Path, default=ROOT / "README.md", help="page to run")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "readme", help="folder to work in; it is emptied")
    parser.add_argument("--fast", action="store_true", help="leave out what takes minutes")
    parser.add_argument("--hours", action="store_true", help="run what takes hours, too")
    parser.add_argument("--unpinned", action="store_true", help="install the newest versions, not constraints.txt")
    parser.add_argument("--list", action="store_true", help="list the steps and what they take, and run nothing")
    args = parser.parse_args()
    text = args.page.read_text()
    steps = list(steps_of(text))
    if args.list:
        print("\n".join(f"{step.kind:8s} {step.title}" for step in steps))
        return 0
    left_out = ({"minutes"} if args.fast else set()) | (set() if args.hours else {"hours"})
    folder = args.out.resolve()
    results = []
    for result in run(steps, prepare(folder, text, not args.unpinned), folder, left_out):
        results.append(result)
        print(describe(result, folder), flush=True)
    (folder / "output.txt").write_text("".join(f"$ {r.step.code}\n{r.output}\n[{r.outcome}]\n\n" for r in results))
    failed = sum(result.outcome == "FAILED" for result in results)
    print(f"{len(results)} steps, {failed} failed; what they printed is in {folder / 'output.txt'}")
    return failed


if __name__ == "__main__":
    sys.exit(main())
