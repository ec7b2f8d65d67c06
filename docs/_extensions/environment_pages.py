"""Write a page on every registered environment, from its class and from an episode that is played while building.

The pages are in ``docs/environments``, which is no part of the repository.
"""

import dataclasses
import inspect
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import gymnasium
import imageio.v3 as imageio
from sphinx.application import Sphinx

import ccr_gym
from agents import NewtonController

SEED, STEPS = 3, 40  # of the picture
SCENE = 0.09, 0.72, 0.83  # top, bottom and right end of the robot among its obstacles, as parts of a picture
SENSINGS = "ideal", "realistic", "sensorless"
ROLE = re.compile(r":(\w+):`")
Environment = gymnasium.Env[Any, Any]


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before Sphinx looks for them."""
    app.connect("builder-inited", lambda app: write_pages(Path(app.srcdir) / "environments"))
    return {"parallel_read_safe": True}


def write_pages(folder: Path) -> None:
    """Write all pages and pictures, and a table of contents."""
    (folder / "pictures").mkdir(parents=True, exist_ok=True)
    for env_id in ccr_gym.ENV_IDS:
        _write(folder / f"{_name(env_id)}.md", page(env_id, folder))
    _write(folder / "index.md", index())


def index() -> str:
    """Return the page that lists all environments."""
    rows = [["", "id", "what it asks"]]
    for env_id, env_class in ccr_gym.ENV_IDS.items():
        thumbnail = f"![]({_picture(env_id).replace('.png', '.scene.png')}){{width=170px}}"
        rows.append([thumbnail, f"[{env_id}]({_name(env_id)}.md)", summary(env_class)])
    contents = "\n".join(_name(env_id) for env_id in ccr_gym.ENV_IDS)
    return f"""# Environments

Every episode begins with the straight robot and ends after a fixed number of steps; no state is terminal. Each page
below says what is observed, rewarded and sampled, and lists all arguments. `-Paper-v1` is the paper's system to the
letter; all others use the rod ([the models](../model.md)).

{table(rows)}

```{{toctree}}
:hidden:

{contents}
```
"""


def page(env_id: str, folder: Path) -> str:
    """Return the page on an environment, and write its picture."""
    env_class = ccr_gym.ENV_IDS[env_id]
    env = gymnasium.make(env_id, render_mode="rgb_array", obs_mode="dict")
    terms = play(env, folder / _picture(env_id))
    text = sections(env_class)
    extra = {
        "Observation Space": f"Where the entries are with each `sensing`:\n\n{table(list(slices(env_id)))}",
        "Rewards": table(list(rewards(env, terms))),
        "Arguments": arguments(gymnasium.make(env_id)),
    }
    body = "\n\n".join(f"## {name}\n\n{section}\n\n{extra.get(name, '')}" for name, section in text.items())
    return f"""# {env_id}

{summary(env_class)}

```{{image}} {_picture(env_id)}
:alt: {env_id} after {STEPS} steps
:class: environment
```

Step {STEPS} of an episode with ideal sensing, driven by the oracle (`agents.NewtonController.knowing()`).

```python
import gymnasium
import ccr_gym

env = gymnasium.make("{env_id}")
```

{overview(env_id)}

{body}
"""


def play(env: Environment, path: Path) -> dict[str, float]:
    """Write the picture of an episode, and return the terms of the reward in this step."""
    policy = NewtonController.knowing()
    observation, info = env.reset(seed=SEED)
    policy.reset(env)
    for _ in range(STEPS):
        observation, _, _, _, info = env.step(policy.act(observation))
    picture = env.render()
    height, width = picture.shape[:2]
    top, bottom, right = (round(part * size) for part, size in zip(SCENE, (height, height, width), strict=True))
    imageio.imwrite(path, picture)
    imageio.imwrite(path.with_suffix(".scene.png"), picture[top:bottom, :right])
    return {name: float(info[name]) for name in info if name.startswith("reward_")}


def overview(env_id: str) -> str:
    """Return a table of spaces, steps and classes; for the paper's system, what it sets."""
    env, spec = gymnasium.make(env_id), gymnasium.spec(env_id)
    settings = env.unwrapped.settings
    rows = [
        ["", ""],
        ["action space", f"`{env.action_space}`"],
        ["observation space", f"`Box(shape={env.observation_space.shape}, float32)`, ideal sensing"],
        ["steps of an episode", f"{spec.max_episode_steps}"],
        ["class", f"{{py:class}}`ccr_gym.{ccr_gym.ENV_IDS[env_id].__name__}`"],
        ["model, estimator, regulated force", f"`{settings.model}`, `{settings.estimator}`, `{settings.regulate}`"],
    ]
    note = "The numbers in the text below are those of the rod; tables and picture are those of this environment."
    return table(rows) + (f"\n\n{note}" if "-Paper-" in env_id else "")


