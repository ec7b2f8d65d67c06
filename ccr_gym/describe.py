"""The docstrings of the registered environments: what they have in common, and tables of what is seen."""

import textwrap
from typing import Any

import numpy as np
from gymnasium import spaces

from ccr_gym.observation import AHEAD, FORCE_SCALE_N, Observer
from ccr_gym.tasks import Task

WIDTH = 116
AXES = {2: "x and y", 3: "x, y, z"}


def describe(task: Task, title: str, description: str, start: str, *, action: str = "") -> str:
    """A docstring in Farama's order of sections.

    Args:
        task: What an episode asks.
        title: What the agent is to do.
        description: Where, and what makes it hard.
        start: What is drawn.
        action: What the numbers of an action are, if they are not one cable increment.
    """
    body = task.body
    settings = body.settings()
    cables = "the cable moves" if body.model.cables == 1 else "the cables move"
    action = action or "cable increment as a fraction of `max_increment_mm`; positive pulls"
    count = body.model.space
    seen = "magnitudes, or vectors with `force_vector` where their difference is taken" if count == 3 else "magnitudes"
    parts = {
        "Description": description,
        "Action Space": f"""`Box(-1, 1, ({body.actions},), float32)`: {action}. It is carried out as far as tension
            limit and obstacles allow; {cables} within {"±" if count == 3 else "0 to "}`cable_limit_mm`
            ({settings.cable_limit_mm:g} mm).""",
        "Observation Space": f"""With `obs_mode="dict"` a `Dict` of float32 boxes, with `obs_mode="flat"` their
            concatenation in this order. Indices are of the flat form for the default robot of
            n = {settings.robot.segments} segments and ideal sensing; everything is clipped to its bounds.

{table(task, settings)}

            Without `force_sensor` the keys `force_error` and `force_measured` are absent.""",
        "Rewards": f"""The sum of named terms, each in `info["reward_terms"]`; F is the true contact force, F_d the
            set-point, {seen}: `force_error` −min(|F−F_d|/F_d, 1); `accuracy` exp(−|F−F_d|/(5 % F_d)); `overshoot`
            −min(max(F/F_d−1, 0), 1) / 2; `approach` minus the clearance in units of 100 mm while nothing touches;
            `effort` −0.02 times the mean square of the action.""",
        "Starting State": start,
        "Episode End": f"No state is terminal. Episodes are truncated after {task.steps} steps.",
        "Info": f"""`force_true` and `force_est` (force on the robot, ({count},) [N]), `desired_force` [N], `cable_mm`,
            `tension` [N], `solver_status` (`solver.Status` as a number), `cost` (force above `force_limit` [N]),
            `is_success` (within 5 % of the set-point), `reward_terms`.""",
        "Arguments": f"""`render_mode`, the fields of `ccr_gym.settings.{type(settings).__name__}`, and `task`:
            `{type(task).__name__}` or a mapping of its fields; mappings make every argument JSON-able.
            `sensing="realistic"` puts backlash, latency, noise, bias, unknown friction and unknown rigidity between
            robot and agent, each episode's own; `split="train"` and `split="test"` draw from scenes that have none in
            common.""",
        "Version History": "* v0: initial version.",
    }
    sections = [f"## {name}\n{_wrapped(text)}" for name, text in parts.items()]
    return title + "\n\n" + "\n\n".join(sections) + "\n"


def table(task: Task, settings: Any) -> str:
    """What is seen, with its indices, meaning, scale and bounds."""
    body, robot = task.body, settings.robot
    observer = Observer(body, settings, body.layout(robot, task.obstacles), task)
    rows = ["| Index | Key | Meaning | Scale | Bounds |", "| --- | --- | --- | --- | --- |"]
    start = 0
    for key, box in observer.dict_space.items():
        assert isinstance(box, spaces.Box)
        end = start + box.shape[0] - 1
        low = int(np.min(box.low))
        bounds = "{0, 1}" if key == "contact" else f"[{low}, 1]"
        index = str(start) if start == end else f"{start}–{end}"
        meaning, scale = _meaning(key, task, settings)
        rows.append(f"| {index} | `{key}` | {meaning} | {scale} | {bounds} |")
        start = end + 1
    return "\n".join(rows)


def _meaning(key: str, task: Task, settings: Any) -> tuple[str, str]:
    """What an entry of the observation is, and its scale."""
    space, robot = task.body.model.space, settings.robot
    lines = "backbone, first and second hole, opposite holes" if space == 3 else ", ".join(robot.touch)
    length = f"{robot.length_mm if space == 3 else max(robot.lengths_mm):g} mm"
    force = f"{FORCE_SCALE_N:g} N"
    which = "" if task.target is None else f" of obstacle {task.target}"
    return {
        "cable": ("cable displacement" if space == 2 else "signed displacements", f"{settings.cable_limit_mm:g} mm"),
        "contact": (f"multiplier > 0, line by line ({lines}), nodes 0…n of each", "flag"),
        "desired_ahead": (f"set-point {', '.join(map(str, AHEAD))} steps ahead", force),
        "desired_force": ("set-point", force),
        "force_error": ("set-point minus measured magnitude", force),
        "force_est": (f"virtual-work estimate of the force on the robot{which}, {AXES[space]} (eq. 11)", force),
        "force_measured": (f"force on the robot{which} from a force sensor, {AXES[space]}", force),
        "frames": ("first and last axis of the disk of nodes 0…n, node by node", "1"),
        "length": ("inserted length", length),
        "nodes": (
            ("x, y, disk angle of nodes 0…n, node by node", f"{length}, {length}, π rad")
            if space == 2
            else ("x, y, z of nodes 0…n, node by node", length)
        ),
        "obstacle": ("centre x, y, z; axis of a cylinder, else 0; radius", f"{length}, 1, 20 mm"),
    }[key]


def _wrapped(text: str) -> str:
    """Paragraphs at a readable width; tables as they are."""
    paragraphs = text.split("\n\n")
    return "\n\n".join(p if p.startswith("|") else textwrap.fill(" ".join(p.split()), WIDTH) for p in paragraphs)
