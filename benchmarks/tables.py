"""Measure what the tables of the docs show, and write these between their marks.

``python -m benchmarks.tables`` plays every policy with both settings of the sensors, and measures what the estimator
knows, what wrong contact flags cost and what a reversal of the cable tells. Every result is kept in ``runs/tables``,
so that an interrupted run is resumed, and several processes share the work; after a change of what is measured, delete
that folder. Then it writes ``docs/results``, the tables between ``<!-- numbers: name -->`` and ``<!-- /numbers -->``,
and what ``ccr-gym evaluate`` writes into ``runs/tables/evaluation``.
"""

import pickle
import runpy
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import gymnasium
import numpy as np
import tyro

from agents import Knowledge, PredictiveController, RobotEstimator, scores, search
from agents.benchmark import report, suite
from agents.benchmark.evaluate import SEARCH
from agents.benchmark.statistics import iqm, iqm_interval
from agents.benchmark.suite import Entry, Result
from agents.config import EVALUATION_SEED, POLICIES, EvaluateConfig
from agents.environment import make_env
from agents.learning.pretrained import trained
from agents.policy import Observation
from agents.tuned import LEARNERS, sensing_of
from benchmarks import pages
from benchmarks.evaluation_text import HEADROOM
from ccr_gym import ENV_IDS, PrivilegedState

ROOT = Path(__file__).parents[1]
KEPT = ROOT / "runs/tables"
EPISODES = 60
SENSINGS = ("realistic", "sensorless")
IDS = tuple(env_id for env_id in ENV_IDS if "-Paper-" not in env_id)
HONEST = ("P", "PI", "MPC", "Harmonic")  # controllers that see what agents see
LEAST_ERROR, LARGEST_SHARE = 0.05, 0.5  # of the set-point, and of the best controller's error: there is room
ROBOTS, STEPS = 1000, (8, 16, 32, 48, 64, 96, 128)  # of the table of what the estimator knows
PROFILE_STEPS = 128  # of an episode whose set-point moves
LEAST_FORCE, LEAST_SHARE = 0.1, 0.2  # that counts as pressing [EI/L²], and of robots that press for a number of theirs
T = TypeVar("T")
Row = dict[str, Any]


@dataclass(frozen=True)
class Args:
    """Measure what is missing in runs/tables, and write all tables."""

    env_ids: tuple[str, ...] = tuple(ENV_IDS)
    """Environments to measure; tables are written of all."""
    policies: tuple[str, ...] = POLICIES
    """Policies to measure."""
    sensings: tuple[str, ...] = SENSINGS
    """Settings of the sensors to measure."""
    others: tuple[str, ...] = ("knowledge", "flags")
    """What else to measure: what the estimator knows, and what wrong flags cost."""
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
    """Return the policies to play: learned ones with the sensing that they were trained with, as all on the paper's."""
    configs = [
        EvaluateConfig(env_ids=(env_id,), policies=(policy,), sensing=sensing)
        for policy in args.policies
        for env_id in args.env_ids
        for sensing in (args.sensings if env_id in IDS else (sensing_of(env_id),))
        if policy not in LEARNERS or (sensing == sensing_of(env_id) and trained(policy, env_id))
    ]
    return [entry for config in configs for entry in suite.entries(config)]


def played(entry: Entry) -> Result | None:
    """Return the result of a policy on the test scenes."""
    name = f"{entry.policy}-{entry.env_id.split('/')[1]}-{entry.sensing}"
    return kept(name, lambda: suite.play(entry, EVALUATION_SEED, EPISODES))


def set_point(env_id: str) -> float:
    """Return the mean set-point of the test scenes, over the steps that are scored [mN]."""
    env, goals = make_env(env_id, sensing="realistic", split="test"), []
    moving = "desired_ahead" in env.observation_space.spaces
    for seed in range(EVALUATION_SEED, EVALUATION_SEED + EPISODES):
        _, info = env.reset(seed=seed)
        steps = [info["desired_force"]]
        for _ in range(moving * PROFILE_STEPS):
            *_, info = env.step(np.zeros(env.action_space.shape, np.float32))
            steps.append(info["desired_force"])
        goals.append(np.mean([np.linalg.norm(goal) for goal in steps[-max(len(steps) - SEARCH, 1) :]]))
    return 1e3 * float(np.mean(goals))


