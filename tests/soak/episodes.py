"""Episodes: random walks in sampled settings, and their findings."""

from typing import NamedTuple

import numpy as np

from soak.checks import check
from soak.report import Tally
from soak.scenes import MODELS, sample_setting
from soak.walks import sample_increments, walk

STEPS = 250


class Episode(NamedTuple):
    """Identity of an episode, which determines all of it."""

    model: str
    seed: int
    index: int
    steps: int = STEPS


def setting_of(episode):
    """Return the setting of an episode, and the generator of its commands."""
    generator = np.random.default_rng([episode.seed, MODELS.index(episode.model), episode.index])
    return sample_setting(generator, episode.model), generator


def play(episode):
    """Play an episode and return its tally, and the cases that reproduce its findings."""
    setting, generator = setting_of(episode)
    solver = setting.solver
    try:
        taken = walk(solver, sample_increments(generator, solver, setting.scale, episode.steps))
    except Exception as error:  # no step in range may raise one
        return Tally(), [{"kind": f"raised {type(error).__name__}", "error": str(error), "episode": list(episode)}]
    tally = Tally.of(episode.model, setting, taken)
    found = check(solver, taken, tally, episode.index * episode.steps)
    return tally, [_case(episode, setting, taken, finding) for finding in found]


def _case(episode, setting, taken, finding):
    solver = setting.solver
    return {
        "kind": finding.kind,
        "value": finding.value,
        "step": finding.step,
        "episode": list(episode),
        "scene_kind": setting.kind,
        "robot": repr(solver.robot),
        "scene": [repr(obstacle) for obstacle in solver.scene],
        "commands": taken.commands[: finding.step + 1].tolist(),
    }