def slices(env_id: str) -> Iterator[list[str]]:
    """Yield the rows of a table of what stands where in the flat observation."""
    envs = [gymnasium.make(env_id, sensing=sensing).unwrapped for sensing in SENSINGS]
    yield ["key", *(f'`"{sensing}"`' for sensing in SENSINGS)]
    for key in sorted({key for env in envs for key in env.observation_slices}):
        yield [f"`{key}`", *(_span(env.observation_slices.get(key)) for env in envs)]
    yield ["all", *(str(env.observation_space.shape[0]) for env in envs)]


def _span(columns: slice | None) -> str:
    if columns is None:
        return ""
    return str(columns.start) if columns.stop == columns.start + 1 else f"{columns.start}–{columns.stop - 1}"


def rewards(env: Environment, terms: Mapping[str, float]) -> Iterator[list[str]]:
    """Yield the rows of a table of the terms of the reward."""
    weights = env.unwrapped.settings.weights
    meaning = described(type(weights))
    yield ["term", "weight", "meaning", "in the picture"]
    for field in dataclasses.fields(weights):
        value = f"{round(terms[f'reward_{field.name}'], 3) + 0.0:g}"  # no −0
        yield [f"`{field.name}`", f"{getattr(weights, field.name):g}", meaning[field.name], value]


def arguments(env: Environment) -> str:
    """Return the tables of settings and of fields of the task."""
    settings, task = env.unwrapped.settings, env.unwrapped.task
    return f"""### Settings

Defaults that follow from the robot are those of the default robot.

{table(list(declared(settings)))}

### Task

Give these as `task={{…}}`. L is the robot's length and EI its rigidity.

{table(list(declared(task)))}"""


def declared(values: Any) -> Iterator[list[str]]:
    """Yield the rows of a table of the fields of a dataclass, with their values as defaults."""
    meaning = described(type(values))
    yield ["argument", "default", "meaning"]
    for field in dataclasses.fields(values):
        value = getattr(values, field.name)
        default = type(value).__name__ if dataclasses.is_dataclass(value) else _shown(value)
        yield [f"`{field.name}`", f"`{default}`", meaning[field.name]]


def _shown(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, tuple):
        return f"({', '.join(_shown(entry) for entry in value)})"
    return repr(value)


def described(kind: type[Any]) -> dict[str, str]:
    """Return what the docstrings of a class and of its bases say of their attributes."""
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        text = inspect.cleandoc(base.__dict__.get("__doc__") or "")
        _, _, block = text.partition("\nAttributes:\n")
        entries = re.findall(r"^    (\w+): (.*(?:\n        .*)*)", block.split("\n\n")[0], re.MULTILINE)
        found |= {name: _completed(markdown(" ".join(text.split())), found.get(name, "")) for name, text in entries}
    return found


def _completed(meaning: str, inherited: str) -> str:
    """Return a meaning with that of the base class in place of a reference to it."""
    reference, _, rest = meaning.partition("; ")
    return f"{inherited} {rest[:1].upper()}{rest[1:]}" if reference.startswith("As of") else meaning


def markdown(text: str) -> str:
    """Return inline reStructuredText as MyST."""
    return ROLE.sub(r"{py:\1}`", text).replace("``", "`")


def sections(env_class: type[Any]) -> dict[str, str]:
    """Return the sections of an environment's docstring by their names."""
    parts = re.split(r"^## (.*)\n", inspect.cleandoc(env_class.__doc__ or ""), flags=re.MULTILINE)
    return {name: text.strip() for name, text in zip(parts[1::2], parts[2::2], strict=True)}


def summary(env_class: type[Any]) -> str:
    """Return the first line of a docstring."""
    return inspect.cleandoc(env_class.__doc__ or "").splitlines()[0]


def table(rows: list[list[str]]) -> str:
    """Return a Markdown table; the first row is its head."""
    lines = [[cell.replace("|", "\\|") for cell in row] for row in rows]
    lines.insert(1, ["---"] * len(rows[0]))
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _name(env_id: str) -> str:
    return env_id.split("/")[-1]


def _picture(env_id: str) -> str:
    return f"pictures/{_name(env_id)}.png"


def _write(path: Path, text: str) -> None:
    if not path.exists() or path.read_text() != text:
        path.write_text(text)
