"""The single environment."""

import math
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium import spaces

from ccr_gym.checks import require
from ccr_gym.fleet import Fleet, Reading, Truth
from ccr_gym.observation import FORCE_SCALE_N
from ccr_gym.rendering import Frame, Renderer, draw_plane
from ccr_gym.reward import TERMS
from ccr_gym.settings import Settings
from ccr_gym.spatial_rendering import draw_space
from ccr_gym.tasks import Assignment, Task

Observation = np.ndarray | dict[str, np.ndarray]
WORLDS = {2: draw_plane, 3: draw_space}
METADATA: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 20}


class ContactEnv(gymnasium.Env[Observation, np.ndarray]):
    """Push an obstacle with a desired force; every step is the exact equilibrium after a cable increment.

    Args:
        task: What an episode asks.
        render_mode: ``None``, ``"rgb_array"`` or ``"human"``.
        **settings: Fields of :class:`ccr_gym.settings.Settings`.

    Raises:
        ValueError: If an argument is out of range; the message names the bound.
    """

    metadata = METADATA

    def __init__(self, task: Task, render_mode: str | None = None, **settings: Any) -> None:
        require(
            render_mode is None or render_mode in self.metadata["render_modes"],
            f"render_mode is {render_mode!r}; it must be None or one of {self.metadata['render_modes']}",
        )
        self.task, self.settings, self.render_mode = task, task.body.settings(**settings), render_mode
        self._fleet = Fleet(task, self.settings, 1)
        self._renderer: Renderer | None = None
        self._started = False
        self.observation_space, self.action_space = single_spaces(self._fleet, self.settings)
        self._shape = self.action_space.shape

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode with the straight robot and a new scene and set-point.

        Args:
            seed: Seeds the environment's generator.
            options: ``{"scene": Scene, "desired_force": float}`` fixes the assignment instead of drawing it [N]; the
                force is a vector where the task asks for one.

        Raises:
            ValueError: If the options are incomplete or out of range.
        """
        super().reset(seed=seed)
        if options:
            self._fleet.give(0, _assignment(options, self.task), self.np_random)
        else:
            self._fleet.draw([0], [self.np_random])
        self._started = True
        if self.render_mode == "human":
            self.render()
        reading = self._fleet.read(0)
        return self._observation(reading), self._fleet.infos(reading, (0.0,) * len(TERMS), 0)

    def step(self, action: np.ndarray) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Move the cable by ``action · max_increment_mm``, as far as tension and obstacles allow.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
            ValueError: If the action has the wrong shape or is not finite; the state stays as it was.
        """
        if not self._started:
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        pull = np.asarray(action)
        if pull.shape != self._shape or not all(map(math.isfinite, pull.tolist())):
            raise ValueError(f"action is {action!r}; it must be finite numbers of shape {self._shape}")
        fleet = self._fleet
        fleet.step(fleet.body.effort(pull), 0)
        reading = fleet.read(0)
        terms = tuple(map(float, fleet.rewards(reading, 0)))
        if self.render_mode == "human":
            self.render()
        return self._observation(reading), sum(terms), False, False, fleet.infos(reading, terms, 0)

    def render(self) -> np.ndarray | None:
        """The robot, obstacles, contacts, forces and set-point: ``(H, W, 3)`` uint8, or a window in human mode."""
        if self.render_mode is None or not self._started:
            gymnasium.logger.warn("render() needs render_mode='rgb_array' or 'human', and a reset")
            return None
        self._renderer = self._renderer or Renderer(self.metadata["render_fps"], WORLDS[self.task.body.model.space])
        reading = self._fleet.read(0)
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
        """The present equilibrium; immutable."""
        return self._fleet.equilibrium(0)

    @property
    def truth(self) -> Truth:
        """What no agent sees."""
        return self._fleet.truth(0)

    def probe(self, places: np.ndarray) -> np.ndarray:
        """Force on the robot that counts, ``(d,)`` [N], if what the actions move were elsewhere ``(actions,)`` [mm]."""
        return np.asarray(self._fleet.probe(places[None])[0])

    def _observation(self, reading: Reading) -> Observation:
        row = self._fleet.observe(reading, 0)
        return row if self.settings.obs_mode == "flat" else self._fleet.observer.entries(row)


def single_spaces(fleet: Fleet, settings: Settings) -> tuple[spaces.Space[Any], spaces.Box]:
    """Spaces of what one environment shows and takes."""
    flat = settings.obs_mode == "flat"
    return fleet.observer.flat_space if flat else fleet.observer.dict_space, spaces.Box(
        -1.0, 1.0, (fleet.body.actions,), np.float32
    )


def _assignment(options: dict[str, Any], task: Task) -> Assignment:
    require(
        options.keys() == {"scene", "desired_force"},
        f"options has {sorted(options)}; give both 'scene' and 'desired_force', or neither",
    )
    force = np.array(options["desired_force"], float)
    shape = (task.body.model.space,) if task.force_vector else ()
    require(force.shape == shape, f"desired_force is {force}; it must have the shape {shape}")
    size = float(np.linalg.norm(force)) if shape else float(force)
    require(0 < size <= FORCE_SCALE_N, f"desired_force is {force}; it must be positive and at most {FORCE_SCALE_N}")
    return Assignment(options["scene"], force)
