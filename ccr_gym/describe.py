"""Docstrings of the registered environments, with the numbers of their task, settings and reward."""

import textwrap
from dataclasses import fields

import numpy as np
from gymnasium import spaces

from ccr_gym.adapters import AnyAdapter
from ccr_gym.observation import Observer
from ccr_gym.reward import SUCCESS_ERROR
from ccr_gym.scales import AHEAD, RADIUS_SPAN
from ccr_gym.settings import AnySettings
from ccr_gym.task import AnyTask
from ccr_gym.tasks import LEVELS
from solver import Robot
from solver.common.transition_laws import ACCURACY_RATE, CLEARANCE_SPAN

WIDTH = 116
AXES = {2: "x and y", 3: "x, y, z"}


def describe(task: AnyTask, title: str, description: str, start: str, *, action: str = "") -> str:
    """Return a docstring with the sections of a Farama environment.

    Args:
        task: What an episode asks.
        title: What the agent has to do.
        description: The scene, and what makes the task hard.
        start: How episodes start, with fields of the task in braces.
        action: Meaning of the action; by default that of a single cable increment.
    """
    settings = task.adapter.settings_class()
    adapter = task.adapter(settings, task.adapter.make_batch(settings, 1, task.obstacles, 1).layout)
    share = "" if task.target is None else f", and `share`, how much of its contact forces is on obstacle {task.target}"
    parts = {
        "Description": description,
        "Action Space": _actions(adapter, action),
        "Observation Space": f"""A float32 `Box` of the entries below, in this order (`observation_slices` says where
            they stand); with `obs_mode="dict"` a `Dict` of them. The indices are those for the default robot of
            n = {settings.robot.segments} segments and ideal sensing; entries are clipped to their bounds.

{_table(task, adapter, settings)}

            Without a force sensor the keys `force_error` and `force_measured` are absent. Where sensing is not ideal
            there are `tension`, of each cable as a load cell at its motor reads it, and `free_tension` and `lever` of
            the nominal model{share}; with `randomize` there is `robot`.

            With `obs_mode="goal"` this row is `observation`, beside `desired_goal`, the set-point, and `achieved_goal`,
            the regulated force without errors of sensors: the reward follows from it, and no policy that is to run on
            sensors may read it.""",
        "Rewards": _rewards(settings, adapter.space),
        "Starting State": start.format(**_field_texts(task))
        + f""" Lengths are multiples of the robot's length L, here {settings.scales.length_mm:g} mm, and forces of
            EI/L², here {1000 * settings.scales.force_n:.3g} mN.""",
        "Episode End": f"No state is terminal. Episodes are truncated after {task.steps} steps.",
        "Info": f"""`force_true`, `force_est` and `force_est_paper` (force on the robot, ({adapter.space},) [N]),
            `desired_force` [N], `cable_mm`, `tension` [N], `solver_status` (value of `solver.Status`), `cost` (force
            above `force_limit` [N], a cost of a constrained MDP), `is_success` (within {100 * SUCCESS_ERROR:g} % of the
            set-point), and the terms of the reward, `reward_force_error` and so on.""",
        "Arguments": f"""`render_mode`, the fields of `ccr_gym.settings.{type(settings).__name__}`, and `task`, given as
            `{type(task).__name__}` or as a mapping of its fields. Mappings make every argument JSON-able.
            `sensing="realistic"` adds backlash, latency, noise and errors of the sensors, unknown friction and unknown
            rigidity, sampled anew in every episode, and `"sensorless"` takes the force sensor away; contact flags are
            those of the nominal model then. `randomize` draws the robot of every episode; the entry `robot` of
            observation and `info` tells which it is. `split="train"` and `split="test"` sample from disjoint sets of
            scenes.""",
        "Version History": "* v1: the rod, robots of any size; `-Paper-v1` is the paper's system to the letter.",
    }
    sections = [f"## {name}\n{_wrapped(text)}" for name, text in parts.items()]
    return title + "\n\n" + "\n\n".join(sections) + "\n"


def _actions(adapter: AnyAdapter, action: str) -> str:
    """Return the text of the action space."""
    action = action or "cable increment as a fraction of `max_increment_mm`; a positive one pulls"
    low, high = adapter.actions.low_mm, adapter.actions.high_mm
    cables = "the cable displacement stays" if adapter.actions.commands == 1 else "the cable displacements stay"
    bounds = [f"{cables} within {low[0]:g} to {high[0]:g} mm (`cable_limit_mm`)"]
    if adapter.actions.size > adapter.actions.commands:
        bounds.append(f"the length within {low[-1]:g} to {high[-1]:g} mm (`robot.length_range_mm`)")
    return f"""`Box(-1, 1, ({adapter.actions.size},), float32)`: {action}. A move is carried out as far as the tension
        limit and the obstacles allow; {", ".join(bounds)}. A full action moves by
        {" and ".join(f"{full:g}" for full in adapter.actions.increment_mm)} mm."""


