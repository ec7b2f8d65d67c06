"""Write the numbers of README and docs from the result files in ``docs/results``.

``make numbers`` fills the blocks between ``<!-- numbers: name -->`` and ``<!-- /numbers -->``. New results are put into
place first: ``python -m benchmarks.pages --evaluation runs/evaluation/evaluation.json --bench runs/bench.json``.
``python -m benchmarks.tables`` measures policies and the estimator, and does both.
"""

import argparse
import json
import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from agents.benchmark import report
from benchmarks import evaluation_text as policies
from benchmarks import speed_text as speed

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "docs/results"
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))


def load(name: str) -> Any:
    """Return what a result file holds."""
    path = RESULTS / f"{name}.json"
    return json.loads(path.read_text())


def save(name: str, values: object) -> None:
    """Write a result file."""
    (RESULTS / f"{name}.json").write_text(json.dumps(values, indent=1, ensure_ascii=False) + "\n")


def take_evaluation(path: Path) -> None:
    """Keep the summaries of an evaluation, without its episodes.

    Raises:
        SystemExit: If the file is no evaluation, or one of no policy.
    """
    found = json.loads(path.read_text())
    if not (isinstance(found, dict) and found.get("results")):
        sys.exit(f"{path} holds no results of policies: give the evaluation.json that ccr-gym evaluate writes")
    kept = [{key: result[key] for key in ("policy", "env_id", "sensing", "summary")} for result in found["results"]]
    save("evaluation", {**found, "results": [rounded(result) for result in kept]})


def take_bench(path: Path) -> None:
    """Keep the results of a benchmark.

    Raises:
        SystemExit: If it was made without MuJoCo, which the docs compare with.
    """
    found = json.loads(path.read_text())
    if not any(name.startswith("mujoco ") for name in found["peers"]):
        sys.exit(f"{path} has nothing of MuJoCo: pip install mujoco, and measure again")
    save("bench", rounded(found))


def rounded(value: Any) -> Any:
    """Return numbers of a result with six decimals."""
    if isinstance(value, dict):
        return {key: rounded(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [rounded(entry) for entry in value]
    return round(value, 6) if isinstance(value, float) else value


def blocks() -> dict[str, str]:
    """Return the text of every block by its name."""
    return {name: make(*map(load, files)) for name, (make, files) in BLOCKS.items()}


def fill(text: str, blocks: Mapping[str, str]) -> str:
    """Return a text with blocks between their marks.

    Raises:
        ValueError: If a mark names a block that is not there.
    """

    def filled(found: re.Match[str]) -> str:
        if found[1] not in blocks:
            raise ValueError(f"the mark {found[1]!r} names no block; blocks are {', '.join(blocks)}")
        return f"<!-- numbers: {found[1]} -->\n{blocks[found[1]]}\n<!-- /numbers -->"

    return re.sub(r"<!-- numbers: (.+?) -->\n.*?<!-- /numbers -->", filled, text, flags=re.DOTALL)


def write() -> None:
    """Fill the blocks of all pages."""
    found = blocks()
    for page in PAGES:
        before = page.read_text()
        if (after := fill(before, found)) != before:
            page.write_text(after)
            print(f"{page.relative_to(ROOT)}: written")


BLOCKS: dict[str, tuple[Callable[..., str], tuple[str, ...]]] = {  # what makes a text, and of which result files
    "errors in short": (policies.errors_in_short, ("evaluation", "headroom")),
    "errors": (lambda found: report.matrix(policies.grouped(found)).strip(), ("evaluation",)),
    "policies": (lambda found: report.markdown(policies.grouped(found)).strip(), ("evaluation",)),
    "judgement": (policies.judgement, ("evaluation",)),
    "events": (policies.events, ("evaluation",)),
    "headroom": (policies.headroom_table, ("headroom",)),
    "knowledge": (policies.knowledge_table, ("knowledge",)),
    "probe": (policies.probe_line, ("probe",)),
    "cost of flags": (policies.cost_table, ("cost_of_flags",)),
    "speed in short": (speed.speed_in_short, ("bench", "demo")),
    "kernel": (speed.kernel_table, ("bench",)),
    "environments": (speed.environments_table, ("bench",)),
    "statuses": (speed.statuses_line, ("bench",)),
    "mujoco": (speed.mujoco_line, ("bench",)),
    "instructions": (speed.instructions_table, ("../../benchmarks/instructions",)),
    "memo": (speed.cache_table, ("cache",)),
    "compiled shapes": (speed.starts_line, ("cache",)),
    "single-file ppo": (speed.ppo_line, ("examples_ppo",)),
    "demo": (speed.demo_line, ("demo",)),
}


def main() -> None:
    """Take new results, and write the pages."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--evaluation", type=Path, help="evaluation.json of ccr-gym evaluate")
    parser.add_argument("--bench", type=Path, help="bench.json of ccr-gym bench")
    args = parser.parse_args()
    if args.evaluation:
        take_evaluation(args.evaluation)
    if args.bench:
        take_bench(args.bench)
    write()


if __name__ == "__main__":
    main()
