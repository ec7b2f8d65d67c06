"""The single environment."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium import spaces

from ccr_gym.checks import (
    check_array,
    check_choice,
    check_names,
    check_number,
    check_seed,
    check_type,
    refusal,
)
from ccr_gym.episodes import EpisodeBatch, ForceReading, PrivilegedState
from ccr_gym.observation import FORCE_SCALE_N
from ccr_gym.rendering import Frame, Renderer
from ccr_gym.reward import TERMS
from ccr_gym.settings import Settings
from ccr_gym.tasks import SET_POINT, Assignment, Task, check_task
from solver import Scene

Observation = np.ndarray | dict[str, np.ndarray]
METADATA: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 20}


class ContactEnv(gymnasium.Env[Observation, np.ndarray]):
    """Push an obstacle with a desired force; every step is the exact equilibrium after a cable increment.

    Args:
        task: What an episode asks.
        render_mode: ``None``, ``"rgb_array"`` or ``"human"``.
        **settings: Fields of :class:`ccr_gym.settings.Settings`.

    Raises:
        TypeError: If there is no argument of that name, or one should be an object of another class.
        ValueError: If an argument is out of range; the message names the bound.
    """

    metadata = METADATA

    def __init__(self, task: Task, render_mode: str | None = None, **settings: Any) -> None:
        if render_mode is not None:
            check_choice("render_mode", render_mode, choices=METADATA["render_modes"])
        self.task, self.render_mode = task, render_mode
        self.settings = make_settings(type(self).__name__, task, settings, ("task", "render_mode"))
        self._episodes = EpisodeBatch(task, self.settings, 1)
        self._renderer: Renderer | None = None
        self._started = False
        self.observation_space, self.action_space = single_spaces(self._episodes, self.settings)
        self._shape = (self._episodes.body.actions,)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode with the straight robot and a new scene and set-point.

        A reset that raises changes nothing: neither the episode nor the generator.

        Args:
            seed: Seeds the environment's generator: a whole number from 0 on, or ``None`` to go on drawing.
            options: ``{"scene": Scene, "desired_force": float}`` fixes the assignment instead of drawing it [N]; the
                force is a vector where the task asks for one.

        Raises:
            RuntimeError: If the task and the robot do not fit: no draw of many is feasible.
            TypeError: If the options are no mapping, or the scene is no Scene.
            ValueError: If the seed is no whole number from 0 on, or the options are incomplete or out of range.
        """
        seed = check_seed("seed", seed)
        given = _assignment(options, self.task)
        generator = self._np_random, self._np_random_seed
        super().reset(seed=seed)
        try:
            if given is None:
                self._episodes.draw([0], [self.np_random])
            else:
                self._episodes.give(0, given, self.np_random)
        except BaseException:
            self._np_random, self._np_random_seed = generator
            raise
        self._started = True
        if self.render_mode == "human":
            self.render()
        reading = self._episodes.read(0)
        return self._observation(reading), self._episodes.infos(reading, (0.0,) * len(TERMS), 0)

    def step(self, action: np.ndarray) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Move the cable by ``action · max_increment_mm``, as far as tension and obstacles allow.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
            ValueError: If the action is not finite real numbers of the right shape; the state stays as it was.
        """
        self._check_started("step")
        pull = check_array("action", action, self._shape)
        episodes = self._episodes
        episodes.step(episodes.body.effort(pull), 0)
        reading = episodes.read(0)
        terms = tuple(map(float, episodes.rewards(reading, 0)))
        if self.render_mode == "human":
            self.render()
        return self._observation(reading), sum(terms), False, False, episodes.infos(reading, terms, 0)

    def render(self) -> np.ndarray | None:
        """The robot, obstacles, contacts, forces and set-point: ``(H, W, 3)`` uint8, or a window in human mode."""
        if self.render_mode is None or not self._started:
            gymnasium.logger.warn("render() needs render_mode='rgb_array' or 'human', and a reset")
            return None
        self._renderer = self._renderer or Renderer(self.metadata["render_fps"])
        reading = self._episodes.read(0)
        frame = Frame(self.equilibrium, reading.force_true, reading.force_est, reading.desired, FORCE_SCALE_N)
        if self.render_mode == "rgb_array":
            return self._renderer.draw(frame)
        self._renderer.show(frame)
        return None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    @property
    def equilibrium(self) -> Any:
        """The present equilibrium; immutable.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
        """
        self._check_started("equilibrium")
        return self._episodes.equilibrium(0)

    @property
    def privileged_state(self) -> PrivilegedState:
        """What no agent sees.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
        """
        self._check_started("privileged_state")
        return self._episodes.privileged_state(0)

    def probe(self, places: np.ndarray) -> np.ndarray:
        """Force on the robot that counts, ``(d,)`` [N], if what the actions move were elsewhere ``(actions,)`` [mm].

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
            ValueError: If the places are not finite real numbers of the right shape.
        """
        self._check_started("probe")
        return np.asarray(self._episodes.probe(check_array("places", places, self._shape)[None])[0])

    def _check_started(self, asked: str) -> None:
        if not self._started:
            raise gymnasium.error.ResetNeeded(f"call reset() before {asked}")

    def _observation(self, reading: ForceReading) -> Observation:
        row = self._episodes.observe(reading, 0)
        return row if self.settings.obs_mode == "flat" else self._episodes.observer.entries(row)


def single_spaces(episodes: EpisodeBatch, settings: Settings) -> tuple[spaces.Space[Any], spaces.Box]:
    """Spaces of what one environment shows and takes."""
    flat = settings.obs_mode == "flat"
    return episodes.observer.flat_space if flat else episodes.observer.dict_space, spaces.Box(
        -1.0, 1.0, (episodes.body.actions,), np.float32
    )


def make_settings(name: str, task: Any, given: dict[str, Any], others: Sequence[str]) -> Settings:
    """Settings of an environment from its keyword arguments.

    Args:
        name: What the environment is called.
        task: Its task.
        given: The keyword arguments.
        others: Its arguments that are no settings, for the message about one of another name.

    Raises:
        TypeError: If there is no argument of that name, or one should be an object of another class.
        ValueError: If one is out of range.
    """
    check_task(task)
    kind = task.body.settings
    check_names(name, given, [*others, *(declared.name for declared in fields(kind))])
    settings: Settings = kind(**given)
    return settings


def _assignment(options: Any, task: Task) -> Assignment | None:
    """The scene and the set-point of options, or ``None`` if there are none."""
    wanted = "None, or a mapping of both 'scene' and 'desired_force'"
    check_type("options", options, Mapping | None, wanted)
    if not options:
        return None
    if set(options) != {"scene", "desired_force"}:
        raise refusal("options", options, wanted)
    scene = options["scene"]
    check_type("scene", scene, Scene)
    space = task.body.model.space
    if any(obstacle.space != space for obstacle in scene):
        kinds = ("of the plane", "in space")
        raise refusal("scene", scene, "of obstacles {}, not {}".format(*kinds if space == 2 else kinds[::-1]))
    shape = (space,) if task.force_vector else ()
    force = check_array("desired_force", options["desired_force"], shape)
    check_number("desired_force", math.hypot(*force) if shape else float(force), **SET_POINT)
    return Assignment(scene, force)