def _rewards(settings: AnySettings, space: int) -> str:
    """Return the text of the rewards."""
    weights = settings.weights
    kind = "magnitudes, or vectors with `force_vector` where they are subtracted" if space == 3 else "magnitudes"
    return f"""The sum of named terms, each in `info` as `reward_…`; F is the regulated force, F_d the set-point,
        {kind}: `force_error` −{weights.force_error:g} min(|F−F_d|/F_d, 1); `accuracy` {weights.accuracy:g}
        exp(−{ACCURACY_RATE:g} |F−F_d|/F_d); `overshoot` −{weights.overshoot:g} min(max(F/F_d−1, 0), 1); `approach`
        −{weights.approach:g} min(clearance / {CLEARANCE_SPAN:.3g} L, 1) while nothing touches; `effort`
        −{weights.effort:g} times the mean square of the action."""


def _field_texts(task: AnyTask) -> dict[str, object]:
    """Return the fields of a task as texts, and the levels of a moving set-point."""
    texts: dict[str, object] = {"levels": _text(LEVELS)}
    for declared in fields(task):
        texts[declared.name] = _text(getattr(task, declared.name))
    return texts


class _Pair(tuple[object, ...]):
    """Texts of two numbers: as a whole that of a range, which is one number where both ends are the same."""

    def __format__(self, _: str) -> str:
        return "–".join(map(str, dict.fromkeys(self)))


def _text(value: object) -> object:
    """Return a number as text, a tuple of numbers or ranges as texts."""
    if isinstance(value, tuple):
        return _Pair(_text(entry) for entry in value)
    return f"{value:.3g}" if isinstance(value, float) else value


def _table(task: AnyTask, adapter: AnyAdapter, settings: AnySettings) -> str:
    """Return the table of observed entries: indices, meaning, scale and bounds."""
    rows = ["| Index | Key | Meaning | Scale | Bounds |", "| --- | --- | --- | --- | --- |"]
    start = 0
    for key, box in Observer(adapter, task).dict_space.items():
        assert isinstance(box, spaces.Box)
        end = start + box.shape[0] - 1
        bounds = "{0, 1}" if key == "contact" else f"[{int(np.min(box.low))}, 1]"
        index = str(start) if start == end else f"{start}–{end}"
        meaning, scale = _meaning(key, task, settings)
        rows.append(f"| {index} | `{key}` | {meaning} | {scale} | {bounds} |")
        start = end + 1
    return "\n".join(rows)


def _meaning(key: str, task: AnyTask, settings: AnySettings) -> tuple[str, str]:
    """Return meaning and scale of an entry of the observation."""
    robot, force = settings.robot, f"{settings.force_span * settings.scales.force_n:.3g} N"
    planar, space = isinstance(robot, Robot), task.adapter.space
    radius = RADIUS_SPAN * settings.scales.length_mm
    lines = ", ".join(robot.touch) if planar else "backbone, first and second hole, opposite holes"
    length = f"{max(robot.lengths_mm) if isinstance(robot, Robot) else robot.length_mm:g} mm"
    whose = "" if task.target is None else f" of obstacle {task.target}"
    return {
        "cable": ("cable displacement" if planar else "signed displacements", f"{settings.cable_limit_mm:g} mm"),
        "contact": (f"multiplier > 0, line by line ({lines}), nodes 0…n of each", "flag"),
        "desired_ahead": (f"set-point {', '.join(map(str, AHEAD))} steps ahead", force),
        "desired_force": ("set-point", force),
        "force_error": ("set-point minus measured magnitude", force),
        "force_est": (f"virtual-work estimate of the force on the robot{whose}, {AXES[space]} (eq. 11)", force),
        "force_measured": (f"force on the robot{whose} from a force sensor, {AXES[space]}", force),
        "frames": ("first and last axis of the disk of nodes 0…n, node by node", "1"),
        "length": ("inserted length", length),
        "nodes": (
            ("x, y, disk angle of nodes 0…n, node by node", f"{length}, {length}, π rad")
            if planar
            else ("x, y, z of nodes 0…n, node by node", length)
        ),
        "obstacle": (
            "centre x, y, z; axis of a cylinder, else 0; radius",
            f"{length}, 1, {radius:g} mm",
        ),
    }[key]


def _wrapped(text: str) -> str:
    """Return paragraphs at a readable width, tables unchanged."""
    paragraphs = text.split("\n\n")
    return "\n\n".join(p if p.startswith("|") else _filled(p) for p in paragraphs)


def _filled(paragraph: str) -> str:
    return textwrap.fill(" ".join(paragraph.split()), WIDTH, break_on_hyphens=False)
