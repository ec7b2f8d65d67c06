"""Runs every client of the matrix in the environment of its group, and prints a table: ``make clients``."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).parent
BUILD = HERE.parents[1] / "build" / "clients"
MINUTES = 10  # after which a client is stopped
# The data set that d3rlpy reads is the one that Minari writes, so the order matters.
GROUPS = {
    "core": (
        "gymnasium_wrappers",
        "gymnasium_vectors",
        "sb3",
        "sb3_goals",
        "sb3_contrib_algorithms",
        "rl_zoo",
        "cleanrl_ppo",
        "cleanrl_sac",
        "torchrl_ppo",
        "skrl_ppo",
        "minari_data",
    ),
    "rllib": ("rllib_ppo",),
    "tianshou": ("tianshou_ppo_sac",),
    "d3rlpy": ("d3rlpy_cql",),
}


def main(wanted: list[str]) -> int:
    """Run the clients of these groups or names, or all, and return the number of those that failed."""
    rows = []
    for group, names in GROUPS.items():
        for name in names:
            if not wanted or {group, name} & set(wanted):
                rows.append((group, name, *run(group, name)))
                print(*rows[-1], sep=" | ", flush=True)
    print("\n| group | client | result | seconds | what it did |\n| --- | --- | --- | --- | --- |")
    for row in rows:
        print("|", " | ".join(row), "|")
    return sum(row[2] == "FAILED" for row in rows)


def run(group: str, name: str) -> tuple[str, str, str]:
    """Return result, seconds, and the last line that a client printed: what it did, or its error."""
    scratch = BUILD / group / "runs" / name
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    command = [str(BUILD / group / "bin" / "python"), str(HERE / f"{name}.py")]
    # One thread each; no display; data sets and pictures go to the build folder.
    settings = {"OMP_NUM_THREADS": "1", "SDL_VIDEODRIVER": "dummy", "MINARI_DATASETS_PATH": str(BUILD / "minari")}
    start = time.perf_counter()
    with open(scratch / "out", "w+") as out, open(scratch / "log", "w+") as log:
        try:
            code = subprocess.run(
                command, cwd=scratch, env=os.environ | settings, stdout=out, stderr=log, timeout=60 * MINUTES
            ).returncode
        except subprocess.TimeoutExpired:
            print(f"stopped after {MINUTES} minutes", file=log, flush=True)
            code = 1
        if code < 0:
            print(f"ended by signal {-code}", file=log, flush=True)
        shown = log if code else out
        shown.seek(0)
        said = [line.strip() for line in shown if line.strip()] or ["nothing"]
    result = "FAILED" if code else "ok"
    return result, f"{time.perf_counter() - start:.0f}", said[-1].replace("|", "/")[:200]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
