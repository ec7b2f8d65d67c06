"""Measure what the tables of the docs show, and write these between their marks.

``python -m benchmarks.tables`` plays every policy with both settings of the sensors, and measures what the estimator
knows and what wrong contact flags cost. Every result is kept in ``runs/tables``, so that an interrupted run is resumed,
and several processes share the work; after a change of what is measured, delete that folder. Then it writes
``docs/results``, the tables between ``<!-- numbers: name -->`` and ``<!-- /numbers -->``, and ``runs/tables/evaluation``
as ``ccr-gym evaluate`` does.
"""

import json
import pickle
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import gymnasium
import numpy as np
import tyro

from agents import PredictiveController, RobotEstimator, scores, search
from agents.benchmark import report, suite
from agents.benchmark.statistics import iqm, iqm_interval
from agents.benchmark.suite import Entry, Result
from agents.config import EVALUATION_SEED, POLICIES, EvaluateConfig
from agents.policy import Observation
from agents.tuned import LEARNERS
from ccr_gym import ENV_IDS

ROOT = Path(__file__).parents[1]
KEPT = ROOT / "runs/tables"
DOCS = ("README.md", "docs/benchmark.md", "docs/sensing.md")
EPISODES = 60
SENSINGS = ("realistic", "sensorless")
IDS = tuple(env_id for env_id in ENV_IDS if "-Paper-" not in env_id)
HONEST = ("P", "PI", "MPC", "Harmonic")  # controllers that see what agents see
HEADROOM = (*HONEST, "Newton", "Oracle")
LEAST_ERROR, LARGEST_SHARE = 0.05, 0.5  # of the set-point, and of the best controller's error: there is room
T = TypeVar("T")
Row = dict[str, Any]


@dataclass(frozen=True)
class Args:
    """Measure what is missing in runs/tables, and write all tables."""

    env_ids: tuple[str, ...] = IDS
    """Environments to measure; tables are written of all."""
    policies: tuple[str, ...] = POLICIES
    """Policies to measure."""
    sensings: tuple[str, ...] = SENSINGS
    """Settings of the sensors to measure."""
    measure: bool = True
    """Whether to measure, or to write what there is."""
    write: bool = True
    """Whether to write, or to measure only."""


def kept(name: str, measure: Callable[[], T]) -> T | None:
    """Return a result, measured now where nobody has; None while another process measures it."""
    path = KEPT / f"{name}.pkl"
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        path.touch(exist_ok=False)
    except FileExistsError:
        return load(path)
    try:
        found = measure()
        path.write_bytes(pickle.dumps(found))
    except BaseException:
        path.unlink()
        raise
    print(name, flush=True)
    return found


def load(path: Path) -> Any:
    """Return a kept result, None where there is none."""
    return pickle.loads(path.read_bytes()) if path.exists() and path.stat().st_size else None


def entries(args: Args) -> list[Entry]:
    """Return the policies to play; learned ones with the sensing that they were trained with."""
    configs = [
        EvaluateConfig(env_ids=args.env_ids, policies=(policy,), sensing=sensing)
        for policy in args.policies
        for sensing in args.sensings
        if policy not in LEARNERS or sensing == "realistic"
    ]
    return [entry for config in configs for entry in _entries(config)]


def _entries(config: EvaluateConfig) -> list[Entry]:
    learned = config.policies[0] in LEARNERS
    return [] if learned and not _trained(config) else suite.entries(config)


def _trained(config: EvaluateConfig) -> bool:
    return any((config.pretrained / config.policies[0]).glob("*"))


def played(entry: Entry) -> Result | None:
    """Return the result of a policy on the test scenes."""
    name = f"{entry.policy}-{entry.env_id.split('/')[1]}-{entry.sensing}"
    return kept(name, lambda: suite.play(entry, EVALUATION_SEED, EPISODES))


def main(args: Args) -> None:
    """Measure and write."""
    if args.measure:
        for entry in entries(args):
            played(entry)


if __name__ == "__main__":
    main(tyro.cli(Args))
