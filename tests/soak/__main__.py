"""The long soak: ``python -m soak --steps 3000000``; interrupted, it goes on with ``--resume``."""

import argparse
import json
import os
import random
import sys
import time
from collections import Counter
from pathlib import Path

from agents.workers import worker_pool
from soak.cases import find, shrink
from soak.episodes import Episode, play
from soak.report import Tally, table
from soak.scenes import MODELS

SHARES = {"paper": 2, "rod": 2, "space": 1, "pair": 1, "sections": 1, "gravity": 1, "space rod": 2}
STEPS = 500  # of an episode
REPORTS = 20  # written in the course of a run
KEPT = 10  # cases of each kind that are shrunk and kept


class Report:
    """Findings so far, written to a folder."""

    def __init__(self, folder, models):
        self.folder, self.began, self.finished = folder, time.time(), folder / "episodes.jsonl"
        self.tallies, self.cases, self.kept = {model: Tally() for model in models}, [], Counter()

    def begin(self, episodes, resume):
        """Return the episodes yet to be played: all, or those that the run before this one did not finish."""
        self.folder.mkdir(parents=True, exist_ok=True)
        text = self.finished.read_text() if resume and self.finished.exists() else ""
        self.finished.write_text("")
        rows = {Episode(*row[0]): row for row in map(json.loads, text.split("\n")[:-1])}  # the last may be cut off
        for episode in (episode for episode in episodes if episode in rows):
            _, tally, found = rows[episode]
            self.add(episode, Tally.load(tally), found)
        return [episode for episode in episodes if episode not in rows]

    def add(self, episode, tally, found):
        """Add an episode; only some cases of each kind of finding are kept."""
        with self.finished.open("a") as file:
            file.write(json.dumps([episode, vars(tally), found]) + "\n")
        model = episode.model
        self.tallies[model].add(tally)
        for case in found:
            self.kept[model, case["kind"]] += 1
            if self.kept[model, case["kind"]] <= KEPT:
                self.cases.append(case)

    def write(self):
        """Write ``soak.json``, ``soak.md`` and ``cases.json``."""
        tallies = {model: tally.as_dict() for model, tally in self.tallies.items()}
        report = {"seconds": time.time() - self.began, "tallies": tallies}
        (self.folder / "soak.json").write_text(json.dumps(report, indent=1))
        (self.folder / "soak.md").write_text(table(self.tallies) + "\n")
        (self.folder / "cases.json").write_text(json.dumps(self.cases, indent=1))

    def __str__(self):
        found = "\n".join(f"{model}: {dict(t.findings) or 'nothing found'}" for model, t in self.tallies.items())
        cases = f"cases are in {self.folder / 'cases.json'}; replay one with --case FILE INDEX"
        return f"{table(self.tallies)}\n{found}\n{cases}\n{time.time() - self.began:.0f} s"


def main():
    """Run, write the table and the cases, and exit with 1 if anything was found."""
    options = _options()
    if options.case:
        sys.exit(_replay(*options.case))
    report = Report(options.out, options.models)
    episodes = report.begin(_episodes(options), options.resume)
    with worker_pool(options.processes) as pool:
        played = zip(episodes, pool.map(play, episodes, chunksize=4), strict=True)
        for count, (episode, (tally, found)) in enumerate(played, 1):
            report.add(episode, tally, found)
            if count % (-(-len(episodes) // REPORTS)) == 0:
                print(
                    f"{count / len(episodes):.0%}: {dict(report.kept) or 'nothing found'}", file=sys.stderr, flush=True
                )
                report.write()
        report.cases = list(pool.map(shrink, report.cases))
    report.write()
    print(report)
    sys.exit(bool(report.cases))


def _episodes(options):
    """Return all episodes, shuffled, so that a part of them represents all models."""
    total = sum(SHARES[model] for model in options.models)
    counts = {model: -(-int(options.steps * SHARES[model] / total) // STEPS) for model in options.models}
    episodes = [Episode(model, options.seed, k, STEPS) for model, count in counts.items() for k in range(count)]
    random.Random(options.seed).shuffle(episodes)
    return episodes


def _replay(path, index):
    """Replay one case of a report and print its findings; return whether there are none."""
    case = json.loads(Path(path).read_text())[int(index)]
    findings = find(case)
    print(json.dumps(case, indent=1), *findings, sep="\n")
    return not findings


def _options():
    parser = argparse.ArgumentParser(description=__doc__, prog="python -m soak")
    parser.add_argument("--steps", type=int, default=30_000, help="steps in total (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="seed of all episodes")
    parser.add_argument("--models", nargs="+", choices=MODELS, default=list(MODELS))
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--out", type=Path, default=Path("runs/soak"), help="folder of the report and the cases")
    parser.add_argument("--resume", action="store_true", help="go on with the run in this folder that was interrupted")
    parser.add_argument("--case", nargs=2, metavar=("FILE", "INDEX"), help="replay one case of cases.json")
    return parser.parse_args()


if __name__ == "__main__":
    main()
