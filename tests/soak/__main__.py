"""The soak in its long form: ``python -m soak --steps 3000000``."""

import argparse
import json
import os
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from soak.cases import find, shrink
from soak.episodes import Episode, play
from soak.report import Tally, table
from soak.scenes import MODELS

SHARES = {"uniform": 0.4, "sliding": 0.4, "space": 0.2}
STEPS = 500  # of an episode
KEPT = 10  # cases of a kind that are made small and kept


def main():
    """Run, write the table and the cases, and end with 1 where anything was found."""
    options = _options()
    if options.case:
        sys.exit(_replay(*options.case))
    began = time.time()
    episodes = [
        Episode(model, options.seed, index, STEPS)
        for model in options.models
        for index in range(-(-int(options.steps * _share(model, options.models)) // STEPS))
    ]
    tallies, cases, kept = {model: Tally() for model in options.models}, [], Counter()
    with ProcessPoolExecutor(options.processes) as pool:
        for episode, (tally, found) in zip(episodes, pool.map(play, episodes, chunksize=4), strict=True):
            tallies[episode.model].add(tally)
            for case in found:
                kept[episode.model, case["kind"]] += 1
                cases += [case] if kept[episode.model, case["kind"]] <= KEPT else []
        cases = list(pool.map(shrink, cases))
    _write(options.out, tallies, cases, time.time() - began)
    sys.exit(bool(cases))


def _replay(path, index):
    """Play one case of a report again, and tell what it shows."""
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
    parser.add_argument("--case", nargs=2, metavar=("FILE", "INDEX"), help="play one case of cases.json again")
    return parser.parse_args()


def _share(model, models):
    return SHARES[model] / sum(SHARES[name] for name in models)


def _write(folder, tallies, cases, seconds):
    folder.mkdir(parents=True, exist_ok=True)
    text = table(tallies)
    report = {"seconds": seconds, "tallies": {name: tally.as_dict() for name, tally in tallies.items()}}
    (folder / "soak.json").write_text(json.dumps(report, indent=1))
    (folder / "soak.md").write_text(text + "\n")
    (folder / "cases.json").write_text(json.dumps(cases, indent=1))
    print(text)
    for model, tally in tallies.items():
        print(f"{model}: {dict(tally.findings) or 'nothing found'}")
    print(f"{len(cases)} cases in {folder / 'cases.json'}; {seconds:.0f} s")


if __name__ == "__main__":
    main()