def headroom(results: Sequence[Result]) -> list[Row]:
    """Return the force errors [mN] of each environment and setting, and whether these leave room."""
    found = {(r.entry.env_id, r.entry.sensing, r.entry.policy): r.summary for r in results}
    rows = []
    for sensing in SENSINGS:
        for env_id in IDS:
            errors = {p: found[env_id, sensing, p] for p in HEADROOM if (env_id, sensing, p) in found}
            if not {"MPC", "Oracle"} <= errors.keys():
                continue
            goal = kept(f"set-point-{env_id.split('/')[1]}", partial(set_point, env_id)) or np.nan
            best = min(errors[p]["rmse_iqm_mn"] for p in HONEST if p in errors)
            room = best >= LEAST_ERROR * goal and errors["Oracle"]["rmse_iqm_mn"] <= LARGEST_SHARE * best
            shown = {p: [e["rmse_iqm_mn"], *e["rmse_interval_mn"]] for p, e in errors.items()}
            rows.append(
                {"id": env_id, "sensing": sensing, "set_point": goal, "errors": shown, "best": best, "room": room}
            )
    return rows


def reversed_once(
    seen: Observation, known: Knowledge, settings: Any, phase: np.ndarray, spent: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Return speeds that pull, reverse once and then regulate the force, with their phases and the steps in these."""
    touching = seen["contact"].any(axis=1)
    on = ((phase == 0) & ((spent > 8) | touching)) | ((phase == 1) & (spent > 4))
    on |= (phase == 2) & touching & (spent > 5)
    phase, spent = phase + on, np.where(on, 0, spent)
    goal = settings.force_span * np.linalg.norm(seen["desired_force"], axis=1)
    drive = np.where(touching, np.clip(0.4 * (goal - known.force), -1, 1), 0.4)
    return np.choose(phase, [1.0, -1.0, 1.0, drive]), phase, spent


def knowledge(env_id: str, sensing: str) -> list[Row]:
    """Return errors of the estimator, and how often the truth is within two standard deviations.

    The robots pull for eight steps, let the cable out for four, search for contact and regulate the force.
    """
    kwargs = {"sensing": sensing, "obs_mode": "dict", "autoreset_mode": "Disabled"}
    envs = gymnasium.make_vec(env_id, ROBOTS, **kwargs)
    settings = envs.unwrapped.settings
    seen, _ = envs.reset(seed=5)
    estimator = RobotEstimator(settings, ROBOTS)
    known, rows = estimator.update(seen), []
    phase, spent = np.zeros(ROBOTS, int), np.zeros(ROBOTS, int)
    for step in range(1, min(envs.get_attr("spec")[0].max_episode_steps, STEPS[-1]) + 1):
        speed, phase, spent = reversed_once(seen, known, settings, phase, spent + 1)
        seen, _, _, _, info = envs.step((speed[:, None] * search(seen)).astype(np.float32))
        known = estimator.update(seen)
        if step in STEPS:
            force = np.linalg.norm(info["force_true"], axis=1) / settings.scales.force_n
            pressing = seen["contact"].any(axis=1) & (force > LEAST_FORCE)
            errors = _errors(known, envs.unwrapped.privileged_state, settings, force, pressing)
            rows.append({"id": env_id, "sensing": sensing, "step": step, **errors})
    return rows


def _errors(known: Knowledge, state: PrivilegedState, settings: Any, force: np.ndarray, pressing: np.ndarray) -> Row:
    """Return pairs of the median error and the share within two standard deviations, of each number."""
    half = state.half_backlash_mm[:, 0] / settings.scales.travel_mm
    truth = {"latency": state.latency, "half_backlash": half, "loss": state.tendon_loss}
    truth |= {"rigidity": state.rigidity_ratio, "force": force}
    found = {}
    for name, true in truth.items():
        chosen = pressing if name == "force" else np.ones(ROBOTS, bool)
        error = np.abs(getattr(known, name) - true)
        within = (error <= 2 * getattr(known, f"{name}_std") + 1e-9)[chosen]
        shown = (
            error / np.maximum(true, LEAST_FORCE)
            if name in ("rigidity", "force")
            else (error > 0.5 if name == "latency" else error)
        )
        if chosen.mean() >= LEAST_SHARE:
            size = np.mean(shown) if name == "latency" else np.median(shown[chosen])
            found[name] = [float(size), float(within.mean())]
    return found


class Told(PredictiveController):
    """MPC that is told the flags of the robot itself."""

    def act(self, observation: Observation) -> np.ndarray:
        """Return the action for an observation."""
        own = self._env.unwrapped.equilibrium.contact.any(axis=0).ravel()
        return super().act(observation | {"contact": own.astype(observation["contact"].dtype)})


def cost_of_flags(env_id: str, sensing: str) -> Row:
    """Return by how much the error of MPC falls if it is told the robot's own flags [mN], in the same scenes."""
    usual = played(Entry("MPC", env_id, sensing))
    if usual is None:
        raise RuntimeError(
            f"another process plays MPC on {env_id} with {sensing} sensing; wait for it, and start again"
        )
    fall = usual.rmse[0] - scores(Told(), env_id, EVALUATION_SEED, EPISODES, sensing=sensing, split="test")
    low, high = iqm_interval(fall[None])
    return {"id": env_id, "sensing": sensing, "fall": float(iqm(fall)), "low": low, "high": high}


def probe() -> dict[str, dict[str, float]]:
    """Return what a reversal of the cable tells, and draw its picture; see ``examples/probe.py``."""
    example = runpy.run_path(str(ROOT / "examples/probe.py"))
    found: dict[str, dict[str, float]] = example["main"](example["Args"](out=ROOT / "docs/probe.png"))
    return {label: {name: round(value, 6) for name, value in errors.items()} for label, errors in found.items()}


def write() -> None:
    """Write results, tables and the folder of an evaluation from what is kept."""
    results = [found for path in sorted(KEPT.glob("*-v1-*.pkl")) if isinstance(found := load(path), Result)]
    results.sort(key=lambda r: (list(ENV_IDS).index(r.entry.env_id), POLICIES.index(r.entry.policy)))
    usual = [r for r in results if r.entry.sensing == sensing_of(r.entry.env_id)]
    pages.save("headroom", headroom(results))
    pages.save("knowledge", [row for path in _kept_of("knowledge") for row in load(path) or ()])
    pages.save("cost_of_flags", [row for path in _kept_of("flags") if (row := load(path))])
    pages.save("probe", probe())
    (KEPT / "evaluation/videos").mkdir(parents=True, exist_ok=True)
    report.write(usual, EvaluateConfig(out=KEPT / "evaluation", episodes=EPISODES))
    pages.take_evaluation(KEPT / "evaluation/evaluation.json")
    pages.write()


def _kept_of(kind: str) -> list[Path]:
    """Return the results of a kind, in the order of the environments and settings."""
    return [KEPT / f"{kind}-{env_id.split('/')[1]}-{sensing}.pkl" for env_id in IDS for sensing in SENSINGS]


def main(args: Args) -> None:
    """Measure and write."""
    for entry in entries(args) if args.measure else ():
        played(entry)
    for kind, measure in MEASURES.items() if args.measure else ():
        for path in _kept_of(kind):
            env_id, sensing = f"CCR/{path.stem.split('-')[1]}-v1", path.stem.split("-")[-1]
            if kind in args.others and env_id in args.env_ids and sensing in args.sensings:
                kept(path.stem, partial(measure, env_id, sensing))
    if args.write:
        write()


MEASURES: dict[str, Callable[[str, str], Any]] = {"knowledge": knowledge, "flags": cost_of_flags}

if __name__ == "__main__":
    main(tyro.cli(Args))
