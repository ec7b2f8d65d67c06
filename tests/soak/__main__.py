"""The soak in its long form: ``python -m soak --steps 3000000``."""

import argparse
import json
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from soak.episodes import STEPS, Episode, play
from soak.report import Tally, table
from soak.scenes import MODELS

SHARES = {"uniform": 0.4, "sliding": 0.4, "space": 0.2}


def main():
    """Run, write the table and the cases, and end with 1 where anything was found."""
    options = _options()
    began = time.time()
    episodes = [
        Episode(model, options.seed, index)
        for model in options.models
        for index in range(-(-int(options.steps * _share(model, options.models)) // STEPS))
    ]
    tallies, cases = {model: Tally() for model in options.models}, []
    with ProcessPoolExecutor(options.processes) as pool:
        for episode, (tally, found) in zip(episodes, pool.map(play, episodes, chunksize=8), strict=True):
            tallies[episode.model].add(tally)
            cases += found
    _write(options.out, tallies, cases, time.time() - began)
    sys.exit(bool(cases))


def _options():
    parser = argparse.ArgumentParser(description=__doc__, prog="python -m soak")
    parser.add_argument("--steps", type=int, default=30_000, help="steps in total (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="seed of all episodes")
    parser.add_argument("--models", nargs="+", choices=MODELS, default=list(MODELS))
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--out", type=Path, default=Path("runs/soak"), help="folder of the report and the cases")
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
    for case in cases[:20]:
        print(case["kind"], case["value"], "episode", case["episode"], "step", case["step"], case["scene_kind"])
    print(f"{len(cases)} cases in {folder / 'cases.json'}; {seconds:.0f} s")


if __name__ == "__main__":
    main()
